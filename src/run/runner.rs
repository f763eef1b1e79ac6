//! Drives a controller with its robot, extruder and recorder. Every event of a live or simulated
//! cell passes through here.

use super::ports::{ExtruderPort, NoExtruder, RecordError, Recorder, RobotPort, SendError, Sent};
use crate::control::{Controller, Event, Step};
use crate::core::Stamp;

/// A controller with its robot, its recorder and its extruder.
#[derive(Debug)]
pub struct Runner<R, K, X = NoExtruder> {
    controller: Controller,
    robot: R,
    extruder: X,
    recorder: K,
    failure: Option<RecordError>,
}

/// The result of an event.
#[derive(Debug, Clone, PartialEq)]
pub struct Handled {
    /// The controller's answer.
    pub step: Step,
    /// Whether the command to the robot was sent, if there was one.
    pub robot: Option<Result<Sent, SendError>>,
    /// Whether the command to the extruder was sent, if there was one.
    pub extruder: Option<Result<Sent, SendError>>,
}

impl<R: RobotPort, K: Recorder> Runner<R, K> {}

impl<R: RobotPort, K: Recorder, X: ExtruderPort> Runner<R, K, X> {
    /// A runner before the first event.
    pub fn with_extruder(controller: Controller, robot: R, extruder: X, recorder: K) -> Self {
        Self { controller, robot, extruder, recorder, failure: None }
    }

    /// Answers an event: step, send, record, in this order, so that no command waits for the disk.
    /// Where both sides get a command, as at the end of a run, the extruder gets it first: a robot
    /// that stops under a running pump is worse than the other way round. After an event that could
    /// not be recorded, control ends in a hold.
    pub fn handle(&mut self, now: Stamp, event: &Event) -> Handled {
        let step = self.controller.step(now, event);
        let command = step.extruder.and_then(|extruder| extruder.command);
        let extruder = command.map(|command| self.extruder.send(now, command));
        let robot = step.command.map(|command| self.robot.send(now, command));
        if self.failure.is_none()
            && let Err(error) = self.recorder.record(now, event, &step)
        {
            self.lose_recording(now, error);
        }
        Handled { step, robot, extruder }
    }

    /// Makes the controller hold because the recording is lost.
    pub fn lose_recording(&mut self, now: Stamp, error: RecordError) {
        if self.failure.is_none() {
            self.failure = Some(error);
            let _ = self.controller.step(now, &Event::RecordingLost);
        }
    }

    /// Why the recording was lost, if it was.
    pub fn failure(&self) -> Option<&RecordError> {
        self.failure.as_ref()
    }

    /// The robot.
    pub fn robot_mut(&mut self) -> &mut R {
        &mut self.robot
    }

    /// The extruder.
    pub fn extruder_mut(&mut self) -> &mut X {
        &mut self.extruder
    }

    /// Controller, robot and recorder, at the end of a run.
    pub fn into_parts(self) -> (Controller, R, K) {
        (self.controller, self.robot, self.recorder)
    }
}

/// Records nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoRecorder;

impl Recorder for NoRecorder {
    fn record(&mut self, _: Stamp, _: &Event, _: &Step) -> Result<(), RecordError> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::{Command, Hold, State};

    struct NoRobot;

    impl RobotPort for NoRobot {
        fn send(&mut self, _: Stamp, _: Command) -> Result<Sent, SendError> {
            Err(SendError::NotConnected { device: "robot" })
        }
    }

    struct FullDisk {
        room: usize,
    }

    impl Recorder for FullDisk {
        fn record(&mut self, _: Stamp, _: &Event, _: &Step) -> Result<(), RecordError> {
            self.room = self.room.checked_sub(1).ok_or(RecordError("disk full".into()))?;
            Ok(())
        }
    }

    #[test]
    fn control_ends_in_hold_when_the_disk_is_full() {
        let controller = Controller::new(crate::control::example_setup());
        let mut runner =
            Runner::with_extruder(controller, NoRobot, NoExtruder, FullDisk { room: 2 });
        for _ in 0..3 {
            assert_eq!(runner.handle(Stamp::START, &Event::Tick).step.state, State::Idle);
        }
        assert_eq!(runner.failure(), Some(&RecordError("disk full".into())));
        let after = runner.handle(Stamp::START, &Event::Tick);
        assert_eq!(after.step.state, State::Holding(Hold::RecordingLost));
    }
}
