//! Where an edge was found on one caliper line.

use crate::numeric::number::to_f64;

/// A caliper's edge with sub-pixel position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaliperEdge {
    /// Position across the bead at the middle of the band \[px\].
    pub at: f64,
    /// Variance of the position \[px²\].
    pub variance: f64,
    /// Signed height of the step \[grey levels\].
    pub height: f64,
    /// Fraction of the band's rows that it comes from.
    pub row_fraction: f64,
}

/// Mean of positions across the bead \[px\].
pub fn mean_position(positions: &[Option<CaliperEdge>]) -> f64 {
    let sum: f64 = positions.iter().flatten().map(|position| position.at).sum();
    sum / to_f64(positions.iter().flatten().count().max(1))
}
