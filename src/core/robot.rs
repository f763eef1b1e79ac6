//! What a robot reports of itself.

use serde::{Deserialize, Serialize};

use crate::core::units::{Mm, MmPerS};

/// What the robot does, in the words of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum RobotMode {
    /// Not printing.
    Idle,
    /// Laying bead.
    Print,
    /// Laying bead at its own hold speed, because no setpoint is valid.
    Hold,
    /// Stopped by command or for want of setpoints.
    Stop,
    /// Stopped by a fault of its own.
    Fault,
}

impl RobotMode {
    /// Whether bead is laid.
    pub fn lays_bead(self) -> bool {
        matches!(self, Self::Print | Self::Hold)
    }
}

/// One `STATE` of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// The robot's own clock \[ms\].
    pub t_ms: u64,
    /// Last setpoint that it applied on this connection; 0 is none.
    pub seq: u64,
    /// What it does.
    pub mode: RobotMode,
    /// Speed along the path.
    pub speed_mm_per_s: MmPerS,
    /// Distance of the nozzle along the path.
    pub path_mm: Mm,
    /// Height of the nozzle in the robot's frame.
    pub z_mm: Mm,
}

/// What the robot says of itself when the link comes up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotLimits {
    /// Its name.
    pub name: String,
    /// Slowest setpoint that it takes.
    pub min_mm_per_s: MmPerS,
    /// Fastest setpoint that it takes.
    pub max_mm_per_s: MmPerS,
    /// Speed to which it goes when setpoints run out.
    pub hold_mm_per_s: MmPerS,
}
