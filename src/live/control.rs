//! The control thread: waits for what happens, for the next setpoint's time and
//! for the next step of the extruder side, and lets the runner answer.

mod ending;
mod extruder;
mod extruder_watch;
mod frames;
mod port;
mod robot;
mod steps;

use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

use crossbeam_channel::{Receiver, never, select};

use super::capture::CameraMessage;
use super::latency::Latencies;
use super::run_logger::RunLogger;
use crate::control::event::Event;
use crate::control::step::{Command, State, Step};
use crate::core::robot::RobotMode;
use crate::core::time::{Span, Stamp};
use crate::core::units::MmPerS;
use crate::drivers::camera::rendered::RobotView;
use crate::drivers::extruder::{ExtruderClient, ExtruderEvent};
use crate::drivers::robot::RobotEvent;
use crate::io::clock::RunClock;
use crate::io::recorder::RecorderHandle;
use crate::rows::names;
use crate::rows::summary::RunNote;
use crate::run::ports::RecordError;
use crate::run::runner::{Handled, Runner};
use crate::width_control::limiter::SpeedLimits;

pub use ending::Ending;
pub use extruder_watch::ExtruderWatch;
pub use port::LinkPort;
pub use steps::StepsWatch;

/// Longest wait for the robot to say that it has stopped.
const SHUTDOWN_TIMEOUT: Span = Span::from_millis(600);

/// Where events come from.
pub struct Sources<'a> {
    pub seen: &'a Receiver<CameraMessage>,
    pub robot: &'a Receiver<RobotEvent>,
    pub extruder: &'a Receiver<ExtruderEvent>,
    pub alarm: &'a Receiver<RecordError>,
    pub stop: &'a Receiver<()>,
}

/// The control thread's own.
pub struct ControlThread<'a> {
    pub runner: Runner<LinkPort, RecorderHandle, Option<ExtruderClient>>,
    pub extruder: Option<ExtruderWatch>,
    pub clock: RunClock,
    pub period: Span,
    pub duration: Option<Span>,
    pub robot_z: Arc<AtomicU64>,
    pub robot_view: Option<RobotView>,
    pub latencies: Latencies,
    pub logger: &'a RunLogger,
    pub notice: Box<dyn FnMut(&str) + Send>,
    pub limits: SpeedLimits,
    pub unfit: Option<Ending>,
    pub steps: Option<StepsWatch>,
    pub shown: Option<State>,
    pub speed: Option<MmPerS>,
    pub setpoint: Option<MmPerS>,
}

