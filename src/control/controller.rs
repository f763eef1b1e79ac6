//! The controller of a cell, and its answer to each event.

use super::event::Event;
use super::extruder_control::{ExtruderControl, NO_OVERRIDE};
use super::phase::{Bead, BeadOnPath, Mode, Phase, Setpoint};
use super::reports::ReportMonitor;
use super::setup::Setup;
use super::step::{Command, Fault, Hold, State, Step, Trace};
use crate::core::{Mm, RobotMode, RobotState, Span, SpeedMatch, SpeedMonitor, Stamp};
use crate::extruder::{ExtruderSetup, FlowDemand};
use crate::width_control::controller::{WidthController, WidthTrace};
use crate::width_control::distance::WidthReading;
use crate::width_control::limiter::SpeedLimit;
use crate::width_control::odometer::Odometer;
use crate::width_control::path_history::PathHistory;
use crate::width_control::watch::BeadWatch;

/// The controller of a cell. It controls the width by the robot's speed and, where the
/// cell has an extruder that is commanded, the flow by the extruder's command.
#[derive(Debug)]
pub struct Controller {
    pub(super) setup: Setup,
    pub(super) width: Box<dyn WidthController>,
    pub(super) extruder: Option<ExtruderControl>,
    pub(super) phase: Phase,
    pub(super) bead: BeadOnPath,
    pub(super) robot: RobotMonitor,
    /// The camera gives no more frames.
    pub(super) camera_lost: bool,
    /// The first of the latest equal frames.
    pub(super) first_equal: Option<FirstEqual>,
    /// Whether the width is what the speed says; none where the speed does not control the width.
    pub(super) watch: Option<BeadWatch>,
}

/// The first of several equal frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FirstEqual {
    /// When it was captured.
    pub(super) captured_at: Stamp,
    /// Path of the nozzle then, or at the first one of them for which it was known.
    pub(super) path: Mm,
}

/// What is known of the robot.
#[derive(Debug, Default)]
pub(super) struct RobotMonitor {
    pub(super) link_up: bool,
    /// The last report on this connection.
    pub(super) state: Option<RobotState>,
    /// The path in the last report, on whatever connection.
    pub(super) last_path: Option<Mm>,
    /// Whether the path has fallen since the bead began: another one is being laid.
    pub(super) is_another_bead: bool,
    /// Since when no report has come.
    pub(super) silent_since: Option<Stamp>,
    pub(super) reports: ReportMonitor,
    pub(super) path: PathHistory,
    pub(super) odometer: Odometer,
    pub(super) speed_monitor: SpeedMonitor,
    pub(super) speed_match: SpeedMatch,
}

impl Controller {
    /// A controller before the first event.
    pub fn new(setup: Setup) -> Self {
        let width = setup.control.strategy.controller(&setup.cell, &setup.control);
        let (bead, robot) = (BeadOnPath::default(), RobotMonitor::default());
        let is_controlled = setup.control.strategy.controls_width();
        let watch = is_controlled.then(|| BeadWatch::new(setup.watch_settings()));
        Self {
            setup,
            width,
            extruder: None,
            phase: Phase::Idle,
            bead,
            robot,
            camera_lost: false,
            first_equal: None,
            watch,
        }
    }

    /// Adds the side of an extruder that is commanded.
    pub fn with_extruder(mut self, setup: ExtruderSetup, demand: FlowDemand) -> Self {
        self.extruder = Some(ExtruderControl::new(setup, demand));
        self
    }

    /// Answers an event that happened at `now`.
    pub fn step(&mut self, now: Stamp, event: &Event) -> Step {
        let mut step = self.steer(now, event);
        step.extruder = self.extrude(now, event);
        self.watch_extruder(now);
        if let Some(why) = self.extruder.as_ref().and_then(ExtruderControl::fault)
            && let Some(bead) = self.phase.bead_mut()
            && !bead.is_faulty()
        {
            bead.mode = Mode::Fault { why: Fault::Extruder(why) };
        }
        step.state = self.state();
        step
    }

    /// Answers an event on the robot side alone.
    fn steer(&mut self, now: Stamp, event: &Event) -> Step {
        let mut trace = Trace::default();
        let mut command = None;
        match event {
            Event::Measured { frame, captured_at, width_mm, sigma_mm } => {
                trace.frame = Some(*frame);
                let reading = WidthReading { width: *width_mm, sigma: *sigma_mm };
                self.measured(now, *captured_at, reading, &mut trace);
            }
            Event::Repeated { frame, captured_at, first_at, width_mm, sigma_mm } => {
                trace.frame = Some(*frame);
                if self.has_moved(*first_at, *captured_at) {
                    self.repeated(*first_at, *captured_at, &mut trace);
                } else {
                    let reading = WidthReading { width: *width_mm, sigma: *sigma_mm };
                    self.measured(now, *captured_at, reading, &mut trace);
                }
            }
            Event::Rejected { frame, captured_at, .. } => {
                trace.frame = Some(*frame);
                self.locate(*captured_at, &mut trace);
            }
            Event::Robot(state) => self.reported(now, state, &mut trace),
            Event::LinkUp { robot } => self.link_came_up(robot),
            Event::LinkDown { .. } => self.link_went_down(now),
            Event::Tick => command = self.tick(now, &mut trace),
            Event::CameraLost { .. } => {
                self.camera_lost = true;
                self.phase.hold(now, Hold::CameraLost);
            }
            Event::RecordingLost => self.phase.end(Hold::RecordingLost),
            Event::Stop => {
                self.phase.end(Hold::Stopping);
                command = Some(Command::Stop);
            }
            Event::Extruder(report) => {
                if let Some(speed) = report.screw_rpm {
                    self.width.screw_reported(now, speed);
                }
            }
            Event::SetpointRefused { .. }
            | Event::ExtruderUp
            | Event::ExtruderDown { .. }
            | Event::ExtruderRefused { .. }
            | Event::ExtruderTick => {}
        }
        trace.limit = self.phase.limit();
        trace.fallback = self.width.fallback();
        Step { command, state: self.state(), trace, extruder: None }
    }

