//! The result of a recording.

use std::path::PathBuf;

use crate::run::ports::RecordError;

/// What a finished recording holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordReport {
    /// Events.
    pub events: u64,
    /// Steps.
    pub steps: u64,
    /// Frames.
    pub frames_kept: u64,
    /// Frames that should have been kept, but for which there was no time.
    pub frames_dropped: u64,
    /// Size of the file.
    pub bytes: u64,
    /// Where it is.
    pub path: PathBuf,
}

/// A recording that misses the end of its run. It is readable up to there, and
/// keeps the name of a partial one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{why}; {} holds the first {} events", report.path.display(), report.events)]
pub struct Incomplete {
    /// Why.
    pub why: RecordError,
    /// What there is.
    pub report: RecordReport,
}

/// How many of each are in a recording.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) events: u64,
    pub(super) steps: u64,
    pub(super) frames: u64,
}