impl ControlThread<'_> {
    /// Runs until something ends it, and then ends it in order.
    pub fn run(&mut self, sources: &Sources<'_>) -> Ending {
        let ending = self.until_ended(sources);
        self.give(Event::Stop);
        self.shut_down(sources);
        ending
    }

    /// Waits a little for robot and extruder to say that they rest.
    fn shut_down(&mut self, sources: &Sources<'_>) {
        let until = self.clock.now() + SHUTDOWN_TIMEOUT;
        let mut stopped = false;
        while !(stopped && self.extruder.as_ref().is_none_or(ExtruderWatch::rests)) {
            let left = until - self.clock.now();
            if left <= Span::ZERO {
                return;
            }
            select! {
                recv(sources.robot) -> message => {
                    let Ok(event) = message else { return };
                    stopped |= has_stopped(&event);
                    self.take_robot_event(event);
                }
                recv(sources.extruder) -> message => {
                    let Ok(event) = message else { return };
                    self.take_extruder_event(event);
                }
                default(duration(left)) => return,
            }
        }
    }

    /// Takes down what was seen until the camera ended, so that every frame in
    /// the recording has its event.
    pub fn take_rest(&mut self, seen: &Receiver<CameraMessage>) {
        for seen in seen.try_iter() {
            match seen {
                CameraMessage::Frame(look) => self.look(*look),
                CameraMessage::Unreadable { seq, at, reason } => self.unreadable(seq, at, &reason),
                CameraMessage::Ended(_) => {}
            }
        }
    }

    fn until_ended(&mut self, sources: &Sources<'_>) -> Ending {
        let mut due = self.clock.now() + self.period;
        let mut extruder_due = self.extruder.as_ref().map(|side| self.clock.now() + side.period());
        let over = self.duration.map(|duration| self.clock.now() + duration);
        let (mut seen, mut alarm, none) = (sources.seen.clone(), sources.alarm.clone(), never());
        let mut lost: Option<String> = None;
        loop {
            let now = self.clock.now();
            if over.is_some_and(|over| now >= over) {
                return Ending::TimeOver;
            }
            if self.steps.is_some_and(StepsWatch::is_over) {
                return Ending::StepsOver;
            }
            if now >= due {
                self.tick(due);
                due = next_due(due, self.period, self.clock.now());
                if let Some(why) = &lost
                    && matches!(self.shown, Some(State::Fault(_) | State::Idle))
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
                extruder_due = Some(next_due(at, period, self.clock.now()));
                continue;
            }
            let wait = [over, extruder_due].into_iter().flatten().fold(due, Stamp::min) - now;
            select! {
                recv(seen) -> message => match message {
                    Ok(CameraMessage::Frame(look)) => self.look(*look),
                    Ok(CameraMessage::Unreadable { seq, at, reason }) => self.unreadable(seq, at, &reason),
                    Ok(CameraMessage::Ended(None)) | Err(_) => return Ending::LastFrame,
                    Ok(CameraMessage::Ended(Some(reason))) => {
                        (self.notice)(&format!("camera lost: {reason}"));
                        self.give(Event::CameraLost { reason: reason.clone() });
                        lost = Some(reason);
                        seen = none.clone();
                    }
                },
                recv(sources.robot) -> message => {
                    if let Ok(event) = message { self.take_robot_event(event); }
                }
                recv(sources.extruder) -> message => {
                    if let Ok(event) = message { self.take_extruder_event(event); }
                }
                recv(alarm) -> message => {
                    if let Ok(error) = message {
                        self.runner.lose_recording(self.clock.now(), error.clone());
                        return Ending::RecordingLost(error.0);
                    }
                    alarm = never();
                }
                recv(sources.stop) -> _ => return Ending::Asked,
                default(duration(wait)) => {}
            }
            if let Some(ending) = self.unfit.take() {
                return ending;
            }
            if let Some(error) = self.runner.failure() {
                return Ending::RecordingLost(error.0.clone());
            }
        }
    }

    /// Hands an event to the runner and its answer to the log.
    fn give(&mut self, event: Event) -> Handled {
        let now = self.clock.now();
        let handled = self.runner.handle(now, &event);
        if let (Some(_), Some(Command::Speed(speed))) = (handled.sent, handled.step.command) {
            self.setpoint = Some(speed);
            self.logger.note(RunNote::SetpointSent);
        }
        if let Some(steps) = &mut self.steps {
            steps.see(&handled.step);
        }
        self.show(now, &handled.step);
        self.show_extruder(now, &handled.step);
        self.logger.step(now, event, handled.step.clone());
        handled
    }

    /// Tells the operator of a new state.
    fn show(&mut self, now: Stamp, step: &Step) {
        if self.shown.as_ref() == Some(&step.state) {
            return;
        }
        let words = match &step.state {
            State::Holding(why) => format!("holding: {}", names::in_words(names::of(why))),
            State::Fault(why) => format!("fault: {}", names::in_words(&names::fault(why))),
            state => state.name().to_owned(),
        };
        (self.notice)(&format!("{:8.2} s  {}", now.secs(), words));
        self.shown = Some(step.state.clone());
    }

    fn tick(&mut self, due: Stamp) {
        let handled = self.give(Event::Tick);
        let is_speed = matches!(handled.step.command, Some(Command::Speed(_)));
        let written = self.runner.robot_mut().written;
        match (handled.sent, written) {
            (Some(_), Some(written)) if is_speed => {
                for latency in self.latencies.sent(due, written.at) {
                    self.logger.latency(latency);
                }
            }
            _ => self.latencies.forget(),
        }
    }
}

/// Whether the robot says that it lays nothing any more.
fn has_stopped(event: &RobotEvent) -> bool {
    let RobotEvent::State { state, .. } = event else { return false };
    matches!(state.mode, RobotMode::Stop | RobotMode::Idle | RobotMode::Fault)
}

fn duration(span: Span) -> Duration {
    Duration::from_nanos(u64::try_from(span.ns()).unwrap_or(0))
}

/// The next time on the fixed grid; what was overslept is left out.
fn next_due(due: Stamp, period: Span, now: Stamp) -> Stamp {
    let mut next = due + period;
    while next <= now {
        next = next + period;
    }
    next
}
