//! The robot's part of the control thread: its link as the runner's port, and
//! what it reports.

use std::sync::atomic::Ordering;

use super::{Ending, Loop};
use crate::control::step::Command;
use crate::core::robot::RobotLimits;
use crate::core::time::Stamp;
use crate::drivers::robot::{LinkClient, RobotEvent, Written};
use crate::run::ports::RobotPort;
use crate::width_control::limiter::Limits;

/// The link as the runner's robot, which remembers when it last wrote.
pub struct LinkPort {
    client: LinkClient,
    pub(super) written: Option<Written>,
}

impl LinkPort {
    /// Over a link.
    pub fn new(client: LinkClient) -> Self {
        Self { client, written: None }
    }

    /// Says good-bye.
    pub fn close(self) {
        self.client.close();
    }
}

impl RobotPort for LinkPort {
    fn send(&mut self, _now: Stamp, command: Command) -> Option<u64> {
        self.written = self
            .client
            .send(command)
            .inspect_err(|reason| tracing::debug!(%reason, ?command, "not sent to the robot"))
            .ok();
        self.written.map(|written| written.seq)
    }
}

impl Loop<'_> {
    /// Hands the controller what the robot reports.
    pub(super) fn hear_robot(&mut self, event: RobotEvent) {
        match &event {
            RobotEvent::State { at, state } => {
                self.robot_z.store(state.z_mm.get().to_bits(), Ordering::Relaxed);
                self.speed = Some(state.speed_mm_per_s);
                if let Some(view) = &self.robot_view {
                    view.observe(*at, state);
                }
            }
            RobotEvent::Up { hello: robot, .. } => {
                (self.notice)(&format!("robot `{}` is connected", robot.name));
                self.unfit = unfit(&self.limits, robot).map(Ending::RobotLimits);
            }
            RobotEvent::Down { reason, .. } => (self.notice)(&format!("robot: {reason}")),
            RobotEvent::Refused { seq, code, text, .. } => {
                (self.notice)(&format!("robot refused line {seq}: {} {text}", code.word()));
            }
        }
        let (_, event) = event.into_event();
        self.give(event);
    }
}

/// Why a robot cannot be driven with a cell's limits, if it cannot.
fn unfit(limits: &Limits, robot: &RobotLimits) -> Option<String> {
    let fits = robot.min_mm_per_s <= limits.min_speed && limits.max_speed <= robot.max_mm_per_s;
    (!fits).then(|| {
        format!(
            "robot `{}` takes {} to {}, the cell's [limits] are {} to {}; make them lie within \
             the robot's",
            robot.name, robot.min_mm_per_s, robot.max_mm_per_s, limits.min_speed, limits.max_speed
        )
    })
}
