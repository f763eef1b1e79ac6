//! The controller: one decision for every event. It reads no clock and opens
//! nothing; live, simulated and replayed cells run this same code.
//!
//! - idle: the robot is not printing.
//! - priming: first stretch of a bead, at the start speed, until a width of it is due.
//! - tracking: the width is held by distance, or by the PI law, once a width of
//!   this bead has been seen; or the speed goes through a course of steps.
//! - holding: the speed stays as it is, for a reason, but for what a plan, a start or
//!   a stop makes of it; left when the reason goes, and a fault when it stays too long.
//! - fault: the robot is told to stop; left when the robot is idle again.

mod by_distance;
mod by_steps;
pub mod event;
mod extrude;
mod planned;
mod robot;
pub mod step;
mod track;

pub use event::Event;
pub use step::{Command, ExtruderStep, Fault, Hold, State, Step, Trace};

use extrude::ExtruderSide;
use planned::UNPACED;

use crate::core::readback::{Follow, Verdict};
use crate::core::robot::{RobotMode, RobotState};
use crate::core::time::{Span, Stamp};
use crate::core::units::{Mm, MmPerS};
use crate::extruder::{ExtruderSetup, FlowDemand, Supervisor};
use crate::width_control::distance::{ByDistance, DistanceSettings, Distrust};
use crate::width_control::limiter::Limit;
use crate::width_control::limiter::Limits;
use crate::width_control::odometer::Odometer;
use crate::width_control::pi::{Pi, PiGains};
use crate::width_control::settings::Control;
use crate::width_control::steps::{StepSettings, Steps};
use crate::width_control::transport::Transport;

/// Everything the controller has to know of its cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Target, gains and patience.
    pub control: Control,
    /// What setpoints may be.
    pub limits: Limits,
    /// Speed of the first stretch.
    pub start_speed: MmPerS,
    /// Its length.
    pub start_length: Mm,
    /// Length of every bead, where it is known.
    pub bead_length: Option<Mm>,
    /// Path length from the nozzle back to the middle of the gauge.
    pub camera_offset: Mm,
    /// How long a robot that hears nothing lays bead before it stops by itself.
    pub alone_for: Span,
    /// Time between two setpoints.
    pub setpoint_period: Span,
    /// What the law by distance is told, where the width is held by it.
    pub distance: Option<DistanceSettings>,
    /// The course of steps, where the cell asks for one.
    pub steps: Option<StepSettings>,
}

impl Setup {
    /// Gains of the PI law: those of the cell or, where it gives none because
    /// the law is only fallen back to, an integral that the dead time from
    /// nozzle to camera allows for the bead that the law by distance was told
    /// of (internal model control with twice the dead time as the lag).
    fn gains(&self) -> PiGains {
        let exponent = self.distance.map_or(1.0, |told| told.exponent);
        let speed = self.start_speed.max(MmPerS::constant(1.0));
        let slope = exponent * self.control.target.nominal().get() / speed.get();
        let dead_s = self.camera_offset / (speed * Span::from_secs(1.0));
        let dead_s = dead_s + self.setpoint_period.secs();
        let spare = PiGains { kp_per_s: 0.0, ki_per_s2: 1.0 / (3.0 * dead_s * slope.max(1e-6)) };
        self.control.gains.unwrap_or(spare)
    }
}

/// What the controller is doing, with what it needs for it.
#[derive(Debug, Clone, PartialEq)]
enum Phase {
    Idle,
    Priming,
    Tracking { by: Steering, seen_at: Stamp },
    Holding { since: Stamp, why: Hold },
    Fault { why: Fault },
}

/// What sets the speed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Steering {
    /// The PI law, with what it would like now.
    Pi { pi: Pi, demand: MmPerS },
    /// The law by distance.
    Distance,
    /// The course of steps.
    Steps,
}

/// Which part of a bead the robot is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stretch {
    /// It has not reached yet the speed that it was told.
    RunUp,
    /// It has.
    Even,
    /// The extruder was stopped because the bead ends; the robot slows down from then on.
    Ending,
}

/// What was heard of the robot, on whatever connection.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Heard {
    /// The path in its last report.
    path: Option<Mm>,
    /// Whether the path has fallen since the bead began: another one is being laid.
    is_another: bool,
    /// Since when nobody has heard it, whatever else was the matter before.
    not_since: Option<Stamp>,
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
    /// No more frames come.
    camera_lost: bool,
    robot: Option<RobotState>,
    heard: Heard,
    transport: Transport,
    odometer: Odometer,
    /// The law by distance, where the cell asks for it.
    distance: Option<Box<ByDistance>>,
    /// Why it is not followed on this bead.
    fallback: Option<Distrust>,
    /// The course of steps, where the cell asks for one.
    steps: Option<Steps>,
    follow: Follow,
    verdict: Verdict,
    /// Where on the path the bead began.
    bead_start: Mm,
    /// How much of it was laid.
    laid: Mm,
    /// Beads of a plan that were laid before this one.
    beads: usize,
    stretch: Stretch,
    /// The last setpoint of this bead, and when it was given.
    told: Option<(Stamp, MmPerS)>,
    /// What stood behind it before a plan, a start or a stop had its say.
    asked: Option<MmPerS>,
    limit: Limit,
}

