//! The thread that writes a recording.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, never, select_biased};

use super::config::RecorderLimits;
use super::encode::EncodedFrame;
use super::mux::{Mux, MuxError};
use super::report::{Counts, RecordReport};
use super::sink::{RetryingWriter, Sink};
use super::state::{AnsweredEvent, RecorderState};
use crate::run::ports::RecordError;

/// What the writer listens to.
pub struct WriterInputs {
    /// Events with their steps; the end of them is the end of the recording.
    pub answered: Receiver<AnsweredEvent>,
    /// Frames that have been encoded.
    pub frames: Receiver<EncodedFrame>,
}

/// Everything that the writing thread owns.
pub struct WriterThread<S> {
    pub mux: Mux,
    pub output: RetryingWriter<S>,
    pub shared: Arc<RecorderState>,
    pub tuning: RecorderLimits,
    /// What is in the sink for certain.
    pub written: Counts,
}

enum NextInput {
    Answered(Box<AnsweredEvent>),
    Frame(EncodedFrame),
    FramesEnded,
    Ended,
    Nothing,
}

impl<S: Sink> WriterThread<S> {
    /// Writes until the events end, then ends the recording.
    pub fn run(mut self, inputs: WriterInputs) -> RecordReport {
        let WriterInputs { answered, mut frames } = inputs;
        let mut frames_ended = false;
        let mut due = now() + self.tuning.flush_every;
        loop {
            let left = due.saturating_duration_since(now());
            if left.is_zero() {
                self.flush();
                due = now() + self.tuning.flush_every;
                continue;
            }
            match next_input(&answered, &frames, left) {
                NextInput::Answered(item) => self.answered(&item),
                NextInput::Frame(frame) => self.frame(&frame),
                NextInput::FramesEnded => {
                    frames_ended = true;
                    frames = never();
                }
                NextInput::Ended => break,
                NextInput::Nothing => {}
            }
        }
        if !frames_ended {
            self.late_frames(&frames);
        }
        self.finish()
    }

    fn answered(&mut self, item: &AnsweredEvent) {
        let made = self.mux.answered(item);
        self.check(made);
        self.push_ready();
    }

    /// After a failure frames are not worth the length of the history that they would wait
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
    /// encoder is closed.
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
    /// sets the rate of further tries.
    fn push_ready(&mut self) {
        self.mux.take(self.output.waiting());
        if self.shared.failure().is_none() && !self.output.waiting().is_empty() {
            self.push();
        }
    }

    fn push(&mut self) {
        self.mux.take(self.output.waiting());
        match self.output.push() {
            Ok(()) => self.written = self.mux.complete(),
            Err(error) => self.fail("write", &error),
        }
    }

    fn fail(&mut self, what: &str, error: &io::Error) {
        let path = self.output.sink().path().display().to_string();
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
            && let Err(error) = self.output.sink().publish()
        {
            self.fail("give its final name to", &error);
        }
        RecordReport {
            events: self.written.events,
            steps: self.written.steps,
            frames_kept: self.written.frames,
            frames_dropped: self.shared.frames_dropped.load(Ordering::Relaxed),
            bytes: self.output.written(),
            path: self.output.sink().path().to_path_buf(),
        }
    }
}

/// Events go first, so that frames cannot hold them up.
fn next_input(
    answered: &Receiver<AnsweredEvent>,
    frames: &Receiver<EncodedFrame>,
    wait: Duration,
) -> NextInput {
    select_biased! {
        recv(answered) -> item => {
            item.map_or(NextInput::Ended, |item| NextInput::Answered(Box::new(item)))
        },
        recv(frames) -> frame => frame.map_or(NextInput::FramesEnded, NextInput::Frame),
        default(wait) => NextInput::Nothing,
    }
}

#[expect(clippy::disallowed_methods, reason = "the recorder flushes by the clock")]
fn now() -> Instant {
    Instant::now()
}
