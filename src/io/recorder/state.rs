//! Data that the threads of a recorder have in common.

use std::sync::OnceLock;
use std::sync::atomic::AtomicU64;

use crossbeam_channel::Sender;

use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::run::ports::RecordError;

/// An event and its answer, on the way to the writer.
pub(super) struct AnsweredEvent {
    pub(super) n: u64,
    pub(super) now: Stamp,
    pub(super) event: Event,
    pub(super) step: Step,
}

/// What the threads know in common.
pub(super) struct RecorderState {
    failure: OnceLock<RecordError>,
    alarm: Sender<RecordError>,
    pub(super) frames_dropped: AtomicU64,
}

impl RecorderState {
    /// Nothing has failed yet; the first failure goes to `alarm`.
    pub(super) fn new(alarm: Sender<RecordError>) -> Self {
        Self { failure: OnceLock::new(), alarm, frames_dropped: AtomicU64::new(0) }
    }

    /// Only the first failure counts; it is reported once and returned.
    pub(super) fn fail(&self, why: RecordError) -> RecordError {
        if self.failure.set(why.clone()).is_ok() {
            tracing::error!("recording ends here: {}", why.0);
            // The channel holds one, and there is only one.
            self.alarm.try_send(why.clone()).unwrap_or_default();
        }
        self.failure().cloned().unwrap_or(why)
    }

    /// The first failure, if there was one.
    pub(super) fn failure(&self) -> Option<&RecordError> {
        self.failure.get()
    }
}
