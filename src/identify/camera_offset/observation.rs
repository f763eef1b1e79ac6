//! A width and the path position at which it was measured.

use crate::core::Stamp;

/// A width and the path position at which it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadObservation {
    /// The frame's time stamp.
    pub at: Stamp,
    /// Number of the bead.
    pub bead: usize,
    /// Path of the nozzle at that time \[mm\].
    pub path_mm: f64,
    /// Path since the frame was captured: 0 for a camera without latency \[mm\].
    pub since_capture_mm: f64,
    /// Logarithm of the width in mm.
    pub ln_width: f64,
    /// Relative standard deviation of the width.
    pub relative_sigma: f64,
}

impl BeadObservation {
    /// Middle of the gauge along the path at an offset \[mm\].
    pub fn middle_mm(&self, offset_mm: f64) -> f64 {
        self.path_mm - self.since_capture_mm - offset_mm
    }
}
