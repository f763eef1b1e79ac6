//! When a run for a sequence of steps ends.

use crate::control::{State, Step};
use crate::width_control::steps::StepsProgress;

/// Watches a sequence of steps.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepsWatch {
    has_begun: bool,
    is_over: bool,
}

impl StepsWatch {
    /// Updates with a step of the controller. The sequence is over when the camera has seen its
    /// last segment, or when the bead ends or the controller gives up after the sequence has
    /// begun.
    pub fn see(&mut self, step: &Step) {
        let progress = step.trace.steps.map(|steps| steps.progress);
        self.has_begun |= progress.is_some();
        let ends = matches!(step.state, State::Idle | State::Fault(_));
        self.is_over |= progress == Some(StepsProgress::Over) || self.has_begun && ends;
    }

    /// Whether the sequence is over.
    pub fn is_over(self) -> bool {
        self.is_over
    }
}
