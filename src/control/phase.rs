//! The phase of a controller, with the data of each phase.

use super::step::{Fault, Hold, State};
use crate::core::{Mm, MmPerS, Span, Stamp};
use crate::width_control::limiter::SpeedLimit;

/// Widths in a row that end a hold for missing widths (`docs/src/how-to/run-a-cell.md`, § What
/// the controller does). One or two may come by chance from a camera that still fails; each
/// further one delays control by a frame.
const WIDTHS_TO_RESUME: u32 = 3;

/// The phase of a controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Phase {
    /// The robot is not printing.
    Idle,
    /// A bead is being laid, or was before a fault.
    Bead(Bead),
    /// A hold that only a new run ends.
    Ended {
        /// Why.
        why: Hold,
        /// The last limit that acted.
        limit: SpeedLimit,
    },
}

/// Control of one bead.
#[derive(Debug, Clone, PartialEq)]
pub struct Bead {
    /// Mode of control.
    pub mode: Mode,
    /// Run-up, even speed or end.
    pub stage: BeadStage,
    /// The last setpoint, once there was one.
    pub setpoint: Option<Setpoint>,
    /// The last limit that acted.
    pub limit: SpeedLimit,
}

/// The mode of control of a bead.
#[derive(Debug, Clone, PartialEq)]
pub enum Mode {
    /// The first part of the bead is laid at the start speed, until a width is measured.
    Priming,
    /// The width controller sets the speed.
    Tracking {
        /// Capture time up to which the width is known.
        seen_at: Stamp,
    },
    /// The speed is kept.
    Holding {
        /// When the hold began.
        since: Stamp,
        /// Why.
        why: Hold,
        /// Widths that have come since.
        timely: TimelyWidths,
    },
    /// The robot is commanded to stop.
    Fault {
        /// Why.
        why: Fault,
    },
}

/// Widths in a row that were no older than the longest gap when they arrived, and no farther
/// apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TimelyWidths {
    count: u32,
    /// Capture time of the last one.
    last: Option<Stamp>,
}

/// A width of the bead that is being laid, as it arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arrival {
    /// When it arrived.
    pub at: Stamp,
    /// When its frame was captured.
    pub captured_at: Stamp,
    /// The longest time without a width.
    pub max_gap: Span,
}

/// The stage of a bead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeadStage {
    /// The robot accelerates to the requested speed.
    RunUp,
    /// The robot has reached it.
    Even,
    /// The extruder was stopped ahead of the bead's end; the robot slows down.
    Ending,
}

/// The last setpoint of a bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// When it was sent.
    pub at: Stamp,
    /// The speed that was sent.
    pub speed: MmPerS,
    /// The speed that the width controller requested, before the speed override.
    pub requested: MmPerS,
}

/// Position of the bead along the path: the one that is laid, or the last one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BeadOnPath {
    /// Path where it began.
    pub start: Mm,
    /// Path from which the bead under the camera can be known: where it began, or where the
    /// last jump of the reported path led.
    pub known_from: Mm,
    /// Length that is laid.
    pub laid: Mm,
    /// Number of beads of the plan that were laid before it.
    pub number: usize,
}

impl Bead {
    /// A bead that has just begun.
    pub fn new() -> Self {
        let (mode, stage) = (Mode::Priming, BeadStage::RunUp);
        Self { mode, stage, setpoint: None, limit: SpeedLimit::None }
    }

    /// Capture time up to which the width is known, while tracking.
    pub fn tracked(&self) -> Option<Stamp> {
        if let Mode::Tracking { seen_at } = self.mode { Some(seen_at) } else { None }
    }

    /// Whether tracking may begin with a width that arrives. A hold for missing widths ends
    /// with the last of several timely ones; a late one names the camera as the reason.
    pub fn may_track(&mut self, width: &Arrival) -> bool {
        match &mut self.mode {
            Mode::Priming => width.is_timely(),
            Mode::Holding { why, timely, .. } if why.ends_with_widths() => {
                if !width.is_timely() && *why == Hold::NoWidth {
                    *why = Hold::SlowCamera { age: width.age(), max_gap: width.max_gap };
                }
                timely.add(width);
                timely.count >= WIDTHS_TO_RESUME
            }
            _ => false,
        }
    }

