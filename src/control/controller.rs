//! The controller of a cell, and its answer to each event.

use super::event::Event;
use super::extruder_side::{ExtruderSide, NO_OVERRIDE};
use super::phase::{Bead, BeadOnPath, Mode, Phase, Setpoint};
use super::setup::Setup;
use super::step::{Command, Fault, Hold, State, Step, Trace};
use crate::core::readback::{SpeedMatch, SpeedMonitor};
use crate::core::robot::{RobotMode, RobotState};
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::extruder::{ExtruderSetup, FlowDemand};
use crate::width_control::controller::{WidthController, WidthTrace};
use crate::width_control::limiter::SpeedLimit;
use crate::width_control::odometer::Odometer;
use crate::width_control::path_history::PathHistory;

/// The controller of a cell: the width by the robot's speed and, where the
/// cell says so, the flow by the extruder.
#[derive(Debug)]
pub struct Controller {
    pub(super) setup: Setup,
    pub(super) width: Box<dyn WidthController>,
    pub(super) extruder: Option<ExtruderSide>,
    pub(super) phase: Phase,
    pub(super) bead: BeadOnPath,
    pub(super) robot: Robot,
    /// No more frames come.
    pub(super) camera_lost: bool,
}

/// What is known of the robot.
#[derive(Debug, Default)]
pub(super) struct Robot {
    pub(super) link_up: bool,
    /// Its last report on this connection.
    pub(super) state: Option<RobotState>,
    /// The path in its last report, on whatever connection.
    pub(super) last_path: Option<Mm>,
    /// Whether the path has fallen since the bead began: another one is being laid.
    pub(super) is_another_bead: bool,
    /// Since when nobody has heard it, whatever else was the matter before.
    pub(super) silent_since: Option<Stamp>,
    pub(super) transport: PathHistory,
    pub(super) odometer: Odometer,
    pub(super) follow: SpeedMonitor,
    pub(super) verdict: SpeedMatch,
}

impl Robot {
    /// What it follows from now on is new.
    pub(super) fn follow_anew(&mut self) {
        self.follow.reset();
        self.verdict = SpeedMatch::Follows;
    }
}

impl Controller {
    /// A controller that has seen nothing yet.
    pub fn new(setup: Setup) -> Self {
        let width = setup.control.strategy.controller(&setup.facts());
        Self {
            setup,
            width,
            extruder: None,
            phase: Phase::Idle,
            bead: BeadOnPath::default(),
            robot: Robot::default(),
            camera_lost: false,
        }
    }

    /// The same with an extruder that is commanded.
    pub fn with_extruder(mut self, setup: ExtruderSetup, demand: FlowDemand) -> Self {
        self.extruder = Some(ExtruderSide::new(setup, demand));
        self
    }

    /// Answers an event that happened at `now`.
    pub fn step(&mut self, now: Stamp, event: &Event) -> Step {
        let mut step = self.steer(now, event);
        step.extruder = self.extrude(now, event);
        if let Some(why) = self.extruder.as_ref().and_then(ExtruderSide::fault)
            && let Some(bead) = self.phase.bead_mut()
            && !bead.is_faulty()
        {
            bead.mode = Mode::Fault { why: Fault::Extruder(why) };
            step.state = self.state();
        }
        step
    }

    /// The robot side's answer.
    fn steer(&mut self, now: Stamp, event: &Event) -> Step {
        let mut trace = Trace::default();
        let command = match event {
            Event::Measured { frame, captured_at, width_mm, sigma_mm } => {
                trace.frame = Some(*frame);
                let width = Measured { at: *captured_at, width: *width_mm, sigma: *sigma_mm };
                self.measured(now, &width, &mut trace);
                None
            }
            Event::Rejected { frame, captured_at, .. } => {
                trace.frame = Some(*frame);
                self.locate(*captured_at, &mut trace);
                None
            }
            Event::Robot(state) => {
                self.reported(now, state);
                None
            }
            Event::LinkUp { robot } => {
                self.link_came_up(robot);
                None
            }
            Event::LinkDown { .. } => {
                self.link_went_down(now);
                None
            }
            Event::SetpointRefused { .. }
            | Event::Extruder(_)
            | Event::ExtruderUp
            | Event::ExtruderDown { .. }
            | Event::ExtruderRefused { .. }
            | Event::ExtruderTick => None,
            Event::Tick => self.tick(now, &mut trace),
            Event::CameraLost { .. } => {
                self.camera_lost = true;
                self.phase.hold(now, Hold::CameraLost);
                None
            }
            Event::RecordingLost => {
                self.phase.end(Hold::RecordingLost);
                None
            }
            Event::Stop => {
                self.phase.end(Hold::Stopping);
                Some(Command::Stop)
            }
        };
        trace.limit = self.phase.limit();
        trace.fallback = self.width.fallback();
        Step { command, state: self.state(), trace, extruder: None }
    }

