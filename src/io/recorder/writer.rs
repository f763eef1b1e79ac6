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

/// Inputs of the writer.
pub struct WriterInputs {
    /// Events with their steps; the recording ends when their sender is dropped.
    pub answered: Receiver<AnsweredEvent>,
    /// Encoded frames.
    pub frames: Receiver<EncodedFrame>,
}

/// State of the writing thread.
pub struct WriterThread<S> {
    pub mux: Mux,
    pub output: RetryingWriter<S>,
    pub shared: Arc<RecorderState>,
    pub tuning: RecorderLimits,
    /// Numbers that are certainly in the sink.
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

    /// After a failure frames are dropped: they would only make the queue of unwritten data
    /// longer.
    fn frame(&mut self, frame: &EncodedFrame) {
        if self.shared.failure().is_some() {
            self.shared.frames_dropped.fetch_add(1, Ordering::Relaxed);
            return;
        }
        let made = self.mux.frame(frame);
        self.check(made);
        self.push_ready();
    }

    /// Writes frames that were encoded but not written when the events ended; the encoder is
    /// closed.
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

    /// Writes the completed chunks. After a failure, tries again once per flush period.
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

    /// A complete recording gets its final name; an incomplete one keeps the name of a partial
    /// recording, and is ended as properly as the disk allows.
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

/// Events come first, so that frames cannot delay them.
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
