//! The log of a rehearsed run: its events and steps.

use std::cell::RefCell;

use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::live::journal::{FrameWithEdges, Journal};
use crate::live::latency::Latency;
use crate::rows::frame_row::FrameRow;
use crate::rows::summary::RunNote;

/// Keeps events and steps.
#[derive(Debug, Default)]
pub struct Log {
    steps: RefCell<Vec<(Stamp, Event, Step)>>,
}

impl Log {
    /// What was kept, in order.
    pub fn into_steps(self) -> Vec<(Stamp, Event, Step)> {
        self.steps.into_inner()
    }
}

impl Journal for Log {
    fn frame(&self, _: &FrameRow, _: Option<FrameWithEdges>) {}

    fn step(&self, now: Stamp, event: Event, step: Step) {
        self.steps.borrow_mut().push((now, event, step));
    }

    fn latency(&self, _: Latency) {}

    fn note(&self, _: RunNote) {}
}
