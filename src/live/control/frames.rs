//! The frames' part of the control thread.

use super::{ControlThread, Inputs};
use crate::control::{Event, Step};
use crate::core::{Mm, Stamp};
use crate::live::capture::MeasuredFrame;
use crate::rows::frame_row::{ControlColumns, FrameRow};
use crate::rows::summary::RunNote;
use crate::run::ports::Recorder;
use crate::vision::Reject;

impl<I: Inputs, K: Recorder> ControlThread<'_, I, K> {
    /// Passes a measured or rejected frame to the controller, and logs the result.
    pub(super) fn take_measured(&mut self, measured: MeasuredFrame) {
        let event = event_of(&measured);
        let MeasuredFrame { frame, had_at, mut outcome, roughness, edges, .. } = measured;
        let (seq, captured_at) = (frame.seq, frame.captured_at);
        if outcome.is_ok() {
            self.setpoints.width_arrived(self.inputs.now());
        }
        let step = self.give(event).step;
        if step.trace.frame_repeated {
            outcome = Err(Reject::Repeated);
            self.journal.note(RunNote::FrameRepeated);
        }
        if step.trace.demand_mm_per_s.is_some() || step.trace.distance.is_some() {
            self.latencies.used(had_at, self.inputs.now());
        }
        let row = FrameRow {
            frame: seq,
            time_s: Some(captured_at.secs()),
            control: Some(self.columns(&step, outcome.as_ref().ok().map(|found| found.width))),
            outcome: outcome.map_err(|reject| reject.status()),
            roughness,
        };
        self.journal.frame(&row, Some((frame, edges.0, edges.1)));
    }

    /// Handles a frame that cannot be read.
    pub(super) fn unreadable(&mut self, seq: u64, at: Stamp, reason: &str) {
        tracing::warn!("frame {seq} is unreadable: {reason}");
        let status = Reject::Unreadable.status();
        let event = Event::Rejected { frame: seq, captured_at: at, reason: status.to_owned() };
        let step = self.give(event).step;
        let control = Some(self.columns(&step, None));
        let row = FrameRow {
            frame: seq,
            time_s: Some(at.secs()),
            outcome: Err(status),
            roughness: None,
            control,
        };
        self.journal.frame(&row, None);
    }

    fn columns(&self, step: &Step, width: Option<Mm>) -> ControlColumns {
        ControlColumns::of(step, width, self.speed, self.setpoint)
    }
}

/// What the controller is told of a frame.
fn event_of(measured: &MeasuredFrame) -> Event {
    let (frame, captured_at) = (measured.frame.seq, measured.frame.captured_at);
    match (&measured.outcome, measured.first_equal_at) {
        (Ok(found), Some(first_at)) => {
            let (width_mm, sigma_mm) = (found.width, found.sigma);
            Event::Repeated { frame, captured_at, first_at, width_mm, sigma_mm }
        }
        (Ok(found), None) => {
            Event::Measured { frame, captured_at, width_mm: found.width, sigma_mm: found.sigma }
        }
        (Err(reject), _) => {
            Event::Rejected { frame, captured_at, reason: reject.status().to_owned() }
        }
    }
}
