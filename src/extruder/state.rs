//! The state of the extruder side, and the numbers behind a command.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use super::limits::CommandLimit;
use crate::core::units::Mm3PerS;

/// Why the last command is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtruderHold {
    /// The extruder's link is down.
    LinkDown,
    /// No report for longer than the cell allows, or none with what the law
    /// needs.
    NoReading,
    /// What is reported cannot be true.
    BadReading,
    /// The valve is shut although it was told to open.
    ValveShut,
    /// The screw does not turn as it was told.
    SpeedMismatch,
}

/// Why the extruder was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtruderFault {
    /// Held for longer than the cell allows, for this reason.
    HeldTooLong(ExtruderHold),
    /// A bead began, or the pump begins anew on one, and no extruder reports.
    NoAnswer,
    /// The pump was told to run and did not.
    DidNotStart,
    /// The pump was told to stop and runs on. Left when it says that it stops.
    RunsOn,
    /// The pump stopped by itself, or reports a fault.
    Pump,
    /// The pressure at the nozzle rose above what the cell allows.
    Overpressure,
    /// The screw did not turn as it was told.
    SpeedMismatch,
}

/// What the extruder side is doing after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtruderState {
    /// No bead is laid; the pump is off, and the valve shut unless it lets too high
    /// a pressure out.
    #[default]
    Off,
    /// The pump was told to run.
    Starting,
    /// The law commands.
    Running,
    /// The last command is kept.
    Holding(ExtruderHold),
    /// The pump was told to stop before the bead ends; what still comes fills the rest.
    Ending,
    /// The pump was told to stop. Left when the robot is idle again, unless the
    /// fault says more.
    Fault(ExtruderFault),
}

impl ExtruderState {
    /// The state's name, without its reason.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// The numbers behind a command.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ExtruderTrace {
    /// Flow that is wanted at the nozzle.
    pub flow_mm3_per_s: Mm3PerS,
    /// Flow that the law foretells there, where it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_mm3_per_s: Option<Mm3PerS>,
    /// Part of the wish that was known beforehand, in the command's unit.
    pub feedforward: f64,
    /// Part that answers what was measured, in the command's unit.
    pub feedback: f64,
    /// The limit that acted.
    pub limit: CommandLimit,
}
