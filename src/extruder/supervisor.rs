//! The extruder side as a whole: when the pump runs and the valve is open,
//! when the law commands, and what happens when something is missing. Like the
//! width controller it is told what happened, and when.
//!
//! - off: no bead is laid.
//! - starting: the pump was told to run; the law stands where it begins.
//! - running: the law commands, within its limits; while the flow of a start still
//!   comes, where the cell knows that of its extruder, the law stands.
//! - holding: the last command is kept, for a reason; left when the reason
//!   goes, and a fault when it stays too long.
//! - ending: the pump was stopped early, and what still comes fills the rest of the bead.
//! - fault: the pump is stopped; left when the robot is idle again, and where
//!   the pump runs on all the same, not before it says that it stops.

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
use crate::core::readback::SpeedMonitor;
use crate::core::time::{Span, Stamp};
use crate::core::units::{MPa, Mm, Mm3PerS, MmPerS};
use sequencer::{StartStopSequencer, TransitionRatios};

/// Most by which a robot that follows the flow is quickened.
const MAX_SPEED_RATIO: f64 = 1.5;

/// Everything the extruder side has to know of its cell.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtruderSetup {
    /// What is commanded.
    pub quantity: CommandQuantity,
    /// The strategy.
    pub strategy: ExtruderStrategy,
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
    /// How it starts and stops, if that is known.
    pub timing: Option<StartStopTiming>,
    /// The job that robot and extruder were planned for together, if there is one.
    pub plan: Option<Arc<PlannedJob>>,
}

/// What the robot's side says at a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Laying {
    /// Bead is being laid, and this flow is wanted at the nozzle.
    Bead(Mm3PerS),
    /// So little bead is left that what still comes of a pump that stops fills it; until
    /// then this flow was wanted.
    Ending(Mm3PerS),
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
    Ending,
    Fault(ExtruderFault),
}

/// How a pump answers to being told to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
enum StopCompliance {
    /// It rests, or was not told to.
    Complies,
    /// It says that it runs all the same.
    RunsOn { since: Stamp },
    /// It has said so for longer than the cell is patient.
    TimedOut { since: Stamp },
}

impl StopCompliance {
    const fn has_timed_out(self) -> bool {
        matches!(self, Self::TimedOut { .. })
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
    /// Whether the pump rests when it is told to. Beside the phase, so that what
    /// stopped the pump first is not forgotten.
    stop_compliance: StopCompliance,
    /// Whether the last report can be true.
    report_usable: bool,
    /// Whether the valve stays open to let too high a pressure out.
    relieving: bool,
    /// The last command that went out.
    last_command: Option<ExtruderCommand>,
    /// Starts and stops, where the cell knows them.
    start_stop: Option<StartStopSequencer>,
    /// What they make of the last tick.
    ratios: Option<TransitionRatios>,
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

    /// The state in words for outside.
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

    /// Share of its speed at which the robot is to move: in a start and in a stop
    /// that which belongs to it, else for a robot that follows the flow the
    /// flow that is foretold over the one that is wanted; 1 where the robot
    /// does not follow, or nothing is known of the flow.
    pub fn robot_speed_ratio(&self) -> f64 {
        self.ratios.map_or_else(|| self.predicted_speed_ratio(), |shares| shares.robot)
    }

    /// The flow at the nozzle over the one that is wanted, by which the bead that is
    /// laid is wider than the speed alone tells; 1 where nothing is known of it.
    pub fn flow_ratio(&self) -> f64 {
        self.ratios.map_or_else(|| self.predicted_flow_ratio().unwrap_or(1.0), |shares| shares.flow)
    }

    /// Whether a start or a stop is on its way, by which the robot goes.
    pub const fn is_in_transition(&self) -> bool {
        self.ratios.is_some()
    }

    /// How far from the end of a bead that is laid at this speed the pump is to stop;
    /// none where nothing is known of stops.
    pub fn stop_distance(&self, speed: MmPerS) -> Option<Mm> {
        self.start_stop.as_ref().map(|pauses| pauses.stop_distance(speed))
    }

    /// The command that was planned for where the nozzle is now, which the law gives once
    /// the flow has come; none without a plan.
    pub fn plan(&mut self, command: Option<f64>) {
        self.setup.strategy.controller_mut().plan(command);
    }

    fn predicted_speed_ratio(&self) -> f64 {
        match self.setup.robot_follows {
            RobotFollows::Flow => self.predicted_flow_ratio().unwrap_or(1.0),
            RobotFollows::Nothing => 1.0,
        }
    }

    /// The flow that is foretold over the one that is wanted, where one is and no plan has
    /// foreseen how robot and flow go together.
    fn predicted_flow_ratio(&self) -> Option<f64> {
        let wanted = self.trace.flow_mm3_per_s;
        if self.setup.strategy.controller().is_on_plan() || wanted <= Mm3PerS::ZERO {
            return None;
        }
        self.trace
            .predicted_mm3_per_s
            .map(|predicted| (predicted / wanted).clamp(0.0, MAX_SPEED_RATIO))
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

    /// It is time for a step of the feedforward. Gives a command when one is
    /// due, and at once when the pump is to stop.
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
        // Nothing is sent on a connection before it is known what the pump does.
        if !(self.io.due(now) || stops) || !self.link_up || self.report.is_none() {
            return None;
        }
        if let Some(pauses) = self.start_stop.as_mut().filter(|_| ran != command.pump_on) {
            pauses.pump_switched(now, command.pump_on);
        }
        self.last_command = Some(command);
        self.last_command
    }

    /// The run is being ended: the pump stops now.
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
        // A valve that shuts on too high a pressure keeps it in, and one that shuts before
        // the end of a bead what was to fill it.
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
        let demand = controller.demand();
        let (applied, limit) = self.setup.limits.apply(demand.value, self.applied, dt);
        let limit = if limit == CommandLimit::None { controller.limit() } else { limit };
        controller.settle(now, applied);
        self.applied = applied;
        self.note(demand, limit);
    }

    /// Lets the law answer the last report where that is due, and says whether
    /// the report can be true.
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
