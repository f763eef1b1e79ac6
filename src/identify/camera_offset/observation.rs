//! A width and the path position at which it was measured.

/// A width and the path position at which it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadObservation {
    /// Number of the bead.
    pub bead: usize,
    /// Path of the nozzle \[mm\].
    pub path_mm: f64,
    /// Logarithm of the width in mm.
    pub ln_width: f64,
    /// Relative standard deviation of the width.
    pub relative_sigma: f64,
}
