//! The state of the extruder side, and the numbers behind a command.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use super::limits::CommandLimit;
use crate::core::Mm3PerS;

/// Why the last command is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtruderHold {
    /// The extruder's link is down.
    LinkDown,
    /// No report for longer than the cell allows, or none with what the strategy needs.
    NoReading,
    /// A report is implausible.
    BadReading,
    /// The valve is closed although it is commanded to open.
    ValveShut,
    /// The screw does not turn at its commanded speed.
    SpeedMismatch,
}

/// Why the extruder was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtruderFault {
    /// Held for longer than the cell allows, for this reason.
    HeldTooLong(ExtruderHold),
    /// A bead began, or the pump starts again on one, and no extruder reports.
    NoAnswer,
    /// The pump was commanded to run and did not.
    DidNotStart,
    /// The pump was commanded to stop and runs on. Left when it reports that it stops.
    RunsOn,
    /// The pump stopped by itself, or reports a fault.
    Pump,
    /// The pressure at the nozzle rose above what the cell allows.
    Overpressure,
    /// The screw did not turn at its commanded speed.
    SpeedMismatch,
    /// The pressure did not answer a step of its target.
    NoPressureResponse,
}

/// What the extruder side is doing after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtruderState {
    /// No bead is laid; the pump is off, and the valve closed unless it relieves the pressure.
    #[default]
    Off,
    /// The pump is commanded to run.
    Starting,
    /// The strategy commands.
    Running,
    /// The last command is kept.
    Holding(ExtruderHold),
    /// The pump was stopped before the bead ends; the flow after the stop fills the rest.
    Ending,
    /// The pump is commanded to stop. Left when the robot is idle again, unless the fault says
    /// more.
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
    /// Demanded flow at the nozzle.
    pub flow_mm3_per_s: Mm3PerS,
    /// Predicted flow there, where the strategy has a prediction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub predicted_mm3_per_s: Option<Mm3PerS>,
    /// Feedforward part of the demand, in the command's unit.
    pub feedforward: f64,
    /// Feedback part, in the command's unit.
    pub feedback: f64,
    /// The limit that acted.
    pub limit: CommandLimit,
}
