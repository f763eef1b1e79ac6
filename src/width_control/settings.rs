//! What a width controller is to do.

use super::pi::PiGains;
use super::target::Target;
use crate::core::time::Span;

/// How the width is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WidthLaw {
    /// Proportional-integral, on the width that is seen.
    Pi,
    /// By distance, with the PI law to fall back to.
    Distance(Exponent),
    /// Not at all: the speed goes through a course of steps, each by this share of
    /// the start speed.
    Steps(f64),
}

/// What the law by distance is told of the bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponent {
    /// b in w = A·(v/v₀)^−b.
    pub value: f64,
    /// Whether it is learnt from the data.
    pub learns: bool,
    /// How far the flow wanders along a metre, as a share.
    pub drift_per_root_m: f64,
}

/// What the width controller is to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// Width that is asked for.
    pub target: Target,
    /// How it is held.
    pub law: WidthLaw,
    /// Gains of the PI law, on the error in millimetres; none where it is only
    /// fallen back to and the file gives none.
    pub gains: Option<PiGains>,
    /// Longest time between two widths over which the loop integrates; beyond
    /// it holds.
    pub max_gap: Span,
    /// Longest hold before the controller gives up and stops the robot.
    pub max_hold: Span,
}
