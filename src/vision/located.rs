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
    /// Share of the band's rows that it comes from.
    pub row_fraction: f64,
}

/// Mean of places across the bead \[px\].
pub fn mean_position(places: &[Option<CaliperEdge>]) -> f64 {
    let sum: f64 = places.iter().flatten().map(|place| place.at).sum();
    sum / to_f64(places.iter().flatten().count().max(1))
}
