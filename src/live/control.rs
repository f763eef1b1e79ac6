//! The control thread: waits for events, for the next setpoint's time and for the next step of the
//! extruder side, and lets the runner respond.

mod ending;
mod extruder;
mod extruder_watch;
mod frames;
mod inputs;
mod notices;
mod robot;
mod setpoint_clock;
mod status_line;
mod steps;

use crossbeam_channel::Receiver;

use super::capture::CameraMessage;
use super::journal::Journal;
use super::latency::Latencies;
use crate::control::{Command, Event, State, Step};
use crate::core::{MmPerS, RobotMode, Span, Stamp};
use crate::drivers::camera::rendered::RobotView;
use crate::rows::summary::RunNote;
use crate::run::ports::{ExtruderPort, Recorder, RobotEvent, RobotPort};
use crate::run::robot_z::RobotZ;
use crate::run::runner::{Handled, Runner};
use crate::width_control::limiter::SpeedLimits;

pub use ending::Ending;
pub use extruder_watch::ExtruderWatch;
pub use inputs::{Inputs, LiveInput, LiveInputs};
pub use notices::Notices;
pub use setpoint_clock::SetpointClock;
pub use status_line::StatusLine;
pub use steps::StepsWatch;

/// Longest wait for the robot's report that it has stopped.
const SHUTDOWN_TIMEOUT: Span = Span::from_millis(600);

/// The runner of a live run.
pub type LiveRunner<K> = Runner<Box<dyn RobotPort>, K, Option<Box<dyn ExtruderPort>>>;

/// When the control thread acts, and what ends it.
#[derive(Debug, Clone, Copy)]
pub struct ControlSettings {
    /// Setpoints a second.
    pub rate_hz: f64,
    /// The cell's limits, within which those of its robot must lie.
    pub limits: SpeedLimits,
    /// Duration of the run; `None` for a run without a time limit.
    pub duration: Option<Span>,
    /// Whether to end when a sequence of speed steps is over.
    pub ends_with_steps: bool,
}

/// What reaches the operator.
pub struct Operator {
    /// Called with messages.
    pub notice: Box<dyn FnMut(&str) + Send>,
    /// Called with a line about the run, each of which replaces the one before.
    pub status: Box<dyn FnMut(&str) + Send>,
}

/// The control thread.
pub struct ControlThread<'a, I, K> {
    /// What it waits for, and its clock.
    pub inputs: I,
    /// The controller with its ports and its recorder.
    pub runner: LiveRunner<K>,
    /// What is known of the extruder, where one is commanded.
    pub extruder: Option<ExtruderWatch>,
    /// Heights of the nozzle, which the measurement reads.
    pub robot_z: RobotZ,
    /// A rendered camera, which follows the robot's reports.
    pub robot_view: Option<RobotView>,
    settings: ControlSettings,
    setpoints: SetpointClock,
    latencies: Latencies,
    journal: &'a dyn Journal,
    operator: Operator,
    status_line: StatusLine,
    unfit: Option<Ending>,
    steps: Option<StepsWatch>,
    notices: Notices,
    speed: Option<MmPerS>,
    setpoint: Option<MmPerS>,
}

impl<'a, I: Inputs, K: Recorder> ControlThread<'a, I, K> {
    /// Before the first input; the extruder is watched where one is commanded.
    pub fn new(
        settings: ControlSettings,
        inputs: I,
        runner: LiveRunner<K>,
        extruder: Option<ExtruderWatch>,
        journal: &'a dyn Journal,
        operator: Operator,
    ) -> Self {
        Self {
            setpoints: SetpointClock::new(inputs.now(), Span::from_secs(1.0 / settings.rate_hz)),
            status_line: StatusLine::new(extruder.is_some()),
            steps: settings.ends_with_steps.then(StepsWatch::default),
            settings,
            inputs,
            runner,
            extruder,
            robot_z: RobotZ::default(),
            robot_view: None,
            latencies: Latencies::default(),
            journal,
            operator,
            unfit: None,
            notices: Notices::default(),
            speed: None,
            setpoint: None,
        }
    }

    /// Runs until an ending occurs, then shuts down.
    pub fn run(&mut self) -> Ending {
        let ending = self.until_ended();
        self.give(Event::Stop);
        self.inputs.ignore_camera();
        self.shut_down();
        ending
    }

    /// Waits until robot and extruder report that they are at rest, at most [`SHUTDOWN_TIMEOUT`].
    fn shut_down(&mut self) {
        let until = self.inputs.now() + SHUTDOWN_TIMEOUT;
        let mut stopped = false;
        while !(stopped && self.extruder.as_ref().is_none_or(ExtruderWatch::rests)) {
            match self.inputs.next(until) {
                Some(LiveInput::Robot(event)) => {
                    stopped |= has_stopped(&event);
                    self.take_robot_event(event);
                }
                Some(LiveInput::Extruder(event)) => self.take_extruder_event(event),
                Some(LiveInput::DeviceGone) | None => return,
                Some(_) => {}
            }
        }
    }

