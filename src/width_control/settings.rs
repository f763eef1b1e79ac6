//! What a width controller is to do.

use std::sync::Arc;

use super::pi::PiGains;
use super::strategy::Strategy;
use super::target::WidthTarget;
use crate::core::time::Span;

/// What the width controller is to do.
#[derive(Debug, Clone)]
pub struct WidthControlSettings {
    /// Width that is asked for.
    pub target: WidthTarget,
    /// How it is held.
    pub strategy: Arc<dyn Strategy>,
    /// Gains of the PI law, on the error in millimetres; none where it is only
    /// fallen back to and the file gives none.
    pub gains: Option<PiGains>,
    /// Longest time between two widths over which the loop integrates; beyond
    /// it holds.
    pub max_gap: Span,
    /// Longest hold before the controller gives up and stops the robot.
    pub max_hold: Span,
}
