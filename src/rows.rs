//! The data of a run: `widths.csv`, `edges.csv`, `summary.json`.

pub mod edges;
pub mod frame_row;
pub mod log;
pub mod names;
pub mod output;
pub mod summary;
pub mod widths;