    /// The state as others see it.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    fn tick(&mut self, now: Stamp, trace: &mut Trace) -> Option<Command> {
        self.time_out(now);
        let mode = self.robot.state?.mode;
        if !self.robot.link_up || !matches!(mode, RobotMode::Print | RobotMode::Hold) {
            return None;
        }
        let outlook = self.outlook(now)?;
        let up_to_date = self.width.before_setpoint(&outlook);
        let request = self.speed_request(now);
        let bead = self.phase.bead_mut()?;
        if let Some(seen_at) = up_to_date
            && (outlook.is_priming || outlook.tracked.is_some())
        {
            bead.mode = Mode::Tracking { seen_at };
        }
        let kept = bead.setpoint.map_or(self.setup.start_speed, |last| last.requested);
        let requested = match &bead.mode {
            Mode::Fault { .. } => return Some(Command::Stop),
            Mode::Priming => self.setup.start_speed,
            Mode::Tracking { .. } => {
                let mut of_width = WidthTrace::default();
                let speed = self.width.speed(&request, &mut of_width);
                trace.steps = of_width.steps;
                speed.unwrap_or(kept)
            }
            Mode::Holding { .. } => kept,
        };
        trace.demand_mm_per_s = Some(requested);
        let speed_override = self.speed_override(now);
        let bead = self.phase.bead_mut()?;
        let last = bead.setpoint.map_or(requested, |last| last.speed);
        let speed = speed_override.map_or(last, |factor| requested * factor);
        let (last_at, last) = bead.setpoint.map_or((now, speed), |last| (last.at, last.speed));
        let limited = self.setup.limits.apply(speed, last, now - last_at);
        bead.limit = match (limited.limit, self.robot.verdict) {
            (SpeedLimit::None, SpeedMatch::Slower) => SpeedLimit::RobotSlower,
            (SpeedLimit::None, SpeedMatch::Faster) => SpeedLimit::RobotFaster,
            (limit, _) => limit,
        };
        // What a hold is to keep: the very speed that goes out, or where something else has
        // its say in it, what the width was to have.
        let is_own = speed_override == Some(NO_OVERRIDE);
        let requested = if is_own { limited.speed } else { requested };
        bead.setpoint = Some(Setpoint { at: now, speed: limited.speed, requested });
        Some(Command::Speed(limited.speed))
    }

    /// Holds when widths stay out, also those that the first part of a bead waits for, and
    /// gives up when a hold lasts too long.
    fn time_out(&mut self, now: Stamp) {
        let is_due = self.laid_at(now).is_some_and(|laid| laid > self.widths_due());
        let (max_gap, max_hold) = (self.setup.control.max_gap, self.setup.control.max_hold);
        let Some(Bead { mode, .. }) = self.phase.bead_mut() else { return };
        if *mode == Mode::Priming && is_due {
            *mode = Mode::Holding { since: now, why: Hold::NoWidth };
        }
        match mode {
            Mode::Tracking { seen_at } if now - *seen_at > max_gap => {
                *mode = Mode::Holding { since: now, why: Hold::NoWidth };
            }
            Mode::Holding { since, why } if now - *since > max_hold => {
                *mode = Mode::Fault { why: Fault::HeldTooLong(why.clone()) };
            }
            _ => {}
        }
    }

    /// How much bead is laid when a width of it has long been due: twice as far as the
    /// camera is behind, or once more behind the first part, and what the cell bears
    /// without one.
    fn widths_due(&self) -> Mm {
        let Setup { start_length, camera_offset, start_speed, control, .. } = &self.setup;
        start_length.max(*camera_offset) + *camera_offset + *start_speed * control.max_gap
    }

    /// How much of the bead is laid at a time.
    pub(super) fn laid_at(&self, now: Stamp) -> Option<Mm> {
        self.robot.transport.path_at(now).map(|path| path - self.bead.start)
    }
}

/// A width that was measured.
pub(super) struct Measured {
    /// When its frame was captured.
    pub(super) at: Stamp,
    pub(super) width: Mm,
    /// Its standard deviation.
    pub(super) sigma: Mm,
}
