//! Starts and stops of a bead, where the cell has the times of its extruder's starts and stops.

use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm, Mm3PerS, MmPerS};
use crate::extruder::start_stop::{Pause, Start, Stop, Timing};

/// Pause before the first bead of a run, of which nobody knows how long it was: all that
/// can recede has.
const UNKNOWN: Span = Span::from_millis(1_000_000_000);
/// Share of the wanted flow from which a start is over.
const EVEN: f64 = 0.99;

/// What a start or a stop makes of robot and flow at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shares {
    /// Of its speed at which the robot is to move.
    pub(super) robot: f64,
    /// Of the wanted flow that leaves the nozzle.
    pub(super) flow: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Passing {
    Even,
    Rising { start: Start, since: Stamp },
    Falling { stop: Stop, since: Stamp },
}

/// How the pump's starts and stops are timed, and where it is in them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Pauses {
    timing: Timing,
    /// When the pump was told to stop, and the flow until then.
    stood: Option<(Stamp, Mm3PerS)>,
    /// The flow that was wanted last.
    wanted: Mm3PerS,
    /// Whether anything has flowed since the pump was told to run.
    has_flowed: bool,
    passing: Passing,
}

impl Pauses {
    /// Before the first bead.
    pub(super) const fn new(timing: Timing) -> Self {
        Self {
            timing,
            stood: None,
            wanted: Mm3PerS::ZERO,
            has_flowed: false,
            passing: Passing::Even,
        }
    }

    /// A bead begins.
    pub(super) fn begin(&mut self, now: Stamp) {
        let pause = match self.stood {
            Some((at, before)) => Pause { idle: now - at, before },
            None => Pause { idle: UNKNOWN, before: Mm3PerS::ZERO },
        };
        self.passing = Passing::Rising { start: self.timing.start(&pause), since: now };
    }

    /// This flow is wanted.
    pub(super) const fn want(&mut self, flow: Mm3PerS) {
        self.wanted = flow;
    }

    /// The pump stops before the bead ends, so that what still comes fills the rest.
    pub(super) fn end(&mut self, now: Stamp) {
        self.passing = Passing::Falling { stop: self.timing.stop(), since: now };
    }

    /// The pump was told to run, or to stop: that is when a start or a pause begins,
    /// which may be later than it was decided.
    pub(super) fn turned(&mut self, now: Stamp, on: bool) {
        if on {
            self.begin(now);
        } else if std::mem::take(&mut self.has_flowed) {
            self.stood = Some((now, self.wanted));
        }
    }

    /// Something flows by now: the pause is over.
    pub(super) const fn flows(&mut self) {
        self.has_flowed = true;
    }

    /// The bead is over.
    pub(super) const fn rest(&mut self) {
        self.passing = Passing::Even;
    }

    /// How far from the end of a bead that is laid at this speed the pump stops.
    pub(super) fn way(&self, speed: MmPerS) -> Mm {
        self.timing.stop().way() * (speed / self.timing.laid().speed)
    }

    /// What a robot and a flow are that wait for the pump.
    pub(super) fn waiting(&self) -> Shares {
        Shares { robot: self.timing.laid().least_share, flow: 0.0 }
    }

    /// What the start or the stop makes of this moment; none while the flow is even.
    pub(super) fn shares(&self, now: Stamp) -> Option<Shares> {
        match &self.passing {
            Passing::Even => None,
            Passing::Rising { start, since } => {
                let since = now - *since;
                let flow = start.flow_share(since);
                let robot = start.robot_share(since).max(self.timing.laid().least_share);
                (flow < EVEN).then_some(Shares { robot, flow })
            }
            Passing::Falling { stop, since } => {
                let since = now - *since;
                Some(Shares { robot: stop.robot_share(since), flow: stop.flow_share(since) })
            }
        }
    }
}
