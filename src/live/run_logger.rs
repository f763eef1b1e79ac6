//! Writes the log of a live run in a thread of its own, so that neither the
//! disk nor the images for the report delay control.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle};

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::journal::{FrameWithEdges, Journal};
use super::latency::Latency;
use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::rows::frame_row::FrameRow;
use crate::rows::log::RunLog;
use crate::rows::output::LogError;
use crate::rows::summary::{RunNote, Summary};
use crate::vision::Edges;

/// Images that may wait for the log; beyond this, rows are written without images.
const MAX_WAITING_IMAGES: usize = 16;

enum Fact {
    Frame { row: FrameRow, image: Option<FrameWithEdges> },
    Step { now: Stamp, event: Event, step: Step },
    Latency(Latency),
    Note(RunNote),
}

/// The thread that writes the log.
pub struct RunLogger {
    facts: Sender<Fact>,
    /// Number of images that wait to be written.
    waiting: Arc<AtomicUsize>,
    thread: JoinHandle<Result<Summary, LogError>>,
}

impl RunLogger {
    /// Starts the thread.
    pub fn start(log: RunLog) -> std::io::Result<Self> {
        let (facts, written) = unbounded();
        let waiting = Arc::new(AtomicUsize::new(0));
        let waiting_images = Arc::clone(&waiting);
        let write = move || write_all(log, &written, &waiting_images);
        let thread = Builder::new().name("log".to_owned()).spawn(write)?;
        Ok(Self { facts, waiting, thread })
    }

    /// Sends a fact to the thread. If the thread has failed, [`Self::finish`] returns its error.
    fn keep(&self, fact: Fact) {
        let _ = self.facts.send(fact);
    }

    /// Finishes the files; returns the summary of the run.
    pub fn finish(self) -> Result<Summary, LogError> {
        drop(self.facts);
        self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl Journal for RunLogger {
    fn frame(&self, row: &FrameRow, image: Option<FrameWithEdges>) {
        let room = self.waiting.load(Ordering::Relaxed) < MAX_WAITING_IMAGES;
        let image = image.filter(|_| room);
        if image.is_some() {
            self.waiting.fetch_add(1, Ordering::Relaxed);
        }
        self.keep(Fact::Frame { row: *row, image });
    }

    fn step(&self, now: Stamp, event: Event, step: Step) {
        self.keep(Fact::Step { now, event, step });
    }

    fn latency(&self, latency: Latency) {
        self.keep(Fact::Latency(latency));
    }

    fn note(&self, note: RunNote) {
        self.keep(Fact::Note(note));
    }
}

fn write_all(
    mut log: RunLog,
    facts: &Receiver<Fact>,
    waiting: &AtomicUsize,
) -> Result<Summary, LogError> {
    for fact in facts {
        match fact {
            Fact::Frame { row, image: Some((frame, left, right)) } => {
                waiting.fetch_sub(1, Ordering::Relaxed);
                let edges = Edges { left: &left, right: &right };
                log.frame(&row, Some(&frame), Some(edges))?;
            }
            Fact::Frame { row, image: None } => log.frame(&row, None, None)?,
            Fact::Step { now, event, step } => log.step(now, &event, &step),
            Fact::Latency(latency) => log.latency(latency.latency_ms, latency.send_wait_ms),
            Fact::Note(note) => log.note(&note),
        }
    }
    log.finish()
}
