//! The controller: one decision for every event. It reads no clock and opens
//! nothing; live, simulated and replayed cells run this same code.
//!
//! - idle: the robot is not printing.
//! - priming: first stretch of a bead, at the start speed.
//! - tracking: the PI law corrects the speed, once a width of this bead has
//!   been seen.
//! - holding: the speed stays as it is, for a reason; left when the reason
//!   goes, and a fault when it stays too long.
//! - fault: the robot is told to stop; left when the robot is idle again.

use crate::config::cell::RunPart;
use crate::config::control::Control;
use crate::control::follow::{Follow, Verdict};
use crate::control::limiter::Limits;
use crate::control::pi::{Pi, Saturation};
use crate::control::transport::Transport;
use crate::control::{
    Command, Event, ExtruderStep, Fault, Hold, Limit, RobotLimits, RobotMode, RobotState, State,
    Step, Trace,
};
use crate::extruder::{
    ExtruderFault, ExtruderSetup, ExtruderState, FlowDemand, Laying, Supervisor,
};
use crate::time::{Span, Stamp};
use crate::units::{Mm, MmPerS};

/// Share of the setpoint at which a robot that starts has run up.
const RUN_UP: f64 = 0.95;

/// Least share of its speed from which the speed of a robot that goes by the
/// flow is taken for the law's: below, the robot's limits say more of it.
const LEAST_SHARE: f64 = 0.5;

/// Everything the controller has to know of its cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Target, gains and patience.
    pub control: Control,
    /// What setpoints may be.
    pub limits: Limits,
    /// Speed of the first stretch.
    pub start_speed: MmPerS,
    /// Its length.
    pub start_length: Mm,
    /// Path length from the nozzle back to the middle of the gauge.
    pub camera_offset: Mm,
}

impl From<&RunPart> for Setup {
    fn from(run: &RunPart) -> Self {
        Self {
            control: run.control,
            limits: run.limits,
            start_speed: run.robot.start_speed,
            start_length: run.robot.start_length,
            camera_offset: run.camera.offset,
        }
    }
}

/// What the controller is doing, with what it needs for it.
#[derive(Debug, Clone, PartialEq)]
enum Phase {
    Idle,
    Priming,
    Tracking { pi: Pi, seen_at: Stamp, demand: MmPerS },
    Holding { since: Stamp, why: Hold },
    Fault { why: Fault },
}

/// The extruder side of a controller, where a cell has one.
#[derive(Debug, Clone, PartialEq)]
struct ExtruderSide {
    supervisor: Supervisor,
    demand: FlowDemand,
}

/// The controller of a cell: the width by the robot's speed and, where the
/// cell says so, the flow by the extruder.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    setup: Setup,
    extruder: Option<ExtruderSide>,
    phase: Phase,
    /// A hold that only a new run ends.
    ended: bool,
    link_up: bool,
    robot: Option<RobotState>,
    transport: Transport,
    follow: Follow,
    verdict: Verdict,
    /// Where on the path the bead began.
    bead_start: Mm,
    /// Whether the robot has reached the speed that it was told on this bead.
    run_up: bool,
    /// The last setpoint of this bead, and when it was given.
    told: Option<(Stamp, MmPerS)>,
    limit: Limit,
}

impl Controller {
    /// A controller that has seen nothing yet.
    pub fn new(setup: Setup) -> Self {
        Self {
            setup,
            extruder: None,
            phase: Phase::Idle,
            ended: false,
            link_up: false,
            robot: None,
            transport: Transport::default(),
            follow: Follow::default(),
            verdict: Verdict::Follows,
            bead_start: Mm::ZERO,
            run_up: false,
            told: None,
            limit: Limit::None,
        }
    }

    /// The same with an extruder that is commanded.
    pub fn with_extruder(mut self, setup: ExtruderSetup, demand: FlowDemand) -> Self {
        self.extruder = Some(ExtruderSide { supervisor: Supervisor::new(setup), demand });
        self
    }

    /// Answers an event that happened at `now`.
    pub fn step(&mut self, now: Stamp, event: &Event) -> Step {
        let mut step = self.steer(now, event);
        step.extruder = self.extrude(now, event);
        if let Some(why) = self.extruder_fault()
            && matches!(self.phase, Phase::Priming | Phase::Tracking { .. } | Phase::Holding { .. })
            && !self.ended
        {
            self.phase = Phase::Fault { why: Fault::Extruder(why) };
            step.state = self.state();
        }
        step
    }