    /// Handles the remaining messages of the camera, so that every frame in the recording has its
    /// event and its row.
    pub fn take_rest(&mut self, seen: &Receiver<CameraMessage>) {
        for seen in seen.try_iter() {
            match seen {
                CameraMessage::Frame(measured) => self.take_measured(*measured),
                CameraMessage::Unreadable { seq, at, reason } => self.unreadable(seq, at, &reason),
                CameraMessage::Waiting(_) | CameraMessage::Ended(_) => {}
            }
        }
    }

    fn until_ended(&mut self) -> Ending {
        let start = self.inputs.now();
        let mut extruder_due = self.extruder.as_ref().map(|side| start + side.period());
        let over = self.settings.duration.map(|duration| start + duration);
        let mut lost: Option<String> = None;
        loop {
            let now = self.inputs.now();
            if over.is_some_and(|over| now >= over) {
                return Ending::TimeOver;
            }
            if self.steps.is_some_and(StepsWatch::is_over) {
                return Ending::StepsOver;
            }
            let due = self.setpoints.due();
            if now >= due {
                self.tick(due);
                self.setpoints.sent(self.inputs.now());
                if let Some(why) = &lost
                    && matches!(self.notices.state(), Some(State::Fault(_) | State::Idle))
                {
                    return Ending::CameraLost(why.clone());
                }
                continue;
            }
            if let (Some(at), Some(side)) = (extruder_due, &self.extruder)
                && now >= at
            {
                let period = side.period();
                self.give(Event::ExtruderTick);
                extruder_due = Some(next_due(at, period, self.inputs.now()));
                continue;
            }
            let until = [over, extruder_due].into_iter().flatten().fold(due, Stamp::min);
            match self.inputs.next(until) {
                Some(LiveInput::Camera(CameraMessage::Frame(measured))) => {
                    self.take_measured(*measured);
                }
                Some(LiveInput::Camera(CameraMessage::Unreadable { seq, at, reason })) => {
                    self.unreadable(seq, at, &reason);
                }
                Some(LiveInput::Camera(CameraMessage::Waiting(reason))) => {
                    (self.operator.notice)(&format!("waiting for the camera {reason}"));
                }
                Some(LiveInput::Camera(CameraMessage::Ended(None)) | LiveInput::CameraGone) => {
                    return Ending::LastFrame;
                }
                Some(LiveInput::Camera(CameraMessage::Ended(Some(reason)))) => {
                    (self.operator.notice)(&format!("camera lost: {reason}"));
                    self.give(Event::CameraLost { reason: reason.clone() });
                    lost = Some(reason);
                    self.inputs.ignore_camera();
                }
                Some(LiveInput::Robot(event)) => self.take_robot_event(event),
                Some(LiveInput::Extruder(event)) => self.take_extruder_event(event),
                Some(LiveInput::RecordingLost(error)) => {
                    self.runner.lose_recording(self.inputs.now(), error.clone());
                    return Ending::RecordingLost(error.0);
                }
                Some(LiveInput::StopRequested) => return Ending::Asked,
                Some(LiveInput::DeviceGone) | None => {}
            }
            if let Some(ending) = self.unfit.take() {
                return ending;
            }
            if let Some(error) = self.runner.failure() {
                return Ending::RecordingLost(error.0.clone());
            }
        }
    }

    /// Passes an event to the runner and its response to the log.
    fn give(&mut self, event: Event) -> Handled {
        let now = self.inputs.now();
        self.robot_z.note(now, &event);
        let handled = self.runner.handle(now, &event);
        for failed in [&handled.robot, &handled.extruder] {
            if let Some(Err(reason)) = failed {
                tracing::debug!(%reason, "a command was not sent");
            }
        }
        if let (Some(Ok(_)), Some(Command::Speed(speed))) = (&handled.robot, handled.step.command) {
            self.setpoint = Some(speed);
            self.journal.note(RunNote::SetpointSent);
        }
        if let Some(steps) = &mut self.steps {
            steps.see(&handled.step);
        }
        self.show(now, &event, &handled.step);
        self.show_extruder(now, &handled.step);
        self.journal.step(now, event, handled.step.clone());
        handled
    }

    /// Tells the operator what a step brings.
    fn show(&mut self, now: Stamp, event: &Event, step: &Step) {
        for words in self.notices.of(now, step) {
            (self.operator.notice)(&words);
        }
        if let Some(line) = self.status_line.of(now, event, step) {
            (self.operator.status)(&line);
        }
    }

    fn tick(&mut self, due: Stamp) {
        let handled = self.give(Event::Tick);
        match (handled.robot, handled.step.command) {
            (Some(Ok(sent)), Some(Command::Speed(_))) => {
                for latency in self.latencies.sent(due, sent.at) {
                    self.journal.latency(latency);
                }
            }
            _ => self.latencies.forget(),
        }
    }
}

/// Whether a report says that the robot lays no more bead.
fn has_stopped(event: &RobotEvent) -> bool {
    let RobotEvent::State { state, .. } = event else { return false };
    matches!(state.mode, RobotMode::Stop | RobotMode::Idle | RobotMode::Fault)
}

/// The next time on a fixed grid; missed times are skipped.
fn next_due(due: Stamp, period: Span, now: Stamp) -> Stamp {
    let mut next = due + period;
    while next <= now {
        next = next + period;
    }
    next
}

#[cfg(test)]
mod tests;
