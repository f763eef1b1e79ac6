//! What a run leaves behind, and what is done with recorded frames:
//! `widths.csv`, `summary.json` and `report.html`.
//!
//! [`RunLog`] is fed one fact at a time and keeps a bounded amount of them, so
//! that hours of running cost as much memory as minutes. Every file appears
//! under its final name only when it is whole.

pub mod accuracy;
pub mod calibration;
pub mod compare;
pub mod edges;
pub mod identify;
pub mod log;
pub mod names;
pub mod offset;
pub mod output;
pub mod overlays;
pub mod picker;
pub mod picture;
pub mod planned;
pub mod progress;
pub mod recorded;
pub mod replay;
pub mod report;
pub mod reproduce;
pub mod row;
pub mod setup;
pub mod sheet;
pub mod stats;
pub mod summary;
#[cfg(test)]
mod synthetic;
pub mod tuned;
pub mod widths;

pub use edges::EdgesWriter;
pub use log::{ControlFacts, LogOptions, RunLog};
pub use output::LogError;
pub use overlays::OverlayWriter;
pub use progress::Progress;
pub use row::{ControlColumns, FrameRow};
pub use summary::{Note, Summary};