    /// The state as it is reported.
    pub fn state(&self) -> State {
        self.phase.state()
    }

    fn tick(&mut self, now: Stamp, trace: &mut Trace) -> Option<Command> {
        self.time_out(now);
        let mode = self.robot.state?.mode;
        if !self.robot.link_up || !matches!(mode, RobotMode::Print | RobotMode::Hold) {
            return None;
        }
        if let Some(outlook) = self.outlook(now)
            && let Some(seen_at) = self.width.before_setpoint(&outlook)
            && let Some(bead) = self.phase.bead_mut()
        {
            bead.mode = Mode::Tracking { seen_at };
        }
        let request = self.speed_request(now);
        let speed_override = self.speed_override(now);
        let bead = self.phase.bead_mut()?;
        let kept = bead.setpoint.map_or(self.setup.cell.start_speed, |last| last.requested);
        let requested = match &bead.mode {
            Mode::Fault { .. } => return Some(Command::Stop),
            Mode::Priming => self.setup.cell.start_speed,
            Mode::Tracking { .. } => {
                let mut of_width = WidthTrace::default();
                let speed = self.width.speed(&request, &mut of_width);
                trace.steps = of_width.steps;
                speed.unwrap_or(kept)
            }
            Mode::Holding { .. } => kept,
        };
        trace.demand_mm_per_s = Some(requested);
        let last = bead.setpoint.map_or(requested, |last| last.speed);
        let speed = speed_override.map_or(last, |factor| requested * factor);
        let (last_at, last) = bead.setpoint.map_or((now, speed), |last| (last.at, last.speed));
        let limited = self.setup.limits.limit_setpoint(speed, last, now - last_at);
        bead.limit = match (limited.limit, self.robot.speed_match) {
            (SpeedLimit::None, SpeedMatch::Slower) => SpeedLimit::RobotSlower,
            (SpeedLimit::None, SpeedMatch::Faster) => SpeedLimit::RobotFaster,
            (limit, _) => limit,
        };
        // A hold keeps the speed that was sent; under an override, the speed that the width
        // controller requested.
        let is_own = speed_override == Some(NO_OVERRIDE);
        let requested = if is_own { limited.speed } else { requested };
        bead.setpoint = Some(Setpoint { at: now, speed: limited.speed, requested });
        Some(Command::Speed(limited.speed))
    }

    /// Holds when no width comes in time, also while the first part of a bead waits for
    /// one, and changes to a fault when a hold lasts too long.
    fn time_out(&mut self, now: Stamp) {
        let is_due = self.laid_at(now).is_some_and(|laid| laid > self.widths_due());
        let max_gap = self.setup.control.max_gap;
        let max_hold = self.phase.held_for().and_then(|why| self.max_hold(why));
        let Some(Bead { mode, .. }) = self.phase.bead_mut() else { return };
        if *mode == Mode::Priming && is_due {
            *mode = Mode::holding(now, Hold::NoWidth);
        }
        match mode {
            Mode::Tracking { seen_at } if now - *seen_at > max_gap => {
                *mode = Mode::holding(now, Hold::NoWidth);
            }
            Mode::Holding { since, why, .. } if max_hold.is_some_and(|max| now - *since > max) => {
                *mode = Mode::Fault { why: Fault::HeldTooLong(why.clone()) };
            }
            _ => {}
        }
    }

    /// Length of bead after which a width is overdue: the first part or the camera's
    /// offset, whichever is longer, one more offset, and the longest gap at the start speed.
    fn widths_due(&self) -> Mm {
        let cell = &self.setup.cell;
        let max_gap = self.setup.control.max_gap;
        cell.start_length.max(cell.camera_offset) + cell.camera_offset + cell.start_speed * max_gap
    }

    /// Longest hold for a reason; none where the extruder side ends it.
    fn max_hold(&self, why: &Hold) -> Option<Span> {
        let max_hold = self.setup.control.max_hold;
        match why {
            Hold::ExtruderSilent => None,
            Hold::PathJump { .. } => Some(max_hold + self.until_seen()),
            _ => Some(max_hold),
        }
    }

    /// Time until bead that is laid now is under the camera, at the start speed.
    fn until_seen(&self) -> Span {
        let cell = &self.setup.cell;
        Span::from_secs(cell.camera_offset.get() / cell.start_speed.get())
    }

    /// Length of the bead that is laid at a time; none where the path is not known.
    pub(super) fn laid_at(&self, now: Stamp) -> Option<Mm> {
        self.robot.path.path_at(now).map(|path| path - self.bead.start)
    }
}
