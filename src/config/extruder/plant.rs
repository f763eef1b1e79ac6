//! `[extruder_plant]`: what answers the extruder's commands in a simulated
//! cell. Nothing here moves a real machine, so most keys have defaults.

use super::screw::read_screw;
use crate::config::table::Table;
use crate::extruder::screw::{Screw, ScrewDesign};
use crate::model::TransferFunction;
use crate::time::Span;

const ANY: std::ops::RangeInclusive<f64> = -1e12..=1e12;
/// Coefficients that a numerator or a denominator may have.
const COUNTS: [usize; 6] = [1, 2, 3, 4, 5, 6];

/// The simulated extruder of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderPlant {
    /// What turns commands into flow.
    pub kind: PlantKind,
    /// From the order to run until material moves.
    pub start_delay: Span,
    /// From the order to stop until nothing moves.
    pub stop_delay: Span,
    /// From the order to open or shut the valve until it has done so.
    pub valve_delay: Span,
}

/// What turns commands into flow.
#[derive(Debug, Clone, PartialEq)]
pub enum PlantKind {
    /// A transfer function, or a number, with what no model tells.
    Linear(LinearPlant),
    /// A screw that is filled through its feed.
    Screw(ScrewPlant),
}

/// A linear plant from command to flow.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPlant {
    /// From command to flow \[mm³/s per unit of the command\].
    pub transfer: TransferFunction,
    /// An input that the controller does not know of: its value at the start
    /// of the run \[unit of the command\].
    pub unknown_input: f64,
    /// How fast that grows \[unit of the command per second\].
    pub unknown_input_per_s: f64,
    /// Standard deviation of a flow that no model tells \[mm³/s\].
    pub flow_noise: f64,
    /// How long that hangs together \[s\].
    pub flow_noise_lag_s: f64,
    /// Noise of a sensor of the flow \[mm³/s\]; none has no sensor.
    pub sensor_noise: Option<f64>,
}

/// A screw in a simulated cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewPlant {
    /// The screw as it is.
    pub screw: Screw,
    /// Flow of a screw that is filled all along, at its mean speed \[mm³/s\].
    pub full_flow_mm3_per_s: f64,
    /// Filled length at the start of the run \[m\].
    pub start_m: f64,
    /// Share of full that was fed until then.
    pub before: f64,
    /// Noise of the sensor of the filled length \[mm\].
    pub sensor_noise_mm: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Direct,
    Linear,
    Screw,
}

const WORDS: [(&str, Word); 3] =
    [("direct", Word::Direct), ("linear", Word::Linear), ("screw", Word::Screw)];

impl ExtruderPlant {
    /// Reads `[extruder_plant]`.
    pub fn read(table: &Table<'_>) -> Option<Self> {
        let word = table.required_choice("kind", &WORDS);
        let kind = word.and_then(|word| match word {
            Word::Direct => {
                let gain = table.number("gain_mm3_per_s", 1e-9..=1e12)?;
                let transfer = TransferFunction::gain(gain).ok()?;
                read_linear(table, transfer).map(PlantKind::Linear)
            }
            Word::Linear => {
                let transfer = read_transfer(table)?;
                read_linear(table, transfer).map(PlantKind::Linear)
            }
            Word::Screw => read_screw_plant(table).map(PlantKind::Screw),
        });
        if kind.is_none() {
            table.pass_over();
        }
        let delay = |key| table.number_or(key, 0.0..=60.0, 0.0).map(Span::from_secs);
        let (start, stop) = (delay("start_delay_s"), delay("stop_delay_s"));
        let valve = delay("valve_delay_s");
        Some(Self { kind: kind?, start_delay: start?, stop_delay: stop?, valve_delay: valve? })
    }
}

fn read_transfer(table: &Table<'_>) -> Option<TransferFunction> {
    let num = table.row("numerator", &COUNTS, ANY);
    let den = table.row("denominator", &COUNTS, ANY);
    let dead_time = table.number_or("dead_time_s", 0.0..=1e3, 0.0);
    let (num, den) = (num?, den?);
    let transfer = match TransferFunction::new(&num, &den, dead_time?) {
        Ok(transfer) => transfer,
        Err(error) => {
            table.report("denominator", format!("{den:?}"), error.to_string());
            return None;
        }
    };
    if !transfer.is_stable() {
        table.report("denominator", format!("{den:?}"), "a plant that is stable");
        return None;
    }
    Some(transfer)
}

fn read_linear(table: &Table<'_>, transfer: TransferFunction) -> Option<LinearPlant> {
    let unknown = table.number_or("unknown_input", ANY, 0.0);
    let unknown_per_s = table.number_or("unknown_input_per_s", ANY, 0.0);
    let noise = table.number_or("flow_noise_mm3_per_s", 0.0..=1e12, 0.0);
    let lag = table.number_or("flow_noise_lag_s", 1e-3..=1e3, 0.15);
    let sensor = table.optional_number("flow_sensor_noise_mm3_per_s", 0.0..=1e12);
    Some(LinearPlant {
        transfer,
        unknown_input: unknown?,
        unknown_input_per_s: unknown_per_s?,
        flow_noise: noise?,
        flow_noise_lag_s: lag?,
        sensor_noise: sensor,
    })
}

fn read_screw_plant(table: &Table<'_>) -> Option<ScrewPlant> {
    let screw = read_screw(table, Some(ScrewDesign::DIAGNE_2015));
    let full = table.number("full_flow_mm3_per_s", 1e-9..=1e12);
    let start = table.number_or("start_filled_mm", 0.0..=1e5, 100.0);
    let noise = table.number_or("filled_noise_mm", 0.0..=1e3, 0.0);
    let (screw, start_m) = (screw?, start? / 1000.0);
    if start_m >= screw.length_m {
        let found = format!("{} mm", start_m * 1000.0);
        table.report("start_filled_mm", found, "less than length_mm");
        return None;
    }
    Some(ScrewPlant {
        screw,
        full_flow_mm3_per_s: full?,
        start_m,
        before: screw.holding(start_m),
        sensor_noise_mm: noise?,
    })
}
