//! The state that all experiments of the table share.

use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::studies::study::TableRows;

/// The experiments' cell, their seeds and the rows so far.
pub(super) struct Experiments {
    pub(super) cell: Cell,
    pub(super) run: RunPart,
    pub(super) seeds: u64,
    pub(super) frame_seeds: u64,
    pub(super) rows: TableRows,
}
