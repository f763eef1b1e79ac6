//! The sequence of starts and stops, where the cell has the times of its extruder.

use crate::core::{Mm, Mm3PerS, MmPerS, Span, Stamp};
use crate::extruder::start_stop::{Pause, Start, StartStopTiming, Stop};

/// Pause before the first bead of a run, which is not known: longer than any time constant, so
/// that the void is the largest.
const UNKNOWN_PAUSE: Span = Span::from_millis(1_000_000_000);
/// Flow ratio from which a start is over. The exponential rise never reaches 1; after it the
/// strategy takes over with a step of the rest.
const STEADY_FLOW_RATIO: f64 = 0.99;

/// Speed and flow in a start or a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TransitionRatios {
    /// The robot's speed over its setpoint.
    pub(super) robot: f64,
    /// Flow at the nozzle over the demanded flow.
    pub(super) flow: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum StartStopPhase {
    Steady,
    Rising { start: Start, since: Stamp },
    Falling { stop: Stop, since: Stamp },
}

/// The times of starts and stops, and the progress of the current one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StartStopSequencer {
    timing: StartStopTiming,
    /// When the pump was commanded to stop, and the flow until then.
    stopped: Option<(Stamp, Mm3PerS)>,
    /// The last demanded flow.
    pub(super) demand: Mm3PerS,
    /// Whether anything has flowed since the pump was commanded to run.
    pub(super) has_flowed: bool,
    phase: StartStopPhase,
}

impl StartStopSequencer {
    /// Before the first bead.
    pub(super) const fn new(timing: StartStopTiming) -> Self {
        let (demand, phase) = (Mm3PerS::ZERO, StartStopPhase::Steady);
        Self { timing, stopped: None, demand, has_flowed: false, phase }
    }

    /// A bead begins.
    pub(super) fn begin(&mut self, now: Stamp) {
        let pause = match self.stopped {
            Some((at, before)) => Pause { idle: now - at, flow_before: before },
            None => Pause { idle: UNKNOWN_PAUSE, flow_before: Mm3PerS::ZERO },
        };
        self.phase = StartStopPhase::Rising { start: self.timing.start(&pause), since: now };
    }

    /// The pump stops before the bead ends, so that the flow after the stop fills the rest.
    pub(super) fn end(&mut self, now: Stamp) {
        self.phase = StartStopPhase::Falling { stop: self.timing.stop(), since: now };
    }

    /// The pump was commanded to run or to stop. The start or the pause begins then, which may
    /// be later than it was decided.
    pub(super) fn pump_switched(&mut self, now: Stamp, on: bool) {
        if on {
            self.begin(now);
        } else if std::mem::take(&mut self.has_flowed) {
            self.stopped = Some((now, self.demand));
        }
    }

    /// The bead is over.
    pub(super) const fn rest(&mut self) {
        self.phase = StartStopPhase::Steady;
    }

    /// Distance from the end of a bead at this speed at which the pump stops.
    pub(super) fn stop_distance(&self, speed: MmPerS) -> Mm {
        self.timing.stop().distance() * (speed / self.timing.conditions().speed)
    }

    /// The ratios while waiting for the pump.
    pub(super) fn waiting(&self) -> TransitionRatios {
        TransitionRatios { robot: self.timing.conditions().min_speed_ratio, flow: 0.0 }
    }

    /// The ratios of the start or the stop; none while the flow is steady.
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
                let robot = stop.speed_ratio(since);
                Some(TransitionRatios { robot, flow: stop.flow_ratio(since) })
            }
        }
    }
}