    /// The extruder side's answer to what concerns it.
    fn extrude(&mut self, now: Stamp, event: &Event) -> Option<ExtruderStep> {
        let laying = self.laying();
        let ExtruderSide { supervisor, .. } = self.extruder.as_mut()?;
        let command = match event {
            Event::Extruder(report) => {
                supervisor.reported(now, report);
                None
            }
            Event::ExtruderUp => {
                supervisor.link_came_up();
                None
            }
            Event::ExtruderDown { .. } => {
                supervisor.link_went_down(now);
                None
            }
            Event::ExtruderTick => supervisor.tick(now, laying),
            Event::Stop => supervisor.stop(),
            _ => return None,
        };
        Some(ExtruderStep { command, state: supervisor.state(), trace: supervisor.trace() })
    }

    /// What the extruder side has to know of the robot's.
    fn laying(&self) -> Laying {
        let Some(ExtruderSide { demand, .. }) = &self.extruder else { return Laying::Idle };
        match &self.phase {
            Phase::Idle => Laying::Idle,
            Phase::Fault { .. } => Laying::Stopped,
            _ if self.ended => Laying::Stopped,
            Phase::Priming | Phase::Tracking { .. } | Phase::Holding { .. } => {
                let told = self.told.map_or(self.setup.start_speed, |(_, speed)| speed);
                // No extruder keeps up with a robot that starts; it is ready for
                // the speed that comes.
                let robot = self.robot.filter(|_| self.run_up);
                let robot = robot.map(|robot| (told, robot.speed_mm_per_s));
                Laying::Bead(demand.wanted(robot))
            }
        }
    }

    /// Share of the width controller's speed that the flow at the nozzle
    /// allows; 1 where the robot does not go by it.
    fn flow_share(&self) -> f64 {
        self.extruder.as_ref().map_or(1.0, |side| side.supervisor.robot_share())
    }

    fn extruder_fault(&self) -> Option<ExtruderFault> {
        match self.extruder.as_ref()?.supervisor.state() {
            ExtruderState::Fault(why) => Some(why),
            _ => None,
        }
    }

    /// The robot side's answer.
    fn steer(&mut self, now: Stamp, event: &Event) -> Step {
        let mut trace = Trace::default();
        let command = match event {
            Event::Measured { frame, captured_at, width_mm, .. } => {
                trace.frame = Some(*frame);
                self.measured(*captured_at, *width_mm, &mut trace);
                None
            }
            Event::Rejected { frame, captured_at, .. } => {
                trace.frame = Some(*frame);
                self.place(*captured_at, &mut trace);
                None
            }
            Event::Robot(state) => {
                self.reported(now, state);
                None
            }
            Event::LinkUp { robot } => {
                self.link_came_up(now, robot);
                None
            }
            Event::LinkDown { .. } => {
                self.link_up = false;
                self.robot = None;
                self.follow.reset();
                self.hold_if_printing(now, Hold::LinkDown);
                None
            }
            Event::Refused { .. }
            | Event::Extruder(_)
            | Event::ExtruderUp
            | Event::ExtruderDown { .. }
            | Event::ExtruderTick => None,
            Event::Tick => self.tick(now, &mut trace),
            Event::CameraLost { .. } => {
                self.hold_if_printing(now, Hold::CameraLost);
                None
            }
            Event::RecordingLost => {
                self.end(now, Hold::RecordingLost);
                None
            }
            Event::Stop => {
                self.end(now, Hold::Stopping);
                Some(Command::Stop)
            }
        };
        trace.limit = self.limit;
        Step { command, state: self.state(), trace, extruder: None }
    }

    /// The state in words for outside.
    pub fn state(&self) -> State {
        match &self.phase {
            Phase::Idle => State::Idle,
            Phase::Priming => State::Priming,
            Phase::Tracking { .. } => State::Tracking,
            Phase::Holding { why, .. } => State::Holding(why.clone()),
            Phase::Fault { why } => State::Fault(why.clone()),
        }
    }

