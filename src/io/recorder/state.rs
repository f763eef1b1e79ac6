//! Data that the recorder's threads share.

use std::sync::OnceLock;
use std::sync::atomic::AtomicU64;

use crossbeam_channel::Sender;

use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::run::ports::RecordError;

/// An event and the step in response, on the way to the writer.
pub(super) struct AnsweredEvent {
    pub(super) n: u64,
    pub(super) now: Stamp,
    pub(super) event: Event,
    pub(super) step: Step,
}

/// State that the recorder's threads share.
pub(super) struct RecorderState {
    failure: OnceLock<RecordError>,
    alarm: Sender<RecordError>,
    pub(super) frames_dropped: AtomicU64,
}

impl RecorderState {
    /// A state without failure; the first failure is sent to `alarm`.
    pub(super) fn new(alarm: Sender<RecordError>) -> Self {
        Self { failure: OnceLock::new(), alarm, frames_dropped: AtomicU64::new(0) }
    }

    /// Stores the first failure and reports it once; returns the first failure.
    pub(super) fn fail(&self, why: RecordError) -> RecordError {
        if self.failure.set(why.clone()).is_ok() {
            tracing::error!("recording ends here: {}", why.0);
            // The channel has room for one message, and only one is sent.
            self.alarm.try_send(why.clone()).unwrap_or_default();
        }
        self.failure().cloned().unwrap_or(why)
    }

    /// The first failure; `None` without a failure.
    pub(super) fn failure(&self) -> Option<&RecordError> {
        self.failure.get()
    }
}
