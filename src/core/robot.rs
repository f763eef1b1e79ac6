//! What a robot reports, whatever the link.

use serde::{Deserialize, Serialize};

use crate::core::time::Span;
use crate::core::units::{Mm, MmPerS};

/// Longest time without a report: after this time a link counts as lost
/// (`docs/src/reference/robot-link.md`, § Connections).
pub const MAX_SILENCE: Span = Span::from_millis(500);

/// Mode of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum RobotMode {
    /// Not printing.
    Idle,
    /// Laying bead.
    Print,
    /// Laying bead at its own hold speed, because no setpoint is valid.
    Hold,
    /// Stopped by command, or because it got no setpoints.
    Stop,
    /// Stopped by a fault of its own.
    Fault,
}

impl RobotMode {
    /// Whether bead is laid.
    pub fn lays_bead(self) -> bool {
        matches!(self, Self::Print | Self::Hold)
    }

    /// The first mode after a bead: idle where the bead was laid to its end. `None` without a bead, or
    /// before its end.
    pub fn after_bead(modes: impl IntoIterator<Item = Self>) -> Option<Self> {
        modes.into_iter().skip_while(|mode| !mode.lays_bead()).find(|mode| !mode.lays_bead())
    }
}

/// One report of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobotState {
    /// Time of the report on the robot's own clock \[ms\]; none where it has no clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot_time_ms: Option<u64>,
    /// Whether it has applied a setpoint on this connection.
    pub has_setpoint: bool,
    /// Its mode.
    pub mode: RobotMode,
    /// Speed along the path.
    pub speed_mm_per_s: MmPerS,
    /// Path of the nozzle.
    pub path_mm: Mm,
    /// Height of the nozzle in the robot's frame.
    pub z_mm: Mm,
}

/// Name and speeds of a robot, which it reports when the link comes up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotLimits {
    /// Its name.
    pub name: String,
    /// Slowest setpoint that it accepts.
    pub min_mm_per_s: MmPerS,
    /// Fastest setpoint that it accepts.
    pub max_mm_per_s: MmPerS,
    /// Speed at which it moves when its setpoint has expired.
    pub hold_mm_per_s: MmPerS,
}
