//! `[extruder.screw]`: the design of a screw and the settings of its predictor, and the screw of a
//! simulated cell.

use super::context::ReadContext;
use crate::core::{Mm, Rpm, Span};
use crate::document::Table;
use crate::extruder::screw::control::{Scheme, ScrewSettings};
use crate::extruder::screw::feasible::Feasibility;
use crate::extruder::screw::feedback::PlugSetpoint;
use crate::extruder::screw::{
    FillFeedback, PiecewiseExponential, SaturatedLinear, Screw, ScrewDesign, SpeedPulsation,
    TurnUnit,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum FeedbackWord {
    Exponential,
    Saturated,
}

/// Reads a screw. Absent keys have the values of `default`; without a default they are reported.
pub fn read_screw(table: &Table<'_>, default: Option<ScrewDesign>) -> Option<Screw> {
    let number = |key, range: std::ops::RangeInclusive<f64>, value: fn(&ScrewDesign) -> f64| {
        match &default {
            Some(default) => table.number_or(key, range, value(default)),
            None => table.number(key, range),
        }
    };
    let length = number("length_mm", 1e-3..=1e5, |default| default.length.get());
    let pitch = number("pitch_mm", 1e-6..=1e4, |default| default.pitch.get());
    let speed = number("speed_rpm", 1e-6..=1e5, |default| default.speed.get());
    let nozzle = number("nozzle_m3", 1e-18..=1.0, |default| default.nozzle_m3);
    let channel = number("channel_m4", 1e-20..=1.0, |default| default.channel_m4);
    let density = number("density_kg_per_m3", 1.0..=1e5, |default| default.density_kg_per_m3);
    let unit = table.choice("turn_unit", &[("rad", TurnUnit::RadPerS), ("rev", TurnUnit::RevPerS)]);
    let fraction = table.number_or("pulsation_fraction", 0.0..=0.99, 0.0);
    let rad = table.number_or("pulsation_rad_per_s", 0.0..=1e4, 0.0);
    let phase = table.number_or("pulsation_phase_rad", -1e3..=1e3, 0.0);
    let design = ScrewDesign {
        length: Mm::new(length?).ok()?,
        pitch: Mm::new(pitch?).ok()?,
        speed: Rpm::new(speed?).ok()?,
        unit: unit?,
        nozzle_m3: nozzle?,
        channel_m4: channel?,
        density_kg_per_m3: density?,
    };
    let pulsation =
        SpeedPulsation { relative_amplitude: fraction?, rad_per_s: rad?, phase_rad: phase? };
    match design.screw(pulsation) {
        Ok(screw) => Some(screw),
        Err(error) => {
            table.report("length_mm", "a screw that cannot be", error.to_string());
            None
        }
    }
}

/// Reads the predictor of a screw and its feedback.
pub(super) fn read_predictor(
    table: &Table<'_>,
    context: &ReadContext<'_>,
) -> Option<ScrewSettings> {
    let screw = read_screw(table, None);
    let setpoint = table.number("filled_mm", 1e-3..=1e5);
    let max_fill = table.number("max_filling", 1e-3..=0.999);
    let slope = table.number("slope_per_m", 1e-3..=1e6);
    let feedback = table.choice(
        "feedback",
        &[("exponential", FeedbackWord::Exponential), ("saturated", FeedbackWord::Saturated)],
    );
    let (screw, slope) = (screw?, slope?);
    let setpoint = PlugSetpoint { plug: Mm::new(setpoint?).ok()?, max_fill: max_fill? };
    let feedback = match feedback? {
        FeedbackWord::Exponential => {
            PiecewiseExponential::new(&screw, setpoint, slope).map(FillFeedback::Exponential)
        }
        FeedbackWord::Saturated => {
            SaturatedLinear::new(&screw, setpoint, slope).map(FillFeedback::Saturated)
        }
    };
    let verdict = Feasibility::judge(&screw);
    if !verdict.is_feasible() {
        table.report(
            "pulsation_fraction",
            "a screw whose feed may never arrive",
            verdict.to_string(),
        );
    }
    match feedback {
        Ok(feedback) => Some(ScrewSettings {
            screw,
            feedback,
            scheme: Scheme::Exact,
            // While a limit acts the feed may change at every tick.
            period: Span::from_secs(1.0 / context.rates.feedforward_hz),
            initial_fill: feedback.holding_fill(),
        }),
        Err(error) => {
            table.report("slope_per_m", slope.to_string(), error.to_string());
            None
        }
    }
}
