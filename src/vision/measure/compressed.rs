//! Uncertainty of a width from the compression of the image.

use super::work::MeasureState;
use crate::vision::trace::EdgeTracer;

/// Noise of a profile that moves its edges as much as a compression that removes the pixels' noise
/// \[grey levels\]. Measured: reference/accuracy.md, Drawn frames (`jpeg`): straight edges with a
/// noise of 4 were off as by 2.2 at qualities of 30 to 36, 2.0 to 44 and 1.1 to 53, however far
/// their profiles were from steps; with 1.7 the z of all of them is 1.
const COMPRESSION_GREY: f64 = 1.7;
/// Fraction of saturated pixels from which on these explain the missing noise, not a compression.
const FEW_SATURATED: f64 = 0.01;

impl MeasureState {
    /// Variance of an edge's position by compression, which all rows share \[px²\]: the Cramér–Rao
    /// bound for a profile with a noise of `COMPRESSION_GREY`. 0 where the pixels' noise is not
    /// suppressed.
    pub fn variance_of_compression(&self, edge: &EdgeTracer, contrast_grey: f64) -> f64 {
        if !self.rows.noise.is_suppressed || self.rows.bands.saturated_fraction() >= FEW_SATURATED {
            return 0.0;
        }
        let noise = COMPRESSION_GREY / contrast_grey;
        2.0 * std::f64::consts::PI.sqrt() * edge.blur_px * noise * noise
    }
}
