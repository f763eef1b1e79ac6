//! The thread that writes a recording.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, never, select_biased};

use super::config::Tuning;
use super::encode::EncodedFrame;
use super::mux::{Mux, MuxError};
use super::report::{Counts, RecordReport};
use super::shared::{Answered, Shared};
use super::sink::{Outlet, Sink};
use crate::run::ports::RecordError;

/// What the writer listens to.
pub struct Inputs {
    /// Events with their steps; the end of them is the end of the recording.
    pub answered: Receiver<Answered>,
    /// Frames that have been encoded.
    pub frames: Receiver<EncodedFrame>,
}

/// Everything that the writing thread owns.
pub struct WriterThread<S> {
    pub mux: Mux,
    pub outlet: Outlet<S>,
    pub shared: Arc<Shared>,
    pub tuning: Tuning,
    /// What is in the sink for certain.
    pub safe: Counts,
}

enum Turn {
    Answered(Box<Answered>),
    Frame(EncodedFrame),
    FramesEnded,
    Ended,
    Nothing,
}

impl<S: Sink> WriterThread<S> {
    /// Writes until the events end, then ends the recording.
    pub fn run(mut self, inputs: Inputs) -> RecordReport {
        let Inputs { answered, mut frames } = inputs;
        let mut frames_ended = false;
        let mut due = now() + self.tuning.flush_every;
        loop {
            let left = due.saturating_duration_since(now());
            if left.is_zero() {
                self.flush();
                due = now() + self.tuning.flush_every;
                continue;
            }
            match next_turn(&answered, &frames, left) {
                Turn::Answered(item) => self.answered(&item),
                Turn::Frame(frame) => self.frame(&frame),
                Turn::FramesEnded => {
                    frames_ended = true;
                    frames = never();
                }
                Turn::Ended => break,
                Turn::Nothing => {}
            }
        }
        if !frames_ended {
            self.late_frames(&frames);
        }
        self.finish()
    }

    fn answered(&mut self, item: &Answered) {
        let made = self.mux.answered(item);
        self.check(made);
        self.push_ready();
    }

    /// After a failure frames are not worth the memory that they would wait
    /// in.
    fn frame(&mut self, frame: &EncodedFrame) {
        if self.shared.failure().is_some() {
            self.shared.frames_dropped.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let made = self.mux.frame(frame);
        self.check(made);
        self.push_ready();
    }

    /// Frames that were encoded but not written when the events ended; the
    /// encoder has been told to close.
    fn late_frames(&mut self, frames: &Receiver<EncodedFrame>) {
        loop {
            match frames.recv_timeout(self.tuning.flush_every) {
                Ok(frame) => self.frame(&frame),
                Err(RecvTimeoutError::Timeout) => self.flush(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn flush(&mut self) {
        let flushed = self.mux.flush();
        self.check(flushed);
        self.push();
    }

    /// Writes the chunks that are complete. After a failure the flush period
    /// sets the pace of further tries.
    fn push_ready(&mut self) {
        self.mux.take(self.outlet.waiting());
        if self.shared.failure().is_none() && !self.outlet.waiting().is_empty() {
            self.push();
        }
    }

    fn push(&mut self) {
        self.mux.take(self.outlet.waiting());
        match self.outlet.push() {
            Ok(()) => self.safe = self.mux.complete(),
            Err(error) => self.fail("write", &error),
        }
    }

    fn fail(&mut self, what: &str, error: &io::Error) {
        let path = self.outlet.sink().path().display().to_string();
        self.shared.fail(RecordError(format!("cannot {what} {path}: {error}")));
    }

    fn check(&mut self, made: Result<(), MuxError>) {
        if let Err(error) = made {
            self.shared.fail(RecordError(error.to_string()));
        }
    }

    /// A recording that misses nothing gets its final name; one that does
    /// keeps the name of a partial one, with as proper an end as the disk
    /// allows.
    fn finish(mut self) -> RecordReport {
        let finished = self.mux.finish();
        self.check(finished);
        self.push();
        if self.shared.failure().is_none()
            && let Err(error) = self.outlet.sink().publish()
        {
            self.fail("give its final name to", &error);
        }
        RecordReport {
            events: self.safe.events,
            steps: self.safe.steps,
            frames_kept: self.safe.frames,
            frames_dropped: self.shared.frames_dropped.load(Ordering::Relaxed),
            bytes: self.outlet.written(),
            path: self.outlet.sink().path().to_path_buf(),
        }
    }
}

/// Events go first, so that frames cannot hold them up.
fn next_turn(
    answered: &Receiver<Answered>,
    frames: &Receiver<EncodedFrame>,
    wait: Duration,
) -> Turn {
    select_biased! {
        recv(answered) -> item => {
            item.map_or(Turn::Ended, |item| Turn::Answered(Box::new(item)))
        },
        recv(frames) -> frame => frame.map_or(Turn::FramesEnded, Turn::Frame),
        default(wait) => Turn::Nothing,
    }
}

#[expect(clippy::disallowed_methods, reason = "the recorder flushes by the clock")]
fn now() -> Instant {
    Instant::now()
}
