//! The extruder side as a whole: when the pump runs and the valve is open,
//! when the law commands, and what happens when something is missing. Like the
//! width controller it is told what happened, and when.
//!
//! - off: no bead is laid.
//! - starting: the pump was told to run; the law stands where it begins.
//! - running: the law commands, within its limits.
//! - holding: the last command is kept, for a reason; left when the reason
//!   goes, and a fault when it stays too long.
//! - fault: the pump is stopped; left when the robot is idle again, and where
//!   the pump runs on all the same, not before it says that it stops.

mod watch;

use super::law::{Law, Wish};
use super::limits::{CommandLimit, CommandLimits};
use super::rates::Rate;
use super::readings::{ReadingFilters, Readings};
use super::report::{ExtruderCommand, ExtruderReport};
use super::state::{ExtruderFault, ExtruderHold, ExtruderState, ExtruderTrace};
use super::{Drive, RobotFollows};
use crate::control::follow::Follow;
use crate::time::{Span, Stamp};
use crate::units::{MPa, Mm3PerS};

/// Most by which a robot that follows the flow is quickened.
const MOST_SHARE: f64 = 1.5;

/// Everything the extruder side has to know of its cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderSetup {
    /// What is commanded.
    pub drive: Drive,
    /// The strategy.
    pub law: Law,
    /// What commands may be.
    pub limits: CommandLimits,
    /// Time from one step of the feedforward to the next; that of the ticks.
    pub feedforward_period: Span,
    /// Time from one step of the control to the next.
    pub control_period: Span,
    /// Time from one command to the next.
    pub io_period: Span,
    /// Longest time without a report over which the law goes on.
    pub max_gap: Span,
    /// Longest hold, and longest start, before the pump is stopped.
    pub max_hold: Span,
    /// Pressure at which the pump is stopped, if there is one.
    pub max_pressure: Option<MPa>,
    /// What readings pass before the law sees them.
    pub filters: ReadingFilters,
    /// What the robot's speed goes by besides the width.
    pub robot_follows: RobotFollows,
}

/// What the robot's side says at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Laying {
    /// Bead is being laid, and this flow is wanted at the nozzle.
    Bead(Mm3PerS),
    /// The robot stopped where it should lay bead, or is being stopped.
    Stopped,
    /// Nothing is being done.
    Idle,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Off,
    Starting { since: Stamp },
    Running,
    Holding { since: Stamp, why: ExtruderHold },
    Fault(ExtruderFault),
}

/// How a pump answers to being told to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Obedience {
    /// It rests, or was not told to.
    Obeys,
    /// It says that it runs all the same.
    RunsOn { since: Stamp },
    /// It has said so for longer than the cell is patient.
    Lost { since: Stamp },
}

impl Obedience {
    const fn is_lost(self) -> bool {
        matches!(self, Self::Lost { .. })
    }
}

/// The extruder side of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Supervisor {
    setup: ExtruderSetup,
    phase: Phase,
    link_up: bool,
    /// The last one, as the law sees it.
    report: Option<(Stamp, ExtruderReport)>,
    readings: Readings,
    follow: Follow,
    io: Rate,
    control: Rate,
    ticked: Option<Stamp>,
    controlled: Option<Stamp>,
    applied: f64,
    /// When the bead began.
    begun: Stamp,
    /// When the last report came, on whatever connection.
    heard: Option<Stamp>,
    /// Whether the pump rests when it is told to. Beside the phase, so that what
    /// stopped the pump first is not forgotten.
    obedience: Obedience,
    /// Whether the last report can be true.
    usable: bool,
    /// Whether the valve stays open to let too high a pressure out.
    relieving: bool,
    /// The last command that went out.
    told: Option<ExtruderCommand>,
    trace: ExtruderTrace,
}

impl Supervisor {
    /// An extruder side that has heard nothing yet.
    pub fn new(setup: ExtruderSetup) -> Self {
        Self {
            io: Rate::every(setup.io_period),
            control: Rate::every(setup.control_period),
            applied: setup.limits.idle(),
            readings: Readings::new(setup.filters),
            setup,
            phase: Phase::Off,
            link_up: false,
            report: None,
            follow: Follow::default(),
            ticked: None,
            controlled: None,
            begun: Stamp::START,
            heard: None,
            obedience: Obedience::Obeys,
            usable: true,
            relieving: false,
            told: None,
            trace: ExtruderTrace::default(),
        }
    }

    /// The state in words for outside.
    pub const fn state(&self) -> ExtruderState {
        match self.phase {
            _ if self.obedience.is_lost() => ExtruderState::Fault(ExtruderFault::RunsOn),
            Phase::Off => ExtruderState::Off,
            Phase::Starting { .. } => ExtruderState::Starting,
            Phase::Running => ExtruderState::Running,
            Phase::Holding { why, .. } => ExtruderState::Holding(why),
            Phase::Fault(why) => ExtruderState::Fault(why),
        }
    }

    /// The numbers behind the last command.
    pub const fn trace(&self) -> ExtruderTrace {
        self.trace
    }

