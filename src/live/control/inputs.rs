//! The inputs of the control thread, behind a trait: channels and a clock in a live run, a list in
//! a test.

use crossbeam_channel::{Receiver, never, select};

use crate::core::Stamp;
use crate::io::clock::RunClock;
use crate::live::capture::CameraMessage;
use crate::run::ports::{ExtruderEvent, RecordError, RobotEvent};

/// One input of the control thread.
#[derive(Debug)]
pub enum LiveInput {
    /// A message from the capture pipeline.
    Camera(CameraMessage),
    /// The capture pipeline has ended without a message.
    CameraGone,
    /// A report of the robot.
    Robot(RobotEvent),
    /// A report of the extruder.
    Extruder(ExtruderEvent),
    /// The link of a robot or an extruder has ended for good.
    DeviceGone,
    /// The recording cannot be continued.
    RecordingLost(RecordError),
    /// The run should end.
    StopRequested,
}

/// A source of inputs and of the time.
pub trait Inputs {
    /// Time since the run began.
    fn now(&self) -> Stamp;

    /// Waits for the next input, at most until a time; `None` at that time.
    fn next(&mut self, until: Stamp) -> Option<LiveInput>;

    /// Ignores the camera from now on.
    fn ignore_camera(&mut self);
}

/// The inputs of a live run.
pub struct LiveInputs {
    /// The clock of the run.
    pub clock: RunClock,
    /// Messages from the capture pipeline.
    pub camera: Receiver<CameraMessage>,
    /// Reports from the robot's driver.
    pub robot: Receiver<RobotEvent>,
    /// Reports from the extruder's driver.
    pub extruder: Receiver<ExtruderEvent>,
    /// Errors from the recorder.
    pub alarm: Receiver<RecordError>,
    /// A message ends the run.
    pub stop: Receiver<()>,
}

impl Inputs for LiveInputs {
    fn now(&self) -> Stamp {
        self.clock.now()
    }

    fn next(&mut self, until: Stamp) -> Option<LiveInput> {
        loop {
            let wait = (until - self.clock.now()).wait();
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
                    // A recorder whose sender is gone has no error to report.
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
