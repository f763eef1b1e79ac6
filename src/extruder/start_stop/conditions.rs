//! The bead between a start and a stop.

use crate::core::time::Span;
use crate::core::units::{Mm3PerS, MmPerS};

/// What is laid between a start and a stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadConditions {
    /// Flow that the bead needs at the robot's start speed.
    pub flow: Mm3PerS,
    /// The robot's start speed.
    pub speed: MmPerS,
    /// Share of that speed, above 0 to 1, down to which the robot may follow the
    /// flow; 1 for a robot that keeps its speed.
    pub min_speed_ratio: f64,
    /// How late the robot follows a speed that it is told; it is told so much
    /// earlier.
    pub robot_lag: Span,
}
