//! What a controller decides, and the reasons for it.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use crate::core::{Mm, MmPerS, Span, Stamp};
use crate::extruder::{ExtruderCommand, ExtruderFault, ExtruderState, ExtruderTrace};
use crate::width_control::SpeedLimit;
use crate::width_control::distance::{DistanceTrace, FallbackReason};
use crate::width_control::steps::StepsTrace;
use crate::width_control::watch::{NoResponse, WrongOffset};

/// What is to be sent to the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// A speed setpoint.
    Speed(MmPerS),
    /// A controlled stop.
    Stop,
}

/// Why the controller does not track.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Hold {
    /// No width for longer than the cell allows.
    NoWidth,
    /// Widths come, but too old to control with.
    SlowCamera {
        /// Age of the first such width when it arrived.
        age: Span,
        /// The longest time without a width.
        max_gap: Span,
    },
    /// Frames come, but with the pixels of those before them although the robot moves.
    CameraFrozen,
    /// The robot moves at its own hold speed.
    RobotHolds,
    /// The link to the robot is down.
    LinkDown,
    /// The robot does not move at its setpoint.
    SpeedMismatch,
    /// The robot's path grew by more than the robot can have moved. The bead under the camera
    /// is known again once what was laid after it is seen.
    PathJump {
        /// Growth of the path from one report to the next.
        step_mm: Mm,
    },
    /// The width does not answer the speed: the camera sees something else than the bead that is
    /// laid, or the flow is not what lays it. Left with the bead.
    NoResponse(NoResponse),
    /// The robot reports, and its clock does not rise: its path and speed are not known.
    RobotClock,
    /// The extruder has not reported for longer than a command is valid: its pump stands. The
    /// extruder side ends it with a fault.
    ExtruderSilent,
    /// The robot's limits are narrower than the cell's. Left only by a new run.
    RobotLimits,
    /// An event or a step could not be recorded. Left only by a new run.
    RecordingLost,
    /// The camera gives no more frames: no width ends it. A live run ends after it.
    CameraLost,
    /// The run is being ended. Left only by a new run.
    Stopping,
}

impl Hold {
    /// Whether widths are missing.
    pub fn is_for_widths(&self) -> bool {
        matches!(self, Self::NoWidth | Self::SlowCamera { .. } | Self::CameraFrozen)
    }

    /// Whether widths that come in time end it.
    pub fn ends_with_widths(&self) -> bool {
        self.is_for_widths() || matches!(self, Self::PathJump { .. })
    }
}

/// Why the controller stopped the robot. Left when the robot is idle again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Fault {
    /// Held for longer than the cell allows, for this reason.
    HeldTooLong(Hold),
    /// The robot did not move at its setpoint for too long.
    SpeedMismatch,
    /// The robot stopped with a fault of its own.
    Robot,
    /// The robot stopped without a command to stop.
    RobotStopped,
    /// The extruder is in fault.
    Extruder(ExtruderFault),
}

/// The state that the controller is in after a step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum State {
    /// The robot is not printing.
    #[default]
    Idle,
    /// The first part of a bead is laid at the start speed.
    Priming,
    /// The width controller sets the speed.
    Tracking,
    /// The speed is kept.
    Holding(Hold),
    /// The robot is commanded to stop.
    Fault(Fault),
}

impl State {
    /// The state's name, without its reason.
    pub fn name(&self) -> &'static str {
        self.into()
    }
}

/// What a step did and with which numbers, for the record and the plots.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Trace {
    /// Frame whose width was used; none where none was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<u64>,
    /// When that frame was captured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub captured_at: Option<Stamp>,
    /// Path at which the measured bead was laid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bead_path_mm: Option<Mm>,
    /// Path of the nozzle when the frame was captured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nozzle_path_mm: Option<Mm>,
    /// Whether bead of this run lies under the camera: false until it has come that far, and while
    /// the robot is idle.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub bead_expected: bool,
    /// Whether the frame was not used, because it is equal to those before it although the robot
    /// has moved.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub frame_repeated: bool,
    /// Whether the robot's report was not used, because the robot's clock had not risen.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub report_ignored: bool,
    /// Measured less target width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<Mm>,
    /// Part of the demand that is proportional to the error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proportional_mm_per_s: Option<MmPerS>,
    /// Integral part of the demand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integral_mm_per_s: Option<MmPerS>,
    /// Speed that the width controller demands, before the limits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub demand_mm_per_s: Option<MmPerS>,
    /// Estimates of control by distance after the width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<DistanceTrace>,
    /// Why PI control has taken over from control by distance, if it has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<FallbackReason>,
    /// The offset that fits the widths better than the stated one, from the width on that shows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrong_offset: Option<WrongOffset>,
    /// Progress of a step experiment, where the cell has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<StepsTrace>,
    /// The last limit that acted.
    pub limit: SpeedLimit,
}

/// What the extruder side did.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ExtruderStep {
    /// Command to send to the extruder now; often none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<ExtruderCommand>,
    /// The state after the event.
    pub state: ExtruderState,
    /// The numbers behind the command.
    pub trace: ExtruderTrace,
}

/// The answer to one event.
#[must_use = "a step says what to send to the robot"]
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Step {
    /// Command to send to the robot now; mostly none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<Command>,
    /// The state after the event.
    pub state: State,
    /// The numbers behind the command.
    pub trace: Trace,
    /// The extruder side's answer; `None` to events of the robot side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extruder: Option<ExtruderStep>,
}
