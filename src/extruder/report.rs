//! Reports of an extruder and commands to it.

use serde::{Deserialize, Serialize};

use super::drive::CommandQuantity;
use crate::core::{MPa, Mm, Mm3PerS, Rpm};

/// State of the pump of an extruder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum PumpMode {
    /// It stands.
    Off,
    /// It is commanded to run and material does not flow yet.
    Starting,
    /// It runs.
    On,
    /// It is commanded to stop and material still flows.
    Stopping,
    /// It stopped by a fault of its own.
    Fault,
}

/// One report of an extruder. Quantities without a sensor are absent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExtruderReport {
    /// State of the pump.
    pub pump: PumpMode,
    /// Whether the shut-off valve is open; true where there is none.
    pub valve_open: bool,
    /// Speed of the screw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub screw_rpm: Option<Rpm>,
    /// Pressure at the nozzle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure_mpa: Option<MPa>,
    /// Flow through the nozzle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flow_mm3_per_s: Option<Mm3PerS>,
    /// Length of the screw that is filled, measured from the die's end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filled_mm: Option<Mm>,
}

/// Command and range of an extruder, which it reports when the link comes up.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderLimits {
    /// Its name.
    pub name: String,
    /// Quantity of its command.
    pub quantity: CommandQuantity,
    /// Smallest command that it accepts while the pump runs, in the unit of `quantity`.
    pub min: f64,
    /// Largest command that it accepts, in the same unit.
    pub max: f64,
}

/// A command to the extruder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExtruderCommand {
    /// Whether the pump has to run.
    pub pump_on: bool,
    /// Whether the shut-off valve has to be open.
    pub valve_open: bool,
    /// Value, in the unit of the cell's command.
    pub value: f64,
}
