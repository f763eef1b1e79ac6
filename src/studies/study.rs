//! What a paper's table is asked for, and what it comes to.

use maud::Markup;

use super::row::TableRow;

/// How much is spent on an experiment with noise; none is the source's own
/// number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effort {
    /// Seeds of every experiment with noise.
    pub seeds: Option<u64>,
    /// Seeds of every experiment whose frames are rendered.
    pub frame_seeds: Option<u64>,
}

/// What a source came to.
#[derive(Debug)]
pub struct Reproduced {
    /// Authors, year and what was reproduced.
    pub title: &'static str,
    /// How often and with what.
    pub about: String,
    /// The table.
    pub rows: Vec<TableRow>,
    /// The plots, in the order in which they are read.
    pub sections: Vec<Section>,
}

/// A part of the page.
#[derive(Debug)]
pub struct Section {
    /// Its heading.
    pub heading: String,
    /// What is seen in it; may be empty.
    pub hint: String,
    /// The plots.
    pub drawing: Markup,
}
