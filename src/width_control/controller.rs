//! The trait of a width controller, which sets the robot's speed from the measured widths,
//! and its inputs and outputs.
//!
//! The caller keeps the mode of the bead (priming, tracking, holding), limits setpoints and
//! sends them. A width controller reads no clock: time is an argument of each call.

use std::fmt::Debug;

use super::distance::{DistanceTrace, FallbackReason, WidthReading};
use super::pi::Saturation;
use super::steps::StepsTrace;
use crate::core::{Mm, MmPerS, Rpm, Span, Stamp};

/// Sets the robot's speed so that the bead has its width.
pub trait WidthController: Debug + Send {
    /// A new bead begins. The bead before it is no longer under the camera.
    fn begin_bead(&mut self) {}

    /// The bead goes on from the next report, and what was laid before tells nothing of it: the
    /// reported path goes on elsewhere, or the extruder had stopped.
    fn bead_interrupted(&mut self) {}

    /// The robot reports no path: the path of the next report or width is integrated from
    /// its speed.
    fn path_is_estimated(&mut self) {}

    /// The robot reported while it lays bead.
    fn robot_reported(&mut self, _: &BeadReport) {}

    /// The extruder reported the speed of its screw.
    fn screw_reported(&mut self, _: Stamp, _: Rpm) {}

    /// Takes a measured width. Returns the tracking state where this controller sets the speed
    /// after it, or still does; `None` where it does not (yet).
    fn measured(&mut self, sample: &WidthSample, trace: &mut WidthTrace) -> Option<Tracking>;

    /// A setpoint is due on a bead that is priming or tracking. A controller that can track
    /// without a new width returns the time up to which the width counts as known.
    fn before_setpoint(&mut self, _: &Outlook) -> Option<Stamp> {
        None
    }

    /// The speed of the next setpoint, while tracking. None keeps the last one.
    fn speed(&mut self, request: &SpeedRequest, trace: &mut WidthTrace) -> Option<MmPerS>;

    /// Why it has fallen back to another controller on this bead, if it has.
    fn fallback(&self) -> Option<FallbackReason> {
        None
    }
}

/// A width controller of any strategy.
pub type BoxedController = Box<dyn WidthController>;

/// A report of the robot while it lays bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadReport {
    /// When it arrived.
    pub at: Stamp,
    /// Path of the nozzle.
    pub path: Mm,
    /// Speed along the path.
    pub speed: MmPerS,
    /// Flow at the nozzle over the flow at the start speed, without a unit.
    pub flow_ratio: f64,
}

/// One measured width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthSample {
    /// When its frame was captured.
    pub captured_at: Stamp,
    /// The width and its standard deviation.
    pub reading: WidthReading,
    /// Measured less target width.
    pub error: Mm,
    /// Path of the nozzle when the frame was captured; none where that is not known.
    pub nozzle_path: Option<Mm>,
    /// Whether the bead in the frame is the one that is being laid.
    pub is_own_bead: bool,
    /// Capture time up to which the width was known, while tracking.
    pub tracked: Option<Stamp>,
    /// Whether tracking may begin with this width.
    pub may_begin: bool,
    /// Speed for a bumpless start: the robot's speed, divided by the speed override.
    pub driven: MmPerS,
    /// In which direction the robot cannot follow.
    pub saturation: Saturation,
}

/// A controller sets the speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tracking {
    /// Capture time up to which the width is known.
    pub seen_at: Stamp,
    /// Whether it was started (again) from the robot's speed.
    pub is_new: bool,
}

impl Tracking {
    /// Tracking continues.
    pub fn on(seen_at: Stamp) -> Self {
        Self { seen_at, is_new: false }
    }
}

/// The state of a bead before a setpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Time of the decision.
    pub now: Stamp,
    /// Path of the nozzle.
    pub path: Option<Mm>,
    /// Length of bead that is laid.
    pub laid: Option<Mm>,
    /// Capture time up to which the width is known, while tracking; none while priming.
    pub tracked: Option<Stamp>,
}

/// What a speed is requested for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRequest {
    /// Path of the nozzle.
    pub path: Option<Mm>,
    /// When the robot will have that speed.
    pub from: Stamp,
    /// How long it will have it.
    pub lasts: Span,
    /// Mean target width of the bead that is laid in that time; none where the robot's
    /// state is not known.
    pub target: Option<Mm>,
}

/// What a controller did, for the record and the plots.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WidthTrace {
    /// Part of the demand that is proportional to the error.
    pub proportional: Option<MmPerS>,
    /// Integral part of the demand.
    pub integral: Option<MmPerS>,
    /// Demanded speed.
    pub demand: Option<MmPerS>,
    /// State of control by distance after the width.
    pub distance: Option<DistanceTrace>,
    /// Progress of a step experiment.
    pub steps: Option<StepsTrace>,
}
