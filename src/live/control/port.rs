//! The link to the robot as the runner's port.

use crate::control::step::Command;
use crate::core::time::Stamp;
use crate::drivers::robot::{LinkClient, Written};
use crate::run::ports::RobotPort;

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
