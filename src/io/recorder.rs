//! Records a run to MCAP: every event with the controller's step in response, and as many frames
//! as the disk can take.
//!
//! ```text
//! control thread ── events+steps ──────────────▶ writer ──▶ recording.mcap.partial
//! camera thread ── frames ──▶ PNG encoder ──▶      │
//!                                                  └─ finished: recording.mcap
//! ```
//!
//! Neither the control nor the camera thread ever waits. Frames that do not fit their queue are
//! dropped and counted. An event that does not fit its queue, or cannot be written, ends the
//! recording at that point: from then on [`Recorder::record`] fails and nothing is recorded. So a
//! recording is always the uninterrupted beginning of its run. Recorded data reach the operating
//! system within half a second.

mod config;
mod encode;
pub mod format;
mod mux;
mod report;
pub mod sink;
pub mod state;
mod tap;
mod writer;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, TrySendError, bounded};

use crate::control::{Event, Step};
use crate::core::Stamp;
use crate::run::ports::{RecordError, Recorder};
use config::RecorderLimits;
pub use config::{ExtruderFile, RecordConfig};
use encode::FrameJob;
use format::{CALIBRATION_ATTACHMENT, CELL_ATTACHMENT, FORMAT_VERSION, PROGRAM_VERSION, RunInfo};
use mux::Mux;
use report::Counts;
pub use report::{Incomplete, RecordReport};
use sink::{FileSink, RetryingWriter, Sink};
use state::{AnsweredEvent, RecorderState};
pub use tap::FrameTap;
use writer::{WriterInputs, WriterThread};

/// The control thread's handle of the recorder. Dropping it finishes the recording like
/// [`Self::finish`], but without a report.
pub struct RecorderHandle {
    next: u64,
    /// Whether to wait for room in a full queue.
    waits: bool,
    answered: Option<Sender<AnsweredEvent>>,
    tap: FrameTap,
    path: PathBuf,
    writer: Option<JoinHandle<RecordReport>>,
}

/// Begins `recording.mcap.partial` in `folder`, which is renamed to `recording.mcap` at the end;
/// an existing recording is an error. The channel gives the first failure, so that control learns
/// of it even without an event to record.
pub fn start(
    config: &RecordConfig,
    folder: &Path,
) -> Result<(RecorderHandle, Receiver<RecordError>), RecordError> {
    start_with(config, FileSink::create(folder)?, RecorderLimits::default())
}

fn start_with<S: Sink + 'static>(
    config: &RecordConfig,
    sink: S,
    tuning: RecorderLimits,
) -> Result<(RecorderHandle, Receiver<RecordError>), RecordError> {
    let run = RunInfo {
        format_version: FORMAT_VERSION,
        program_version: PROGRAM_VERSION.to_owned(),
        is_live: config.is_live,
        epoch_ns: config.epoch_ns,
        cell_name: config.cell_name.clone(),
    };
    let extruder_files = config.extruder_files.iter().map(|file| (file.name, file.text.as_str()));
    let mut attachments = vec![(CELL_ATTACHMENT, config.cell_text.as_str())];
    attachments
        .extend(config.calibration_text.as_deref().map(|text| (CALIBRATION_ATTACHMENT, text)));
    attachments.extend(extruder_files);
    let mut mux = Mux::new(&run, &attachments).map_err(|error| RecordError(error.to_string()))?;
    let path = sink.path().to_path_buf();
    let mut outlet = RetryingWriter::new(sink);
    mux.take(outlet.waiting());
    outlet
        .push()
        .map_err(|error| RecordError(format!("cannot write {}: {error}", path.display())))?;

    let (alarm, alarms) = bounded(1);
    let shared = Arc::new(RecorderState::new(alarm));
    let (answered, answered_out) = bounded(tuning.events);
    let (jobs, jobs_out) = bounded(tuning.frames);
    let (encoded, encoded_out) = bounded(tuning.encoded);
    let (epoch_ns, encoder_shared) = (config.epoch_ns, Arc::clone(&shared));
    spawn("frame encoder", move || {
        encode::run(&jobs_out, &encoded, epoch_ns, &encoder_shared);
    })?;
    let thread = WriterThread {
        mux,
        output: outlet,
        shared: Arc::clone(&shared),
        tuning,
        written: Counts::default(),
    };
    let inputs = WriterInputs { answered: answered_out, frames: encoded_out };
    let writer = spawn("recorder", move || thread.run(inputs))?;
    let tap = FrameTap { keep: config.frames, jobs, shared };
    let handle = RecorderHandle {
        next: 0,
        waits: false,
        answered: Some(answered),
        tap,
        path,
        writer: Some(writer),
    };
    Ok((handle, alarms))
}

fn spawn<T: Send + 'static>(
    name: &str,
    body: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, RecordError> {
    std::thread::Builder::new()
        .name(name.to_string())
        .spawn(body)
        .map_err(|error| RecordError(format!("cannot start the {name} thread: {error}")))
}

impl Recorder for RecorderHandle {
    fn record(&mut self, now: Stamp, event: &Event, step: &Step) -> Result<(), RecordError> {
        let shared = &self.tap.shared;
        if let Some(why) = shared.failure() {
            return Err(why.clone());
        }
        let item = AnsweredEvent { n: self.next, now, event: event.clone(), step: step.clone() };
        let Some(answered) = &self.answered else {
            return Err(shared.fail(RecordError("the recording is finished".to_string())));
        };
        let sent = if self.waits {
            answered.send(item).map_err(|error| TrySendError::Disconnected(error.0))
        } else {
            answered.try_send(item)
        };
        let why = match sent {
            Ok(()) => {
                self.next += 1;
                return Ok(());
            }
            Err(TrySendError::Full(_)) => {
                format!("the disk does not keep up: event {} finds the queue full", self.next)
            }
            Err(TrySendError::Disconnected(_)) => "the recorder has ended".to_string(),
        };
        Err(shared.fail(RecordError(why)))
    }
}

impl RecorderHandle {
    /// From now on waits for a slow disk instead of ending the recording: for a simulation, whose
    /// time can wait.
    #[must_use]
    pub fn waiting(mut self) -> Self {
        self.waits = true;
        self
    }

    /// An input for frames from another thread.
    pub fn frames(&self) -> FrameTap {
        self.tap.clone()
    }

    /// Number of frames that have been dropped so far.
    pub fn frames_dropped(&self) -> u64 {
        self.tap.shared.frames_dropped.load(Ordering::Relaxed)
    }

    /// Writes all queued data, ends the file and gives it its final name. Waits for the disk.
    pub fn finish(mut self) -> Result<RecordReport, Box<Incomplete>> {
        let report = self.close().unwrap_or_else(|| {
            self.tap.shared.fail(RecordError("the recorder broke off".to_string()));
            RecordReport {
                events: 0,
                steps: 0,
                frames_kept: 0,
                frames_dropped: self.frames_dropped(),
                bytes: 0,
                path: self.path.clone(),
            }
        });
        match self.tap.shared.failure() {
            None => Ok(report),
            Some(why) => Err(Box::new(Incomplete { why: why.clone(), report })),
        }
    }

    /// Closes the input of frames first, so that queued ones are still written; then that of
    /// events, whose end ends the writer.
    fn close(&mut self) -> Option<RecordReport> {
        let writer = self.writer.take()?;
        // The encoder may already have ended.
        self.tap.jobs.send(FrameJob::Close).unwrap_or_default();
        self.answered = None;
        writer.join().ok()
    }
}

impl Drop for RecorderHandle {
    fn drop(&mut self) {
        self.close();
    }
}
