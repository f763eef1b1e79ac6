//! The supervisor of the extruder side: when the pump runs and the valve is open, when the
//! strategy commands, and how faults are handled. Time is an argument of each call.
//!
//! - off: no bead is laid.
//! - starting: the pump is commanded to run; the strategy keeps its first command.
//! - running: the strategy commands, within the limits. While the flow of a start rises, where
//!   the cell knows its times, the first command is kept.
//! - holding: the last command is kept, for a reason. Left when the reason goes; a hold that
//!   lasts too long becomes a fault.
//! - ending: the pump was stopped early, and the flow after the stop fills the rest of the
//!   bead.
//! - fault: the pump is stopped. Left when the robot is idle again; where the pump runs on
//!   although it is commanded to stop, not before it reports that it stops.

mod bead;
mod sequencer;
mod watch;

use std::sync::Arc;

use super::limits::{CommandLimit, CommandLimits};
use super::rates::Rate;
use super::readings::{ReadingFilters, Readings};
use super::report::{ExtruderCommand, ExtruderReport};
use super::start_stop::StartStopTiming;
use super::state::{ExtruderFault, ExtruderHold, ExtruderState, ExtruderTrace};
use super::strategy::{CommandDemand, ExtruderStrategy};
use super::trajectory::PlannedJob;
use super::{CommandQuantity, RobotFollows};
use crate::core::{MPa, Mm, Mm3PerS, MmPerS, Span, SpeedMonitor, Stamp};
use sequencer::{StartStopSequencer, TransitionRatios};

/// Largest speed ratio of a robot that follows the flow. A larger one corrects a larger surplus
/// of flow and lets an error of the model speed the robot up more.
const MAX_SPEED_RATIO: f64 = 1.5;

/// Parameters of the cell for the extruder side.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderSetup {
    /// What is commanded.
    pub quantity: CommandQuantity,
    /// The strategy.
    pub strategy: ExtruderStrategy,
    /// Range and fastest change of commands.
    pub limits: CommandLimits,
    /// Time between two steps of the feedforward; that of the ticks.
    pub feedforward_period: Span,
    /// Time between two steps of the feedback.
    pub control_period: Span,
    /// Time between two commands.
    pub io_period: Span,
    /// How long a command is valid at the extruder, after the report that it answers.
    pub command_valid: Span,
    /// Longest time without a report over which the strategy goes on.
    pub max_gap: Span,
    /// Longest hold, and longest start, before the pump is stopped.
    pub max_hold: Span,
    /// Pressure at which the pump is stopped, if there is one.
    pub max_pressure: Option<MPa>,
    /// Filters of the readings for the strategy.
    pub filters: ReadingFilters,
    /// What the robot's speed follows besides the width.
    pub robot_follows: RobotFollows,
    /// Times of its starts and stops, if known.
    pub timing: Option<StartStopTiming>,
    /// The planned job of robot and extruder, if there is one.
    pub plan: Option<Arc<PlannedJob>>,
}

/// Whether bead is laid, at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Laying {
    /// Bead is laid, with this demanded flow at the nozzle.
    Bead(Mm3PerS),
    /// The rest of the bead is filled by the flow after a stop; this was the demanded flow.
    Ending(Mm3PerS),
    /// The robot stopped on a bead, or is being stopped.
    Stopped,
    /// No bead is laid.
    Idle,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Off,
    Starting { since: Stamp },
    Running,
    Holding { since: Stamp, why: ExtruderHold },
    Ending,
    Fault(ExtruderFault),
}

/// Whether a pump complies with a command to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
enum StopCompliance {
    /// It stands, or is not commanded to.
    Complies,
    /// It reports that it runs, or has done so for longer than the longest hold.
    RunsOn { since: Stamp, timed_out: bool },
}

impl StopCompliance {
    const fn has_timed_out(self) -> bool {
        matches!(self, Self::RunsOn { timed_out: true, .. })
    }
}

