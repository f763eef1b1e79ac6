//! What a controller decides, and why.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use crate::core::{Mm, MmPerS, Stamp};
use crate::extruder::{ExtruderCommand, ExtruderFault, ExtruderState, ExtruderTrace};
use crate::width_control::SpeedLimit;
use crate::width_control::distance::{DistanceTrace, FallbackReason};
use crate::width_control::steps::StepsTrace;

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
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Hold {
    /// No width for longer than the cell allows.
    NoWidth,
    /// The robot holds its own speed.
    RobotHolds,
    /// The link to the robot is down.
    LinkDown,
    /// The robot does not move at the speed that it was told.
    SpeedMismatch,
    /// The robot's limits are narrower than the cell's.
    RobotLimits,
    /// An event or a step could not be recorded. Left only by a new run.
    RecordingLost,
    /// The camera gives no more frames. Left only by a new run.
    CameraLost,
    /// The run is being ended. Left only by a new run.
    Stopping,
}

/// Why the controller gave up. Left only by a new bead.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Fault {
    /// Held for longer than the cell allows, for this reason.
    HeldTooLong(Hold),
    /// The robot did not move at the speed that it was told.
    SpeedMismatch,
    /// The robot stopped with a fault of its own.
    Robot,
    /// The robot stopped without having been told to.
    RobotStopped,
    /// The extruder was stopped.
    Extruder(ExtruderFault),
}

/// The state that the controller is in after a step.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum State {
    /// The robot is not printing.
    #[default]
    Idle,
    /// First stretch of a bead, at the start speed.
    Priming,
    /// The width is being corrected.
    Tracking,
    /// The speed is kept as it is.
    Holding(Hold),
    /// The robot has been told to stop.
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
    /// Where along the path the bead that was measured had been laid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bead_path_mm: Option<Mm>,
    /// Distance of the nozzle along the path when the frame was captured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nozzle_path_mm: Option<Mm>,
    /// Whether bead of this run lies under the camera: false before a bead has
    /// come so far, and while the robot is idle.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub bead_expected: bool,
    /// Measured less wanted width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<Mm>,
    /// Part of the demand that is proportional to the error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proportional_mm_per_s: Option<MmPerS>,
    /// Part of the demand that the controller has gathered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integral_mm_per_s: Option<MmPerS>,
    /// Speed that the controller would like.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub demand_mm_per_s: Option<MmPerS>,
    /// What the law by distance made of the width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance: Option<DistanceTrace>,
    /// Why the width is held by the PI law instead of the one by distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallback: Option<FallbackReason>,
    /// How far the course of steps is, where the cell asks for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<StepsTrace>,
    /// The last limit that acted.
    pub limit: SpeedLimit,
}

/// What the extruder side did.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ExtruderStep {
    /// What to send to the extruder now; often nothing.
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
    /// What to send to the robot now; mostly nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<Command>,
    /// The state after the event.
    pub state: State,
    /// The numbers behind it.
    pub trace: Trace,
    /// The extruder side's part, in the steps that are its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extruder: Option<ExtruderStep>,
}
