//! `[extruder.adaptive]`: the plant that the adaptive controller of the nozzle is made
//! for, and its gains. There are no defaults for gains.

use super::command::ANY_COMMAND;
use super::context::ReadContext;
use crate::core::{Mm2, Span};
use crate::document::Table;
use crate::extruder::adaptive::{
    Adaptation, AdaptiveGains, EstimateBounds, MracController, ScalarPlant,
};
use crate::extruder::strategy::NozzleModel;

/// The adaptive controller of a nozzle, and that nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveSettings {
    /// The adaptive controller.
    pub controller: MracController,
    /// The nozzle, which converts flow to speed.
    pub nozzle: NozzleModel,
}

/// Reads the table. The controller's own conditions are checked here.
pub(super) fn read(table: &Table<'_>, context: &ReadContext<'_>) -> Option<AdaptiveSettings> {
    let state = table.number("state_gain_per_s", ANY_COMMAND);
    let input = table.number("input_gain", ANY_COMMAND);
    let feedback = table.number("feedback", ANY_COMMAND);
    let error_feedback = table.number_or("error_feedback", ANY_COMMAND, 0.0);
    let rate = table.number("learning_rate", 0.0..=1e12);
    let weight = table.number_or("weight", 1e-9..=1e9, 1.0);
    let slope_rate = table.number_or("slope_rate_per_s", 0.0..=1e6, 0.0);
    let bound = table.optional_number("bound_kg_per_s", 1e-12..=1e9);
    let leakage = table.number_or("leakage_per_s", 0.0..=1e3, 0.0);
    let section = table.number("nozzle_section_mm2", 1e-6..=1e9);
    let pressure = table.number_or("pressure_kg_per_s", ANY_COMMAND, 0.0);
    let (learning_rate, weight) = (rate?, weight?);
    let adaptation = match slope_rate? {
        _ if learning_rate == 0.0 => Adaptation::Off,
        0.0 => Adaptation::Constant { learning_rate, weight },
        slope_rate_per_s => Adaptation::Ramp { learning_rate, weight, slope_rate_per_s },
    };
    let gains = AdaptiveGains {
        feedback: feedback?,
        error_feedback: error_feedback?,
        adaptation,
        safety: EstimateBounds { bound, leakage_per_s: leakage? },
    };
    let plant = ScalarPlant { state_gain_per_s: state?, input_gain: input? };
    let hold = Span::from_secs(1.0 / context.rates.control_hz);
    match MracController::new(plant, gains, hold) {
        Ok(controller) => {
            let section = Mm2::new(section?).ok()?;
            let nozzle = NozzleModel { section, pressure_kg_per_s: pressure? };
            Some(AdaptiveSettings { controller, nozzle })
        }
        Err(error) => {
            table.report("feedback", gains.feedback.to_string(), error.to_string());
            None
        }
    }
}