/// The extruder side of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Supervisor {
    setup: ExtruderSetup,
    phase: Phase,
    link_up: bool,
    /// The last report, filtered.
    report: Option<(Stamp, ExtruderReport)>,
    readings: Readings,
    readback: SpeedMonitor,
    io: Rate,
    control: Rate,
    last_tick: Option<Stamp>,
    last_control: Option<Stamp>,
    applied: f64,
    /// When the bead began.
    bead_start: Stamp,
    /// When the last report came, on whatever connection.
    last_report_at: Option<Stamp>,
    /// Whether the pump complies with a stop. Independent of the phase, which keeps the first
    /// fault.
    stop_compliance: StopCompliance,
    /// Whether the last report is plausible.
    report_usable: bool,
    /// Whether the valve stays open to relieve a pressure that is too high.
    relieving: bool,
    /// The last command that went out.
    last_command: Option<ExtruderCommand>,
    /// Starts and stops, where the cell has their times.
    start_stop: Option<StartStopSequencer>,
    /// The ratios of a start or a stop at the last tick.
    ratios: Option<TransitionRatios>,
    trace: ExtruderTrace,
}

impl Supervisor {
    /// Before the first report.
    pub fn new(setup: ExtruderSetup) -> Self {
        Self {
            io: Rate::every(setup.io_period),
            control: Rate::every(setup.control_period),
            applied: setup.limits.idle(),
            readings: Readings::new(setup.filters),
            start_stop: setup.timing.map(StartStopSequencer::new),
            ratios: None,
            setup,
            phase: Phase::Off,
            link_up: false,
            report: None,
            readback: SpeedMonitor::default(),
            last_tick: None,
            last_control: None,
            bead_start: Stamp::START,
            last_report_at: None,
            stop_compliance: StopCompliance::Complies,
            report_usable: true,
            relieving: false,
            last_command: None,
            trace: ExtruderTrace::default(),
        }
    }

    /// The state as it is reported.
    pub const fn state(&self) -> ExtruderState {
        match self.phase {
            _ if self.stop_compliance.has_timed_out() => {
                ExtruderState::Fault(ExtruderFault::RunsOn)
            }
            Phase::Off => ExtruderState::Off,
            Phase::Starting { .. } => ExtruderState::Starting,
            Phase::Running => ExtruderState::Running,
            Phase::Holding { why, .. } => ExtruderState::Holding(why),
            Phase::Ending => ExtruderState::Ending,
            Phase::Fault(why) => ExtruderState::Fault(why),
        }
    }

    /// The numbers behind the last command.
    pub const fn trace(&self) -> ExtruderTrace {
        self.trace
    }

    /// Speed ratio of the robot: in a start and in a stop the one that belongs to it; else,
    /// for a robot that follows the flow, predicted over demanded flow; 1 where the robot does
    /// not follow, or there is no prediction.
    pub fn robot_speed_ratio(&self) -> f64 {
        self.ratios.map_or_else(|| self.predicted_speed_ratio(), |ratios| ratios.robot)
    }

    /// Flow at the nozzle over the demanded flow: the bead is as wide as one laid at the speed
    /// divided by it. 1 where there is no prediction.
    pub fn flow_ratio(&self) -> f64 {
        self.ratios.map_or_else(|| self.predicted_flow_ratio().unwrap_or(1.0), |ratios| ratios.flow)
    }

    /// Whether a start or a stop is in progress, which the robot follows.
    pub const fn is_in_transition(&self) -> bool {
        self.ratios.is_some()
    }

    /// Distance from the end of a bead at this speed at which the pump stops; none where the
    /// times of stops are not known.
    pub fn stop_distance(&self, speed: MmPerS) -> Option<Mm> {
        self.start_stop.as_ref().map(|sequencer| sequencer.stop_distance(speed))
    }

    /// Sets the planned command at the nozzle's position, which the strategy gives once the
    /// flow is established; none without a plan.
    pub fn plan(&mut self, command: Option<f64>) {
        self.setup.strategy.controller_mut().plan(command);
    }

    fn predicted_speed_ratio(&self) -> f64 {
        let follows = self.setup.robot_follows == RobotFollows::Flow;
        self.predicted_flow_ratio().filter(|_| follows).unwrap_or(1.0)
    }

    /// Predicted over demanded flow; none without a demand and where a plan is followed, which
    /// has matched robot and flow already.
    fn predicted_flow_ratio(&self) -> Option<f64> {
        let demanded = self.trace.flow_mm3_per_s;
        if self.setup.strategy.controller().is_on_plan() || demanded <= Mm3PerS::ZERO {
            return None;
        }
        self.trace
            .predicted_mm3_per_s
            .map(|predicted| (predicted / demanded).clamp(0.0, MAX_SPEED_RATIO))
    }

