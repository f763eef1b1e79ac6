//! Settings of a recording.

use std::time::Duration;

use crate::cell::file::KeepFrames;

/// Data about the run that is recorded, and which frames are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordConfig {
    /// Which frames are kept.
    pub frames: KeepFrames,
    /// Whether frames were measured live, whatever the cell says of a simulation.
    pub is_live: bool,
    /// Wall-clock time at stamp 0 \[ns since 1970\].
    pub epoch_ns: u64,
    /// Path of the cell file in the command.
    pub cell_name: String,
    /// The cell file's text.
    pub cell_text: String,
    /// The calibration file's text, if the cell has one.
    pub calibration_text: Option<String>,
    /// The files to which the cell refers for its extruder.
    pub extruder_files: Vec<ExtruderFile>,
}

/// A file for the extruder side of a controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExtruderFile {
    /// Its name in a recording, such as [`super::format::MODEL_ATTACHMENT`].
    pub name: &'static str,
    /// Its name in messages.
    pub source: String,
    /// Its text.
    pub text: String,
}

/// Sizes and times; smaller in tests.
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
