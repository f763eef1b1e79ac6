//! Everything that can happen to a controller.

use serde::{Deserialize, Serialize};

use crate::core::{Mm, RefusalReason, RobotLimits, RobotState, Stamp};
use crate::extruder::ExtruderReport;

/// What the controller reacts to. Recorded as it is, so that a replay feeds the
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
        /// Standard deviation of that width, as the measurement estimates it.
        sigma_mm: Mm,
    },
    /// A frame was measured whose pixels are equal to those of the frames before it. It counts
    /// as not captured if the robot has moved meanwhile, otherwise as measured.
    Repeated {
        /// Number of the frame.
        frame: u64,
        /// When the frame was captured.
        captured_at: Stamp,
        /// When the first of the equal frames was captured.
        first_at: Stamp,
        /// Width of the bead at the surface.
        width_mm: Mm,
        /// Standard deviation of that width, as the measurement estimates it.
        sigma_mm: Mm,
    },
    /// A frame was rejected by the measurement, or could not be read.
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
        /// Limits that the robot reported.
        robot: RobotLimits,
    },
    /// The link to the robot was lost.
    LinkDown {
        /// Why, in words for the operator.
        reason: String,
    },
    /// The robot refused a setpoint or a stop.
    SetpointRefused {
        /// Why.
        reason: RefusalReason,
        /// What was refused and why, in words for the operator.
        text: String,
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
    /// The extruder refused a command.
    ExtruderRefused {
        /// Why.
        reason: RefusalReason,
        /// What was refused and why, in words for the operator.
        text: String,
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