    /// Share of its speed at which a robot that follows the flow is to move:
    /// the flow that is foretold over the one that is wanted; 1 where the robot
    /// does not follow, or nothing is known of the flow.
    pub fn robot_share(&self) -> f64 {
        let wanted = self.trace.flow_mm3_per_s;
        match (self.setup.robot_follows, self.trace.foretold_mm3_per_s) {
            (RobotFollows::Flow, Some(foretold)) if wanted > Mm3PerS::ZERO => {
                (foretold / wanted).clamp(0.0, MOST_SHARE)
            }
            _ => 1.0,
        }
    }

    /// The link to the extruder came up.
    pub fn link_came_up(&mut self) {
        self.link_up = true;
    }

    /// The link to the extruder was lost.
    pub fn link_went_down(&mut self, now: Stamp) {
        self.link_up = false;
        self.report = None;
        self.readings.forget();
        self.obedience = Obedience::Obeys;
        self.follow.reset();
        self.hold(now, ExtruderHold::LinkDown);
    }

    /// It is time for a step of the feedforward. Gives a command when one is
    /// due, and at once when the pump is to stop.
    pub fn tick(&mut self, now: Stamp, laying: Laying) -> Option<ExtruderCommand> {
        let dt = self.ticked.replace(now).map_or(Span::ZERO, |last| now - last);
        match laying {
            Laying::Bead(_) if self.obedience.is_lost() => {}
            Laying::Bead(flow) => self.lay(now, dt, flow),
            Laying::Stopped if matches!(self.phase, Phase::Fault(_)) => {}
            Laying::Stopped | Laying::Idle => self.rest(),
        }
        let command = self.command();
        let stops = self.told.is_some_and(|told| told.pump_on) && !command.pump_on;
        // Nothing is sent on a connection before it is known what the pump does.
        if !(self.io.due(now) || stops) || !self.link_up || self.report.is_none() {
            return None;
        }
        self.told = Some(command);
        self.told
    }

    /// The run is being ended: the pump stops now.
    pub fn stop(&mut self) -> Option<ExtruderCommand> {
        self.rest();
        if !self.link_up {
            return None;
        }
        self.told = Some(self.command());
        self.told
    }

    fn command(&self) -> ExtruderCommand {
        let on = !matches!(self.phase, Phase::Off | Phase::Fault(_));
        let value = if on { self.applied } else { self.setup.limits.idle() };
        // A valve that shuts on too high a pressure keeps it in.
        ExtruderCommand { pump_on: on, valve_open: on || self.relieving, value }
    }

    fn rest(&mut self) {
        self.phase = Phase::Off;
        self.applied = self.setup.limits.idle();
        self.controlled = None;
        self.follow.reset();
        self.trace = ExtruderTrace::default();
    }

    fn lay(&mut self, now: Stamp, dt: Span, flow: Mm3PerS) {
        self.trace.flow_mm3_per_s = flow;
        if self.phase == Phase::Off {
            self.begin(now, flow);
        }
        self.lose_patience(now);
        match self.phase {
            Phase::Running => self.drive(now, dt, flow),
            Phase::Holding { why, .. } => {
                self.setup.law.strategy_mut().wait(dt);
                if why == ExtruderHold::BadReading && self.usable && self.answer(now) == Some(true)
                {
                    self.resume(now);
                }
            }
            Phase::Off | Phase::Starting { .. } | Phase::Fault(_) => {}
        }
        self.trace.foretold_mm3_per_s = self.setup.law.strategy().foretold();
    }

    /// Begins a bead. Its first command is no change of another and has no
    /// rate.
    fn begin(&mut self, now: Stamp, flow: Mm3PerS) {
        self.phase = Phase::Starting { since: now };
        self.begun = now;
        self.stand(now, flow);
    }

    /// Stands where the law begins.
    fn stand(&mut self, now: Stamp, flow: Mm3PerS) {
        let wish = self.setup.law.strategy_mut().begin(now, flow);
        let (low, high) = self.setup.limits.range();
        self.applied = if wish.value.is_finite() {
            wish.value.clamp(low, high)
        } else {
            self.setup.limits.idle()
        };
        self.note(wish, CommandLimit::None);
    }

    fn drive(&mut self, now: Stamp, dt: Span, flow: Mm3PerS) {
        self.setup.law.strategy_mut().foresee(dt, flow);
        if self.answer(now) == Some(false) {
            self.usable = false;
            self.hold(now, ExtruderHold::BadReading);
            return;
        }
        let law = self.setup.law.strategy_mut();
        let wish = law.wish();
        let (applied, limit) = self.setup.limits.apply(wish.value, self.applied, dt);
        let limit = if limit == CommandLimit::None { law.limit() } else { limit };
        law.settle(now, applied);
        self.applied = applied;
        self.note(wish, limit);
    }

    /// Lets the law answer the last report where that is due, and says whether
    /// the report can be true.
    fn answer(&mut self, now: Stamp) -> Option<bool> {
        let (_, report) = self.report?;
        if !self.control.due(now) {
            return None;
        }
        let since = self.controlled.replace(now).map_or(Span::ZERO, |last| now - last);
        Some(self.setup.law.strategy_mut().answer(now, since, &report).is_ok())
    }

    fn note(&mut self, wish: Wish, limit: CommandLimit) {
        self.trace.feedforward = finite(wish.feedforward);
        self.trace.feedback = finite(wish.feedback);
        self.trace.limit = limit;
    }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

#[cfg(test)]
mod tests;
