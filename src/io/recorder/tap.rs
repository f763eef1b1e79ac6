//! The input of the recorder for frames.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use crossbeam_channel::Sender;

use super::encode::FrameJob;
use super::state::RecorderState;
use crate::cell::file::KeepFrames;
use crate::core::Frame;

/// Passes frames to the recorder, from any thread.
#[derive(Clone)]
pub struct FrameTap {
    pub(super) keep: KeepFrames,
    pub(super) jobs: Sender<FrameJob>,
    pub(super) shared: Arc<RecorderState>,
}

impl FrameTap {
    /// Queues every n-th frame for the recording. It never waits; a frame that does not fit
    /// the queue is counted as dropped.
    pub fn frame(&self, frame: Arc<Frame>) {
        let wanted = match self.keep {
            KeepFrames::None => false,
            KeepFrames::Every(nth) => frame.seq.is_multiple_of(nth.max(1)),
        };
        if wanted && self.jobs.try_send(FrameJob::Encode(frame)).is_err() {
            self.shared.frames_dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}
