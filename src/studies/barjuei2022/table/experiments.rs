//! What all experiments of the table share.

use crate::cell::Cell;
use crate::cell::file::RunPart;
use crate::studies::row::TableRows;

/// The experiments' cell, how often they are run and what came out.
pub(super) struct Experiments {
    pub(super) cell: Cell,
    pub(super) run: RunPart,
    pub(super) seeds: u64,
    pub(super) frame_seeds: u64,
    pub(super) rows: TableRows,
}
