//! What the control thread waits for, behind a port: a live run has channels and a clock,
//! a test has a list.

use std::time::Duration;

use crossbeam_channel::{Receiver, never, select};

use crate::core::{Span, Stamp};
use crate::io::clock::RunClock;
use crate::live::capture::CameraMessage;
use crate::run::ports::{ExtruderEvent, RecordError, RobotEvent};

/// One thing that happened.
#[derive(Debug)]
pub enum LiveInput {
    /// The capture pipeline has something.
    Camera(CameraMessage),
    /// The capture pipeline has ended without a word.
    CameraGone,
    /// The robot reported.
    Robot(RobotEvent),
    /// The extruder reported.
    Extruder(ExtruderEvent),
    /// The link of a robot or an extruder has ended for good.
    DeviceGone,
    /// The recording cannot be continued.
    RecordingLost(RecordError),
    /// The run is to end.
    StopRequested,
}

/// Gives what happens, and the time.
pub trait Inputs {
    /// Time since the run began.
    fn now(&self) -> Stamp;

    /// Waits for what happens next, at most until a time; none at that time.
    fn next(&mut self, until: Stamp) -> Option<LiveInput>;

    /// Nothing of the camera is wanted any more.
    fn ignore_camera(&mut self);
}

/// The inputs of a live run.
pub struct LiveInputs {
    /// The clock of the run.
    pub clock: RunClock,
    /// From the capture pipeline.
    pub camera: Receiver<CameraMessage>,
    /// From the robot's driver.
    pub robot: Receiver<RobotEvent>,
    /// From the extruder's driver.
    pub extruder: Receiver<ExtruderEvent>,
    /// From the recorder.
    pub alarm: Receiver<RecordError>,
    /// From whoever ends the run.
    pub stop: Receiver<()>,
}

impl Inputs for LiveInputs {
    fn now(&self) -> Stamp {
        self.clock.now()
    }

    fn next(&mut self, until: Stamp) -> Option<LiveInput> {
        loop {
            let wait = (until - self.clock.now()).max(Span::ZERO);
            let wait = Duration::from_nanos(u64::try_from(wait.ns()).unwrap_or(0));
            select! {
                recv(self.camera) -> message => return Some(message.map_or_else(
                    |_| {
                        self.camera = never();
                        LiveInput::CameraGone
                    },
                    LiveInput::Camera,
                )),
                recv(self.robot) -> message => return Some(message.map_or_else(
                    |_| {
                        self.robot = never();
                        LiveInput::DeviceGone
                    },
                    LiveInput::Robot,
                )),
                recv(self.extruder) -> message => return Some(message.map_or_else(
                    |_| {
                        self.extruder = never();
                        LiveInput::DeviceGone
                    },
                    LiveInput::Extruder,
                )),
                recv(self.alarm) -> message => {
                    // A recorder whose sender is gone has nothing to complain about.
                    self.alarm = never();
                    if let Ok(error) = message {
                        return Some(LiveInput::RecordingLost(error));
                    }
                }
                recv(self.stop) -> _ => {
                    self.stop = never();
                    return Some(LiveInput::StopRequested);
                }
                default(wait) => return None,
            }
        }
    }

    fn ignore_camera(&mut self) {
        self.camera = never();
    }
}
