//! A width, and where the nozzle was when it was measured.

/// A width, and where the nozzle was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadObservation {
    /// Number of the bead.
    pub bead: usize,
    /// Path of the nozzle \[mm\].
    pub path_mm: f64,
    /// Logarithm of the width in mm.
    pub ln_width: f64,
    /// Standard deviation of the width, as a share of it.
    pub relative_sigma: f64,
}
