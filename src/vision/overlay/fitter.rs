//! Fits to an overlay with a tabulated blurred step.

use super::Overlay;
use crate::numeric::blurred_step::StepTable;

/// An overlay and the blurred step that is fitted to it.
#[derive(Debug, Clone, Copy)]
pub struct StepFitter<'a> {
    pub(super) overlay: &'a Overlay,
    pub(super) table: &'a StepTable,
}

impl Overlay {
    /// Fits with a blurred step.
    #[inline(always)]
    pub fn with<'a>(&'a self, table: &'a StepTable) -> StepFitter<'a> {
        StepFitter { overlay: self, table }
    }
}
