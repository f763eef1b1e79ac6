//! The simulated robot as a port of the runner: the robot's state machine in the same process. It
//! gets the lines of the link without a socket.

use crate::control::Command;
use crate::core::{Mm, RobotLimits, RobotMode, RobotState, Stamp};
use crate::link::{PcLine, RobotLine, VirtualRobot};
use crate::run::ports::{RobotPort, SendError, Sent};

/// A robot in the same process.
#[derive(Debug)]
pub struct SimPort {
    cell: VirtualRobot,
    seq: u64,
    valid_ms: u64,
}

impl SimPort {
    /// A robot whose setpoints are valid for `valid_ms`.
    pub fn new(cell: VirtualRobot, valid_ms: u32) -> Self {
        Self { cell, seq: 0, valid_ms: u64::from(valid_ms) }
    }

    /// Connects and completes the handshake; returns the robot's limits.
    pub fn connect(&mut self, now: Stamp) -> RobotLimits {
        self.cell.connect(now);
        let _ = self.cell.take(now, PcLine::Hello);
        self.cell.limits()
    }

    /// Begins a bead; returns the state at its start.
    pub fn begin(&mut self, now: Stamp, z: Mm) -> RobotState {
        self.cell.acknowledge(now);
        self.cell.begin_bead(now, z);
        self.cell.state(now).into()
    }

    /// The robot's state.
    pub fn state(&mut self, now: Stamp) -> RobotState {
        self.cell.state(now).into()
    }
}

impl RobotPort for SimPort {
    fn send(&mut self, now: Stamp, command: Command) -> Result<Sent, SendError> {
        let state = self.cell.state(now);
        let seq = self.seq + 1;
        let line = match command {
            Command::Speed(speed) => {
                if !matches!(state.mode, RobotMode::Print | RobotMode::Hold) {
                    return Err(SendError::NotPrinting { mode: state.mode });
                }
                PcLine::Speed { seq, speed, valid_ms: self.valid_ms, ref_t_ms: state.t_ms }
            }
            Command::Stop => PcLine::Stop { seq },
        };
        self.seq = seq;
        match self.cell.take(now, line) {
            Some(RobotLine::Err { text, .. }) => Err(SendError::Refused { device: "robot", text }),
            _ => Ok(Sent { at: now }),
        }
    }
}