impl Controller {
    /// A controller that has seen nothing yet.
    pub fn new(setup: Setup) -> Self {
        let distance = setup.distance.map(|told| Box::new(ByDistance::new(told)));
        let steps = setup.steps.map(Steps::new);
        Self {
            setup,
            extruder: None,
            phase: Phase::Idle,
            ended: false,
            link_up: false,
            camera_lost: false,
            robot: None,
            heard: Heard::default(),
            transport: Transport::default(),
            odometer: Odometer::default(),
            distance,
            fallback: None,
            steps,
            follow: Follow::default(),
            verdict: Verdict::Follows,
            bead_start: Mm::ZERO,
            laid: Mm::ZERO,
            beads: 0,
            stretch: Stretch::RunUp,
            told: None,
            asked: None,
            limit: Limit::None,
        }
    }

    /// The same with an extruder that is commanded.
    pub fn with_extruder(mut self, setup: ExtruderSetup, demand: FlowDemand) -> Self {
        let plan = setup.plan.clone();
        self.extruder =
            Some(ExtruderSide { supervisor: Supervisor::new(setup), demand, plan, planned: None });
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

    /// The robot side's answer.
    fn steer(&mut self, now: Stamp, event: &Event) -> Step {
        let mut trace = Trace::default();
        let command = match event {
            Event::Measured { frame, captured_at, width_mm, sigma_mm } => {
                trace.frame = Some(*frame);
                self.measured((now, *captured_at), (*width_mm, *sigma_mm), &mut trace);
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
                self.heard.not_since = self.heard.not_since.or(Some(now));
                self.follow.reset();
                self.hold_if_printing(now, Hold::LinkDown);
                None
            }
            Event::Refused { .. }
            | Event::Extruder(_)
            | Event::ExtruderUp
            | Event::ExtruderDown { .. }
            | Event::ExtruderRefused { .. }
            | Event::ExtruderTick => None,
            Event::Tick => self.tick(now, &mut trace),
            Event::CameraLost { .. } => {
                self.camera_lost = true;
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
        trace.fallback = self.fallback;
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

    fn tick(&mut self, now: Stamp, trace: &mut Trace) -> Option<Command> {
        self.lose_patience(now);
        let mode = self.robot?.mode;
        if !self.link_up || !matches!(mode, RobotMode::Print | RobotMode::Hold) || self.ended {
            return None;
        }
        self.begin_by_distance(now);
        let kept = self.asked.unwrap_or(self.setup.start_speed);
        let asked = match &self.phase {
            Phase::Idle => return None,
            Phase::Fault { .. } => return Some(Command::Stop),
            Phase::Priming => self.setup.start_speed,
            Phase::Tracking { by: Steering::Pi { demand, .. }, .. } => *demand,
            Phase::Tracking { by: Steering::Distance, .. } => {
                self.speed_by_distance(now).unwrap_or(kept)
            }
            Phase::Tracking { by: Steering::Steps, .. } => self.speed_by_steps(now, trace),
            Phase::Holding { .. } => kept,
        };
        trace.demand_mm_per_s = Some(asked);
        let pace = self.pace(now);
        let last = self.told.map_or(asked, |(_, speed)| speed);
        let speed = pace.map_or(last, |pace| asked * pace);
        let (last_at, last) = self.told.unwrap_or((now, speed));
        let limited = self.setup.limits.apply(speed, last, now - last_at);
        self.limit = match (limited.limit, self.verdict) {
            (Limit::None, Verdict::Slower) => Limit::RobotSlower,
            (Limit::None, Verdict::Faster) => Limit::RobotFaster,
            (limit, _) => limit,
        };
        self.told = Some((now, limited.speed));
        // What a hold is to keep: the very speed that goes out, or where something else has
        // its say in it, what the width was to have.
        self.asked = Some(if pace == Some(UNPACED) { limited.speed } else { asked });
        Some(Command::Speed(limited.speed))
    }

    /// Holds when widths stay out, also those that the first stretch waits for, and gives up
    /// when a hold lasts too long.
    fn lose_patience(&mut self, now: Stamp) {
        let is_due = self.nozzle(now).is_some_and(|path| path > self.widths_due());
        if self.phase == Phase::Priming && is_due {
            self.phase = Phase::Holding { since: now, why: Hold::NoWidth };
        }
        let (max_gap, max_hold) = (self.setup.control.max_gap, self.setup.control.max_hold);
        match &self.phase {
            Phase::Tracking { seen_at, .. } if now - *seen_at > max_gap => {
                self.phase = Phase::Holding { since: now, why: Hold::NoWidth };
            }
            Phase::Holding { since, why } if !self.ended && now - *since > max_hold => {
                self.phase = Phase::Fault { why: Fault::HeldTooLong(why.clone()) };
            }
            _ => {}
        }
    }

    /// Where the nozzle is when a width of this bead has long been due: twice as far as the
    /// camera is behind, or once more behind the first stretch, and what the cell bears
    /// without one.
    fn widths_due(&self) -> Mm {
        let Setup { start_length, camera_offset, start_speed, control, .. } = &self.setup;
        start_length.max(*camera_offset) + *camera_offset + *start_speed * control.max_gap
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

#[cfg(test)]
mod tests;
#[cfg(test)]
pub use tests::setup as example_setup;