    /// The link to the extruder came up.
    pub fn link_came_up(&mut self) {
        self.link_up = true;
    }

    /// The link to the extruder was lost.
    pub fn link_went_down(&mut self, now: Stamp) {
        self.link_up = false;
        self.report = None;
        self.readings.reset();
        self.stop_compliance = StopCompliance::Complies;
        self.readback.reset();
        self.hold(now, ExtruderHold::LinkDown);
    }

    /// A step of the feedforward is due. Returns a command when one is due, and at once when
    /// a step of the feedback changes it and when the pump has to stop.
    pub fn tick(&mut self, now: Stamp, laying: Laying) -> Option<ExtruderCommand> {
        let dt = self.last_tick.replace(now).map_or(Span::ZERO, |last| now - last);
        match laying {
            Laying::Bead(_) if self.stop_compliance.has_timed_out() => {}
            Laying::Bead(flow) => self.lay(now, dt, flow),
            Laying::Ending(flow) => self.end_early(now, flow),
            Laying::Stopped if matches!(self.phase, Phase::Fault(_)) => {}
            Laying::Stopped | Laying::Idle => self.rest(),
        }
        let command = self.command();
        let ran = self.last_command.is_some_and(|last| last.pump_on);
        let stops = ran && !command.pump_on;
        // The strategy counts with its command from now on. A link that is slower than the feedback takes
        // what it can.
        let is_new = self.last_control == Some(now)
            && self.setup.control_period >= self.setup.io_period
            && self.last_command.is_some_and(|last| last != command);
        // Nothing is sent on a connection before its first report.
        if !(self.io.due(now) || is_new || stops) || !self.link_up || self.report.is_none() {
            return None;
        }
        if let Some(sequencer) = self.start_stop.as_mut().filter(|_| ran != command.pump_on) {
            sequencer.pump_switched(now, command.pump_on);
        }
        self.last_command = Some(command);
        self.last_command
    }

    /// The run ends: the pump stops now.
    pub fn stop(&mut self) -> Option<ExtruderCommand> {
        self.rest();
        if !self.link_up {
            return None;
        }
        self.last_command = Some(self.command());
        self.last_command
    }

    fn command(&self) -> ExtruderCommand {
        let on = !matches!(self.phase, Phase::Off | Phase::Ending | Phase::Fault(_));
        let value = if on { self.applied } else { self.setup.limits.idle() };
        // A closed valve would keep in a pressure that is too high, or the flow that fills
        // the end of a bead.
        let open = on || self.relieving || self.phase == Phase::Ending;
        ExtruderCommand { pump_on: on, valve_open: open, value }
    }

    fn drive(&mut self, now: Stamp, dt: Span, flow: Mm3PerS) {
        self.setup.strategy.controller_mut().feedforward(dt, flow);
        if self.answer(now) == Some(false) {
            self.report_usable = false;
            self.hold(now, ExtruderHold::BadReading);
            return;
        }
        let controller = self.setup.strategy.controller_mut();
        if controller.is_unanswered(now) {
            self.phase = Phase::Fault(ExtruderFault::NoPressureResponse);
            return;
        }
        let demand = controller.demand();
        let (applied, limit) = self.setup.limits.apply(demand.value, self.applied, dt);
        let limit = if limit == CommandLimit::None { controller.limit() } else { limit };
        controller.settle(now, applied);
        self.applied = applied;
        self.note(demand, limit);
    }

    /// Steps the feedback with the last report where that is due; returns whether the report
    /// is plausible.
    fn answer(&mut self, now: Stamp) -> Option<bool> {
        let (_, report) = self.report?;
        if !self.control.due(now) {
            return None;
        }
        let since = self.last_control.replace(now).map_or(Span::ZERO, |last| now - last);
        Some(self.setup.strategy.controller_mut().control(now, since, &report).is_ok())
    }

    fn note(&mut self, demand: CommandDemand, limit: CommandLimit) {
        self.trace.feedforward = finite(demand.feedforward);
        self.trace.feedback = finite(demand.feedback);
        self.trace.limit = limit;
    }
}

fn finite(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

#[cfg(test)]
mod tests;
