//! The contents of the page of a run.

use super::charts::Charts;
use crate::report::picker::ChosenFrame;
use crate::rows::log::FinishedRun;

/// The contents of a page.
#[derive(Debug)]
pub struct RunReport<'a> {
    /// Facts, summary and remarks.
    pub run: &'a FinishedRun<'a>,
    /// Data of the plots.
    pub charts: &'a Charts,
    /// Frames with their edges.
    pub images: &'a [ChosenFrame],
}