    fn measured(&mut self, captured_at: Stamp, width: Mm, trace: &mut Trace) {
        let error = width - self.setup.control.target;
        trace.error_mm = Some(error);
        self.place(captured_at, trace);
        let primed = trace
            .nozzle_path_mm
            .is_some_and(|path| path - self.bead_start >= self.setup.start_length);
        let own_bead = trace.bead_expected;
        match &self.phase {
            Phase::Tracking { .. } => self.track(captured_at, error, trace),
            Phase::Priming | Phase::Holding { why: Hold::NoWidth, .. }
                if primed && own_bead && !self.ended =>
            {
                self.start_tracking(captured_at, error, trace);
            }
            _ => {}
        }
    }

    /// Where the nozzle was when a frame was captured, and where the bead in
    /// it had been laid.
    fn place(&self, captured_at: Stamp, trace: &mut Trace) {
        trace.captured_at = Some(captured_at);
        trace.nozzle_path_mm = self.transport.path_at(captured_at);
        trace.bead_path_mm = trace.nozzle_path_mm.map(|path| path - self.setup.camera_offset);
        trace.bead_expected = self.phase != Phase::Idle
            && trace.bead_path_mm.is_some_and(|path| path >= self.bead_start);
    }

    fn start_tracking(&mut self, captured_at: Stamp, error: Mm, trace: &mut Trace) {
        let driven = self.robot.map_or(self.setup.start_speed, |robot| robot.speed_mm_per_s);
        // A robot that goes by the flow is slower or faster than the law says.
        let share = self.flow_share().max(LEAST_SHARE);
        let own = driven * (1.0 / share);
        let mut pi = Pi::start_bumpless(self.setup.control.gains, own, error);
        let demand = pi.step(error, Span::ZERO, Saturation::None);
        trace.note(&demand);
        self.told = self.told.map(|(at, _)| (at, driven));
        self.phase = Phase::Tracking { pi, seen_at: captured_at, demand: demand.speed };
    }

    fn track(&mut self, captured_at: Stamp, error: Mm, trace: &mut Trace) {
        let saturation = self.saturation();
        let max_gap = self.setup.control.max_gap;
        let Phase::Tracking { pi, seen_at, demand } = &mut self.phase else { return };
        let dt = captured_at - *seen_at;
        if dt <= Span::ZERO {
            return;
        }
        if dt > max_gap {
            self.start_tracking(captured_at, error, trace);
            return;
        }
        let wanted = pi.step(error, dt, saturation);
        trace.note(&wanted);
        *seen_at = captured_at;
        *demand = wanted.speed;
    }

    /// In which direction the robot cannot follow, from the limits that acted
    /// on the last setpoint and from the speed that is read back.
    fn saturation(&self) -> Saturation {
        match (self.limit, self.verdict) {
            (Limit::MaxSpeed | Limit::Acceleration, _) | (_, Verdict::Slower) => Saturation::Above,
            (Limit::MinSpeed | Limit::Deceleration, _) | (_, Verdict::Faster) => Saturation::Below,
            _ => Saturation::None,
        }
    }

    fn tick(&mut self, now: Stamp, trace: &mut Trace) -> Option<Command> {
        self.lose_patience(now);
        let mode = self.robot?.mode;
        if !self.link_up || !matches!(mode, RobotMode::Print | RobotMode::Hold) || self.ended {
            return None;
        }
        let speed = match &self.phase {
            Phase::Idle => return None,
            Phase::Fault { .. } => return Some(Command::Stop),
            Phase::Priming => self.setup.start_speed,
            Phase::Tracking { demand, .. } => *demand,
            Phase::Holding { .. } => self.told.map_or(self.setup.start_speed, |(_, speed)| speed),
        };
        trace.demand_mm_per_s = Some(speed);
        // A hold keeps the speed as it is, whatever flows.
        let speed = match self.phase {
            Phase::Holding { .. } => speed,
            _ => speed * self.flow_share(),
        };
        let (last_at, last) = self.told.unwrap_or((now, speed));
        let limited = self.setup.limits.apply(speed, last, now - last_at);
        self.limit = match (limited.limit, self.verdict) {
            (Limit::None, Verdict::Slower) => Limit::RobotSlower,
            (Limit::None, Verdict::Faster) => Limit::RobotFaster,
            (limit, _) => limit,
        };
        self.told = Some((now, limited.speed));
        Some(Command::Speed(limited.speed))
    }

