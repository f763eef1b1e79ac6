//! The control thread's ports to the devices of a rehearsed run.

use super::world::{SharedWorld, lock};
use crate::control::Command;
use crate::core::Stamp;
use crate::extruder::ExtruderCommand;
use crate::run::ports::{ExtruderPort, RobotPort, SendError, Sent};

/// The port to the robot.
pub struct ToRobot(pub SharedWorld);

impl RobotPort for ToRobot {
    fn send(&mut self, now: Stamp, command: Command) -> Result<Sent, SendError> {
        let mut world = lock(&self.0);
        let world = &mut *world;
        let (sent, refusal) = world.robot.take(now, command, &world.faults);
        world.arrivals.robot(now, refusal);
        sent
    }
}

/// The port to the extruder.
pub struct ToExtruder(pub SharedWorld);

impl ExtruderPort for ToExtruder {
    fn send(&mut self, now: Stamp, command: ExtruderCommand) -> Result<Sent, SendError> {
        let mut world = lock(&self.0);
        let world = &mut *world;
        let Some(extruder) = &mut world.extruder else {
            return Err(SendError::NotConnected { device: "extruder" });
        };
        let (sent, refusal) = extruder.take(now, command, &world.faults);
        world.arrivals.extruder(now, refusal);
        sent
    }
}
