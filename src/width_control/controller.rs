//! What sets the robot's speed from the widths that are measured: one trait, and what
//! goes in and out of it.
//!
//! The caller keeps the state of the bead (priming, tracking, holding), limits setpoints
//! and sends them. A width controller is told what happens on the bead and answers with
//! a speed. It reads no clock: time comes with each call.

use std::fmt::Debug;

use super::distance::{DistanceTrace, FallbackReason};
use super::pi::Saturation;
use super::steps::StepsTrace;
use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm, MmPerS};

/// Sets the robot's speed so that the bead has its width.
pub trait WidthController: Debug + Send {
    /// A new bead begins; nothing of the bead before is under the camera any more.
    fn begin_bead(&mut self) {}

    /// The robot reported while it lays bead.
    fn robot_reported(&mut self, _: &BeadReport) {}

    /// A width was measured. Answers with when it tracks from, where it sets the speed
    /// from now on or goes on to do so; none where it does not (yet).
    fn measured(&mut self, sample: &WidthSample, trace: &mut WidthTrace) -> Option<Tracking>;

    /// A setpoint is due. A controller that can begin to track, or is tracking, without
    /// a width of this moment answers with the time to which it counts as up to date.
    fn before_setpoint(&mut self, _: &Outlook) -> Option<Stamp> {
        None
    }

    /// The speed of the next setpoint, while it tracks; none where it cannot tell, and
    /// the last one stays.
    fn speed(&mut self, request: &SpeedRequest, trace: &mut WidthTrace) -> Option<MmPerS>;

    /// Why it has fallen back to another way of control on this bead, if it has.
    fn fallback(&self) -> Option<FallbackReason> {
        None
    }
}

/// What the robot reported while it lays bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadReport {
    /// When it was reported.
    pub at: Stamp,
    /// Where the nozzle is along the path.
    pub path: Mm,
    /// Speed along the path.
    pub speed: MmPerS,
    /// Flow at the nozzle over that of the start speed, without a unit.
    pub flow_ratio: f64,
    /// Whether the path is really known, and not made up.
    pub is_path_known: bool,
}

/// One measured width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthSample {
    /// When its frame was captured.
    pub captured_at: Stamp,
    /// The width.
    pub width: Mm,
    /// Its standard deviation.
    pub sigma: Mm,
    /// Measured less wanted width.
    pub error: Mm,
    /// Where the nozzle was along the path when the frame was captured; none where that
    /// is not known.
    pub nozzle_path: Option<Mm>,
    /// Whether the bead in the frame is the one that is being laid.
    pub is_own_bead: bool,
    /// Until when the width was known, while it is being tracked.
    pub tracked: Option<Stamp>,
    /// Whether tracking may begin with this width.
    pub may_begin: bool,
    /// Speed to start from without a bump: the robot's, without what a plan, a start or
    /// a stop makes of it.
    pub driven: MmPerS,
    /// In which direction the robot cannot follow.
    pub saturation: Saturation,
    /// Whether the path is really known, and not made up.
    pub is_path_known: bool,
}

/// A controller sets the speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tracking {
    /// Until when the width is known now.
    pub seen_at: Stamp,
    /// Whether it started anew from the speed that is driven.
    pub is_new: bool,
}

impl Tracking {
    /// Tracking goes on.
    pub fn on(seen_at: Stamp) -> Self {
        Self { seen_at, is_new: false }
    }
}

/// How things stand before a setpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlook {
    /// Now.
    pub now: Stamp,
    /// Where the nozzle is along the path.
    pub path: Option<Mm>,
    /// How far that is from where the bead began.
    pub laid: Option<Mm>,
    /// Whether the bead's first part is being laid, at the start speed.
    pub is_priming: bool,
    /// Until when the width was known, while it is being tracked.
    pub tracked: Option<Stamp>,
}

/// What a speed is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRequest {
    /// Where the nozzle is along the path.
    pub path: Option<Mm>,
    /// When the robot will go at that speed.
    pub from: Stamp,
    /// For how long.
    pub lasts: Span,
    /// The mean width that is wanted of the bead which is laid then; none where the
    /// robot was not heard.
    pub target: Option<Mm>,
}

/// What a controller did, for the record and the plots.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WidthTrace {
    /// Part of the demand that is proportional to the error.
    pub proportional: Option<MmPerS>,
    /// Part of the demand that was integrated.
    pub integral: Option<MmPerS>,
    /// Speed that the controller would like.
    pub demand: Option<MmPerS>,
    /// What control by distance made of the width.
    pub distance: Option<DistanceTrace>,
    /// How far a course of steps is.
    pub steps: Option<StepsTrace>,
}