    /// Holds when widths stay out, and gives up when a hold lasts too long.
    fn lose_patience(&mut self, now: Stamp) {
        let control = self.setup.control;
        match &self.phase {
            Phase::Tracking { seen_at, .. } if now - *seen_at > control.max_gap => {
                self.phase = Phase::Holding { since: now, why: Hold::NoWidth };
            }
            Phase::Holding { since, why } if !self.ended && now - *since > control.max_hold => {
                self.phase = Phase::Fault { why: Fault::HeldTooLong(why.clone()) };
            }
            _ => {}
        }
    }

    fn reported(&mut self, now: Stamp, state: &RobotState) {
        self.transport.observe(now, state);
        let before = self.robot.replace(*state);
        if self.ended {
            return;
        }
        match state.mode {
            RobotMode::Idle => self.become_idle(),
            RobotMode::Print => self.printing(now, state, before),
            RobotMode::Hold => {
                self.follow.reset();
                self.hold_if_printing(now, Hold::RobotHolds);
            }
            RobotMode::Stop => self.robot_stopped(Fault::RobotStopped),
            RobotMode::Fault => self.robot_stopped(Fault::Robot),
        }
    }

    fn become_idle(&mut self) {
        self.phase = Phase::Idle;
        self.run_up = false;
        self.told = None;
        self.limit = Limit::None;
        self.follow.reset();
        self.verdict = Verdict::Follows;
    }

    fn robot_stopped(&mut self, why: Fault) {
        self.follow.reset();
        if !matches!(self.phase, Phase::Fault { .. } | Phase::Idle) {
            self.phase = Phase::Fault { why };
        }
    }

    fn printing(&mut self, now: Stamp, state: &RobotState, before: Option<RobotState>) {
        let fresh = before.is_some_and(|last| state.path_mm < last.path_mm);
        if fresh {
            self.become_idle();
        }
        if self.phase == Phase::Idle {
            self.bead_start = state.path_mm;
            self.phase = Phase::Priming;
        }
        let told = self.told.map_or(self.setup.start_speed, |(_, speed)| speed);
        self.run_up |= state.speed_mm_per_s >= told * RUN_UP;
        if let Some((_, told)) = self.told {
            self.verdict = self.follow.observe(now, told, state.speed_mm_per_s);
        }
        match (self.verdict, &self.phase) {
            (Verdict::Lost, Phase::Holding { .. } | Phase::Tracking { .. } | Phase::Priming) => {
                self.phase = Phase::Fault { why: Fault::SpeedMismatch };
            }
            (Verdict::Mismatch, _) => self.hold_if_printing(now, Hold::SpeedMismatch),
            (
                _,
                Phase::Holding {
                    why: Hold::RobotHolds | Hold::LinkDown | Hold::SpeedMismatch, ..
                },
            ) => {
                self.resume(now, state);
            }
            _ => {}
        }
    }

    /// The reason for a hold has gone: prime on, or wait for a width.
    fn resume(&mut self, now: Stamp, state: &RobotState) {
        self.phase = if state.path_mm - self.bead_start < self.setup.start_length {
            Phase::Priming
        } else {
            Phase::Holding { since: now, why: Hold::NoWidth }
        };
    }

    fn link_came_up(&mut self, now: Stamp, robot: &RobotLimits) {
        self.link_up = true;
        self.robot = None;
        let limits = self.setup.limits;
        if limits.min_speed < robot.min_mm_per_s || limits.max_speed > robot.max_mm_per_s {
            self.link_up = false;
            self.phase = Phase::Holding { since: now, why: Hold::RobotLimits };
            self.ended = true;
        }
    }

    /// Holds a bead that is being laid; a first reason stays.
    fn hold_if_printing(&mut self, now: Stamp, why: Hold) {
        if matches!(self.phase, Phase::Priming | Phase::Tracking { .. }) {
            self.phase = Phase::Holding { since: now, why };
        } else if let Phase::Holding { why: reason, .. } = &mut self.phase
            && *reason == Hold::NoWidth
        {
            *reason = why;
        }
    }

    fn end(&mut self, now: Stamp, why: Hold) {
        self.ended = true;
        self.phase = Phase::Holding { since: now, why };
    }
}

impl Trace {
    fn note(&mut self, demand: &crate::control::pi::Demand) {
        self.proportional_mm_per_s = Some(demand.proportional);
        self.integral_mm_per_s = Some(demand.integral);
        self.demand_mm_per_s = Some(demand.speed);
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub use tests::setup as example_setup;
