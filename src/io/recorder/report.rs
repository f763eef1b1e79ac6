//! The result of a recording.

use std::path::PathBuf;

use crate::run::ports::RecordError;

/// Contents of a finished recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordReport {
    /// Number of events.
    pub events: u64,
    /// Number of steps.
    pub steps: u64,
    /// Number of frames.
    pub frames_kept: u64,
    /// Frames that were dropped because the recorder was too slow.
    pub frames_dropped: u64,
    /// Size of the file \[bytes\].
    pub bytes: u64,
    /// Path of the file.
    pub path: PathBuf,
}

/// A recording without the end of its run. It is readable up to that point, and keeps the name of
/// a partial recording.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{why}; {} holds the first {} events", report.path.display(), report.events)]
pub struct Incomplete {
    /// Why it is incomplete.
    pub why: RecordError,
    /// Its contents.
    pub report: RecordReport,
}

/// Numbers of events, steps and frames in a recording.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) events: u64,
    pub(super) steps: u64,
    pub(super) frames: u64,
}
