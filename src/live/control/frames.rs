//! The frames' part of the control thread.

use super::super::eye::Look;
use super::Loop;
use crate::control::{Event, Step};
use crate::offline::{ControlColumns, FrameRow};
use crate::time::Stamp;
use crate::vision::Reject;

impl Loop<'_> {
    /// A frame that was looked at: the event, its answer and the log's row.
    pub(super) fn look(&mut self, look: Look) {
        let Look { frame, had_at, outcome, edges } = look;
        let (seq, captured_at) = (frame.seq, frame.captured_at);
        let event = match &outcome {
            Ok(measured) => Event::Measured {
                frame: seq,
                captured_at,
                width_mm: measured.width,
                sigma_mm: measured.sigma,
            },
            Err(reject) => {
                Event::Rejected { frame: seq, captured_at, reason: reject.status().to_owned() }
            }
        };
        let step = self.give(event).step;
        if step.trace.demand_mm_per_s.is_some() {
            self.latencies.used(had_at, self.clock.now());
        }
        let row = FrameRow {
            frame: seq,
            time_s: Some(captured_at.secs()),
            outcome: outcome.map_err(|reject| reject.status()),
            control: Some(self.columns(&step)),
        };
        self.scribe.frame(row, Some((frame, edges.0, edges.1)));
    }

    /// A frame that cannot be read.
    pub(super) fn unreadable(&mut self, seq: u64, at: Stamp, reason: &str) {
        tracing::warn!("frame {seq} is unreadable: {reason}");
        let status = Reject::Unreadable.status();
        let event = Event::Rejected { frame: seq, captured_at: at, reason: status.to_owned() };
        let step = self.give(event).step;
        let control = Some(self.columns(&step));
        let row = FrameRow { frame: seq, time_s: Some(at.secs()), outcome: Err(status), control };
        self.scribe.frame(row, None);
    }

    fn columns(&self, step: &Step) -> ControlColumns {
        ControlColumns {
            bead_path: step.trace.bead_path_mm,
            bead_expected: step.trace.bead_expected,
            nozzle_path: step.trace.nozzle_path_mm,
            speed: self.speed,
            setpoint: self.setpoint,
            state: step.state.name(),
            limit: step.trace.limit,
        }
    }
}