    /// The width is known no later than at a time: a frame after it was not a new one.
    pub fn known_until(&mut self, at: Stamp) {
        match &mut self.mode {
            Mode::Tracking { seen_at } => *seen_at = at.min(*seen_at),
            Mode::Holding { why, .. } if *why == Hold::NoWidth => *why = Hold::CameraFrozen,
            _ => {}
        }
    }

    /// Whether it is held for a reason that lies with the robot.
    pub fn waits_for_robot(&self) -> bool {
        let Mode::Holding { why, .. } = &self.mode else { return false };
        matches!(why, Hold::RobotHolds | Hold::LinkDown | Hold::SpeedMismatch | Hold::RobotClock)
    }

    /// Whether it is held because the extruder is silent.
    pub fn waits_for_extruder(&self) -> bool {
        matches!(self.mode, Mode::Holding { why: Hold::ExtruderSilent, .. })
    }

    /// Whether it is in fault.
    pub fn is_faulty(&self) -> bool {
        matches!(self.mode, Mode::Fault { .. })
    }
}

impl Mode {
    /// A hold that begins.
    pub fn holding(since: Stamp, why: Hold) -> Self {
        Self::Holding { since, why, timely: TimelyWidths::default() }
    }
}

impl TimelyWidths {
    /// Counts a timely width; a late one, and one after a gap, begins the count anew.
    fn add(&mut self, width: &Arrival) {
        let Arrival { captured_at, max_gap, .. } = *width;
        let follows = self.last.is_some_and(|last| captured_at - last <= max_gap);
        let before = if follows { self.count } else { 0 };
        self.count = if width.is_timely() { before.saturating_add(1) } else { 0 };
        self.last = Some(captured_at);
    }
}

impl Arrival {
    /// Age of the width when it arrived.
    fn age(&self) -> Span {
        self.at - self.captured_at
    }

    fn is_timely(&self) -> bool {
        self.age() <= self.max_gap
    }
}

impl Phase {
    /// The bead, while one is controlled.
    pub fn bead(&self) -> Option<&Bead> {
        if let Self::Bead(bead) = self { Some(bead) } else { None }
    }

    /// The bead, mutable, while one is controlled.
    pub fn bead_mut(&mut self) -> Option<&mut Bead> {
        if let Self::Bead(bead) = self { Some(bead) } else { None }
    }

    /// Why a bead is held, while one is.
    pub fn held_for(&self) -> Option<&Hold> {
        match &self.bead()?.mode {
            Mode::Holding { why, .. } => Some(why),
            _ => None,
        }
    }

    /// The last limit that acted on a setpoint.
    pub fn limit(&self) -> SpeedLimit {
        match self {
            Self::Idle => SpeedLimit::None,
            Self::Bead(bead) => bead.limit,
            Self::Ended { limit, .. } => *limit,
        }
    }

    /// Holds a bead that is being laid. The first reason stays, except for a missing width.
    pub fn hold(&mut self, now: Stamp, why: Hold) {
        let Some(bead) = self.bead_mut() else { return };
        match &mut bead.mode {
            Mode::Priming | Mode::Tracking { .. } => bead.mode = Mode::holding(now, why),
            Mode::Holding { why: reason, .. } if reason.is_for_widths() => *reason = why,
            _ => {}
        }
    }

    /// Ends control in a hold that only a new run ends.
    pub fn end(&mut self, why: Hold) {
        *self = Self::Ended { why, limit: self.limit() };
    }

    /// The state as it is reported.
    pub fn state(&self) -> State {
        match self {
            Self::Idle => State::Idle,
            Self::Ended { why, .. } => State::Holding(why.clone()),
            Self::Bead(bead) => match &bead.mode {
                Mode::Priming => State::Priming,
                Mode::Tracking { .. } => State::Tracking,
                Mode::Holding { why, .. } => State::Holding(why.clone()),
                Mode::Fault { why } => State::Fault(why.clone()),
            },
        }
    }
}
