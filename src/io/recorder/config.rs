//! Settings of a recording.

use std::time::Duration;

use crate::cell::file::KeepFrames;

/// What is recorded about the run itself, and which frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordConfig {
    /// Which frames are kept.
    pub frames: KeepFrames,
    /// Wall clock at stamp 0 \[ns since 1970\].
    pub epoch_ns: u64,
    /// The cell file as the command named it.
    pub cell_name: String,
    /// The cell file's text.
    pub cell_text: String,
    /// The calibration file's text, where the cell has one.
    pub calibration_text: Option<String>,
    /// The files that the cell names for its extruder.
    pub extruder_files: Vec<ExtruderFile>,
}

/// A file that the extruder side of a controller is made from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExtruderFile {
    /// What it is called in a recording, such as [`super::format::MODEL_ATTACHMENT`].
    pub name: &'static str,
    /// What messages call it.
    pub source: String,
    /// Its text.
    pub text: String,
}

/// Sizes and times, which tests make small.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecorderLimits {
    pub(super) flush_every: Duration,
    pub(super) events: usize,
    pub(super) frames: usize,
    pub(super) encoded: usize,
}

impl Default for RecorderLimits {
    fn default() -> Self {
        Self { flush_every: Duration::from_millis(400), events: 4096, frames: 8, encoded: 4 }
    }
}
