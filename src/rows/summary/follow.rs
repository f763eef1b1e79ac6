//! Follows a controller through its events and steps: time in each state, the acting limit, and
//! the position of the nozzle.

use crate::control::{Command, Event, State, Step};
use crate::core::{Mm, MmPerS, Span, Stamp};
use crate::width_control::limiter::SpeedLimit;

/// The state of a run after the steps so far.
#[derive(Debug, Default)]
pub struct StateFollower {
    now: Option<Stamp>,
    state: State,
    limit: SpeedLimit,
    path: Option<Mm>,
    setpoint: Option<MmPerS>,
}

/// The time between two steps, with the state during it.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// Duration.
    pub span: Span,
    /// The state during it.
    pub state: State,
    /// The limit that acted during it.
    pub limit: SpeedLimit,
}

impl StateFollower {
    /// Takes the next step and returns the interval before it; `None` for the first step. A limit
    /// acts from the step that names it to the next setpoint without it.
    pub fn step(&mut self, now: Stamp, event: &Event, step: &Step) -> Option<Interval> {
        let lapse = self.now.map(|then| Interval {
            span: (now - then).max(Span::ZERO),
            state: self.state.clone(),
            limit: self.limit,
        });
        self.now = Some(now);
        self.state = step.state.clone();
        if let Event::Robot(robot) = event {
            self.path = Some(robot.path_mm);
        }
        match step.command {
            Some(Command::Speed(speed)) => {
                self.setpoint = Some(speed);
                self.limit = step.trace.limit;
            }
            Some(Command::Stop) => self.limit = SpeedLimit::None,
            None if step.trace.limit != SpeedLimit::None => self.limit = step.trace.limit,
            None => {}
        }
        if matches!(step.state, State::Idle | State::Fault(_)) {
            self.limit = SpeedLimit::None;
        }
        lapse
    }

    /// The state after the last step.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The limit that acts since the last step.
    pub fn limit(&self) -> SpeedLimit {
        self.limit
    }

    /// Last reported path of the nozzle.
    pub fn path(&self) -> Option<Mm> {
        self.path
    }

    /// The last commanded setpoint.
    pub fn setpoint(&self) -> Option<MmPerS> {
        self.setpoint
    }
}
