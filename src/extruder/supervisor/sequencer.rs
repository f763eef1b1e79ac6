//! Starts and stops of a bead, where the cell has the times of its extruder's starts and stops.

use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm, Mm3PerS, MmPerS};
use crate::extruder::start_stop::{Pause, Start, StartStopTiming, Stop};

/// Pause before the first bead of a run, of which nobody knows how long it was: all that
/// can recede has.
const UNKNOWN_PAUSE: Span = Span::from_millis(1_000_000_000);
/// Share of the wanted flow from which a start is over.
const STEADY_FLOW_RATIO: f64 = 0.99;

/// What a start or a stop makes of robot and flow at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TransitionRatios {
    /// Of its speed at which the robot is to move.
    pub(super) robot: f64,
    /// Of the wanted flow that leaves the nozzle.
    pub(super) flow: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum StartStopPhase {
    Steady,
    Rising { start: Start, since: Stamp },
    Falling { stop: Stop, since: Stamp },
}

/// How the pump's starts and stops are timed, and where it is in them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StartStopSequencer {
    timing: StartStopTiming,
    /// When the pump was told to stop, and the flow until then.
    stopped: Option<(Stamp, Mm3PerS)>,
    /// The flow that was wanted last.
    demand: Mm3PerS,
    /// Whether anything has flowed since the pump was told to run.
    has_flowed: bool,
    phase: StartStopPhase,
}

impl StartStopSequencer {
    /// Before the first bead.
    pub(super) const fn new(timing: StartStopTiming) -> Self {
        Self {
            timing,
            stopped: None,
            demand: Mm3PerS::ZERO,
            has_flowed: false,
            phase: StartStopPhase::Steady,
        }
    }

    /// A bead begins.
    pub(super) fn begin(&mut self, now: Stamp) {
        let pause = match self.stopped {
            Some((at, before)) => Pause { idle: now - at, flow_before: before },
            None => Pause { idle: UNKNOWN_PAUSE, flow_before: Mm3PerS::ZERO },
        };
        self.phase = StartStopPhase::Rising { start: self.timing.start(&pause), since: now };
    }

    /// This flow is wanted.
    pub(super) const fn set_demand(&mut self, flow: Mm3PerS) {
        self.demand = flow;
    }

    /// The pump stops before the bead ends, so that what still comes fills the rest.
    pub(super) fn end(&mut self, now: Stamp) {
        self.phase = StartStopPhase::Falling { stop: self.timing.stop(), since: now };
    }

    /// The pump was told to run, or to stop: that is when a start or a pause begins,
    /// which may be later than it was decided.
    pub(super) fn pump_switched(&mut self, now: Stamp, on: bool) {
        if on {
            self.begin(now);
        } else if std::mem::take(&mut self.has_flowed) {
            self.stopped = Some((now, self.demand));
        }
    }

    /// Something flows by now: the pause is over.
    pub(super) const fn flow_established(&mut self) {
        self.has_flowed = true;
    }

    /// The bead is over.
    pub(super) const fn rest(&mut self) {
        self.phase = StartStopPhase::Steady;
    }

    /// How far from the end of a bead that is laid at this speed the pump stops.
    pub(super) fn stop_distance(&self, speed: MmPerS) -> Mm {
        self.timing.stop().distance() * (speed / self.timing.conditions().speed)
    }

    /// What a robot and a flow are that wait for the pump.
    pub(super) fn waiting(&self) -> TransitionRatios {
        TransitionRatios { robot: self.timing.conditions().min_speed_ratio, flow: 0.0 }
    }

    /// What the start or the stop makes of this moment; none while the flow is even.
    pub(super) fn ratios(&self, now: Stamp) -> Option<TransitionRatios> {
        match &self.phase {
            StartStopPhase::Steady => None,
            StartStopPhase::Rising { start, since } => {
                let since = now - *since;
                let flow = start.flow_ratio(since);
                let robot = start.speed_ratio(since).max(self.timing.conditions().min_speed_ratio);
                (flow < STEADY_FLOW_RATIO).then_some(TransitionRatios { robot, flow })
            }
            StartStopPhase::Falling { stop, since } => {
                let since = now - *since;
                Some(TransitionRatios {
                    robot: stop.speed_ratio(since),
                    flow: stop.flow_ratio(since),
                })
            }
        }
    }
}
