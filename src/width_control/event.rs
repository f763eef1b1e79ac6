//! Everything that can happen to a controller.

use serde::{Deserialize, Serialize};

use crate::core::time::Stamp;
use crate::core::units::{Mm, MmPerS};
use crate::extruder::ExtruderReport;

/// What the controller is told. Recorded as it is, so that a replay feeds the
/// same events to the same code.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Event {
    /// A frame was measured.
    Measured {
        /// Number of the frame.
        frame: u64,
        /// When the frame was captured; control acts on this, not on arrival.
        captured_at: Stamp,
        /// Width of the bead at the surface.
        width_mm: Mm,
        /// Standard deviation of that width, as the measurement believes it.
        sigma_mm: Mm,
    },
    /// A frame was looked at and refused, or could not be read.
    Rejected {
        /// Number of the frame.
        frame: u64,
        /// When the frame was captured.
        captured_at: Stamp,
        /// The status that the frame gets in `widths.csv`.
        reason: String,
    },
    /// The robot reported its state.
    Robot(RobotState),
    /// The link to the robot came up, or came up again.
    LinkUp {
        /// What the robot said of itself.
        robot: RobotLimits,
    },
    /// The link to the robot was lost.
    LinkDown {
        /// Why, in words for the operator.
        reason: String,
    },
    /// The robot refused a line.
    Refused {
        /// Number of the setpoint that was refused.
        seq: u64,
        /// `STALE`, `RANGE`, `SEQUENCE`, `MODE` or `FORM`.
        code: String,
    },
    /// It is time for a setpoint: the fixed rate of the robot link.
    Tick,
    /// The extruder reported.
    Extruder(ExtruderReport),
    /// The link to the extruder came up, or came up again.
    ExtruderUp,
    /// The link to the extruder was lost.
    ExtruderDown {
        /// Why, in words for the operator.
        reason: String,
    },
    /// The extruder refused a line.
    ExtruderRefused {
        /// Number of the command that was refused.
        seq: u64,
        /// `STALE`, `RANGE`, `SEQUENCE`, `MODE` or `FORM`.
        code: String,
    },
    /// It is time for a step of the extruder's feedforward.
    ExtruderTick,
    /// The camera gives no more frames.
    CameraLost {
        /// Why, in words for the operator.
        reason: String,
    },
    /// An event or a step could not be recorded.
    RecordingLost,
    /// The run is being ended: by the operator, the clock or the last frame.
    Stop,
}

/// What the robot does, in the words of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum RobotMode {
    /// Not printing.
    Idle,
    /// Laying bead.
    Print,
    /// Laying bead at its own hold speed, because no setpoint is valid.
    Hold,
    /// Stopped by command or for want of setpoints.
    Stop,
    /// Stopped by a fault of its own.
    Fault,
}

impl RobotMode {
    /// Whether bead is laid.
    pub fn lays_bead(self) -> bool {
        matches!(self, Self::Print | Self::Hold)
    }
}

/// One `STATE` of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// The robot's own clock \[ms\].
    pub t_ms: u64,
    /// Last setpoint that it applied on this connection; 0 is none.
    pub seq: u64,
    /// What it does.
    pub mode: RobotMode,
    /// Speed along the path.
    pub speed_mm_per_s: MmPerS,
    /// Distance of the nozzle along the path.
    pub path_mm: Mm,
    /// Height of the nozzle in the robot's frame.
    pub z_mm: Mm,
}

/// What the robot says of itself when the link comes up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotLimits {
    /// Its name.
    pub name: String,
    /// Slowest setpoint that it takes.
    pub min_mm_per_s: MmPerS,
    /// Fastest setpoint that it takes.
    pub max_mm_per_s: MmPerS,
    /// Speed to which it goes when setpoints run out.
    pub hold_mm_per_s: MmPerS,
}
