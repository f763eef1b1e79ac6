//! Conditions of the bead between a start and a stop.

use crate::core::{Mm3PerS, MmPerS, Span};

/// Conditions of a bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadConditions {
    /// Flow that the bead needs at the robot's start speed.
    pub flow: Mm3PerS,
    /// The robot's start speed.
    pub speed: MmPerS,
    /// Smallest speed ratio at which the robot may follow the flow, above 0 to 1; 1 for a robot that
    /// keeps its speed.
    pub min_speed_ratio: f64,
    /// Lag of the robot behind its setpoint; setpoints are sent earlier by it.
    pub robot_lag: Span,
}
