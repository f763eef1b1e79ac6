//! What a controller is doing, with what it needs for it.

use super::step::{Fault, Hold, State};
use crate::core::time::Stamp;
use crate::core::units::{Mm, MmPerS};
use crate::width_control::limiter::SpeedLimit;

/// What a controller is doing.
#[derive(Debug, Clone, PartialEq)]
pub enum Phase {
    /// The robot is not printing.
    Idle,
    /// A bead is being laid, or was until a fault.
    Bead(Bead),
    /// A hold that only a new run ends, with the last limit that acted.
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
    /// What is being done on it.
    pub mode: Mode,
    /// Which part of it the robot is at.
    pub segment: Segment,
    /// The last setpoint, once there was one.
    pub setpoint: Option<Setpoint>,
    /// The last limit that acted.
    pub limit: SpeedLimit,
}

/// What is being done on a bead.
#[derive(Debug, Clone, PartialEq)]
pub enum Mode {
    /// Its first part is laid at the start speed, until a width of it is due.
    Priming,
    /// The width controller sets the speed.
    Tracking {
        /// Until when the width is known.
        seen_at: Stamp,
    },
    /// The speed stays as it is.
    Holding {
        /// From when on.
        since: Stamp,
        /// Why.
        why: Hold,
    },
    /// The robot is told to stop.
    Fault {
        /// Why.
        why: Fault,
    },
}

/// Which part of a bead the robot is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Segment {
    /// It has not reached yet the speed that was requested.
    RunUp,
    /// It has.
    Even,
    /// The extruder was stopped because the bead ends; the robot slows down from then on.
    Ending,
}

/// The last setpoint of a bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// When it was given.
    pub at: Stamp,
    /// The speed that went out.
    pub speed: MmPerS,
    /// What the width controller had requested, before a plan, a start or a stop had its
    /// say.
    pub requested: MmPerS,
}

/// Where the bead that is laid lies on the path, or the last one that was.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BeadOnPath {
    /// Where on the path it began.
    pub start: Mm,
    /// How much of it was laid.
    pub laid: Mm,
    /// Beads of a plan that were laid before it.
    pub number: usize,
}

impl Bead {
    /// A bead that has just begun.
    pub fn new() -> Self {
        Self {
            mode: Mode::Priming,
            segment: Segment::RunUp,
            setpoint: None,
            limit: SpeedLimit::None,
        }
    }

    /// Until when the width is known, where it is being tracked.
    pub fn tracked(&self) -> Option<Stamp> {
        match self.mode {
            Mode::Tracking { seen_at } => Some(seen_at),
            _ => None,
        }
    }

    /// Whether tracking may begin as soon as there is a width.
    pub fn waits_for_width(&self) -> bool {
        matches!(self.mode, Mode::Priming | Mode::Holding { why: Hold::NoWidth, .. })
    }

    /// Whether it is held until the robot goes as it should.
    pub fn waits_for_robot(&self) -> bool {
        let Mode::Holding { why, .. } = &self.mode else { return false };
        matches!(why, Hold::RobotHolds | Hold::LinkDown | Hold::SpeedMismatch)
    }

    /// Whether a fault has ended it.
    pub fn is_faulty(&self) -> bool {
        matches!(self.mode, Mode::Fault { .. })
    }
}

impl Phase {
    /// The bead, while one is controlled.
    pub fn bead(&self) -> Option<&Bead> {
        match self {
            Self::Bead(bead) => Some(bead),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub fn bead_mut(&mut self) -> Option<&mut Bead> {
        match self {
            Self::Bead(bead) => Some(bead),
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

    /// Holds a bead that is being laid; a first reason stays.
    pub fn hold(&mut self, now: Stamp, why: Hold) {
        let Some(bead) = self.bead_mut() else { return };
        match &mut bead.mode {
            Mode::Priming | Mode::Tracking { .. } => bead.mode = Mode::Holding { since: now, why },
            Mode::Holding { why: reason, .. } if *reason == Hold::NoWidth => *reason = why,
            _ => {}
        }
    }

    /// A hold that only a new run ends.
    pub fn end(&mut self, why: Hold) {
        *self = Self::Ended { why, limit: self.limit() };
    }

    /// The state as others see it.
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
