//! Input of a rough edge.

use crate::numeric::blurred_step::StepTable;
use crate::vision::gauge::EdgeKind;
use crate::vision::row_range::RowRange;
use crate::vision::strip::GaugeRows;

/// The gauge's pixels and what is known of the edge.
#[derive(Debug, Clone, Copy)]
pub struct RoughInput<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a GaugeRows<'a, T>,
    /// Rows of its caliper lines.
    pub lines: &'a [RowRange],
    /// Standard deviation of a pixel's noise \[grey levels\].
    pub noise: f32,
    /// Distance of the two edges \[px\].
    pub width_px: f32,
    /// Whether the bead lies after the edge.
    pub bead_after: bool,
    /// Whether the bead is brighter than what lies outside.
    pub bright: bool,
    /// What the edge looks like.
    pub edge: EdgeKind,
    /// Step blurred by the lens.
    pub table: &'a StepTable,
}
