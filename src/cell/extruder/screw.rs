//! `[extruder.screw]`: a screw as its maker describes it, and what is asked of
//! its predictor; and the same screw in a simulated cell.

use super::context::About;
use crate::core::time::Span;
use crate::core::units::{Mm, Rpm};
use crate::document::Table;
use crate::extruder::screw::control::{Scheme, ScrewSettings};
use crate::extruder::screw::feasible::Feasibility;
use crate::extruder::screw::feedback::Setpoint;
use crate::extruder::screw::{
    FillLaw, PiecewiseExponential, Pulsation, Saturated, Screw, ScrewDesign, TurnUnit,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum LawWord {
    Exponential,
    Saturated,
}

/// A screw. Absent keys have the values of `usual`, or are reported where there
/// is none.
pub fn read_screw(table: &Table<'_>, usual: Option<ScrewDesign>) -> Option<Screw> {
    let number =
        |key, range: std::ops::RangeInclusive<f64>, value: fn(&ScrewDesign) -> f64| match &usual {
            Some(usual) => table.number_or(key, range, value(usual)),
            None => table.number(key, range),
        };
    let length = number("length_mm", 1e-3..=1e5, |usual| usual.length.get());
    let pitch = number("pitch_mm", 1e-6..=1e4, |usual| usual.pitch.get());
    let speed = number("speed_rpm", 1e-6..=1e5, |usual| usual.speed.get());
    let nozzle = number("nozzle_m3", 1e-18..=1.0, |usual| usual.nozzle_m3);
    let channel = number("channel_m4", 1e-20..=1.0, |usual| usual.channel_m4);
    let density = number("density_kg_per_m3", 1.0..=1e5, |usual| usual.density_kg_per_m3);
    let unit = table.choice("turn_unit", &[("rad", TurnUnit::RadPerS), ("rev", TurnUnit::RevPerS)]);
    let share = table.number_or("pulsation_share", 0.0..=0.99, 0.0);
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
    let pulsation = Pulsation { share: share?, rad_per_s: rad?, phase_rad: phase? };
    match design.screw(pulsation) {
        Ok(screw) => Some(screw),
        Err(error) => {
            table.report("length_mm", "a screw that cannot be", error.to_string());
            None
        }
    }
}

/// The predictor of a screw and its law.
pub(super) fn read_law(table: &Table<'_>, about: &About<'_>) -> Option<ScrewSettings> {
    let screw = read_screw(table, None);
    let setpoint = table.number("filled_mm", 1e-3..=1e5);
    let most = table.number("most_filling", 1e-3..=0.999);
    let slope = table.number("slope_per_m", 1e-3..=1e6);
    let law = table
        .choice("law", &[("exponential", LawWord::Exponential), ("saturated", LawWord::Saturated)]);
    let (screw, slope) = (screw?, slope?);
    let setpoint = Setpoint { plug: Mm::new(setpoint?).ok()?, most: most? };
    let law = match law? {
        LawWord::Exponential => {
            PiecewiseExponential::new(&screw, setpoint, slope).map(FillLaw::Exponential)
        }
        LawWord::Saturated => Saturated::new(&screw, setpoint, slope).map(FillLaw::Saturated),
    };
    let verdict = Feasibility::judge(&screw);
    if !verdict.is_feasible() {
        table.report("pulsation_share", "a screw whose feed may never arrive", verdict.to_string());
    }
    match law {
        Ok(law) => Some(ScrewSettings {
            screw,
            law,
            scheme: Scheme::Exact,
            // What is fed may change at every tick while a limit acts.
            period: Span::from_secs(1.0 / about.rates.feedforward_hz),
            before: law.hold(),
        }),
        Err(error) => {
            table.report("slope_per_m", slope.to_string(), error.to_string());
            None
        }
    }
}
