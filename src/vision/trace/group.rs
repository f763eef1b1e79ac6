//! A few rows that are compared with an edge together.

use crate::vision::template::RowSums;

/// A few rows that are compared with the edge together.
#[derive(Debug, Clone, Copy)]
pub struct RowGroup {
    /// The band that they belong to.
    pub band: usize,
    /// Number of rows.
    pub weight: f32,
    /// How far the rows were sampled beyond the path \[px\].
    pub ahead: f32,
    /// Sums of their residuals.
    pub sums: RowSums,
    /// Position of the edge beside the path \[px\].
    pub moved: f32,
    /// Sum of the squared residuals, scaled to a single row \[grey levels²\].
    pub misfit: f32,
}

impl RowGroup {
    /// Rows that are hidden and not compared.
    pub fn hidden(band: usize, weight: f32) -> Self {
        let (ahead, moved, misfit) = (0.0, 0.0, f32::INFINITY);
        Self { band, weight, ahead, sums: RowSums::default(), moved, misfit }
    }
}
