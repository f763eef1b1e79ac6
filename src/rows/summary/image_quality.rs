//! How good the images of a run were.

use serde::Serialize;

/// Medians over the measured frames, within 0.14 %, for whoever sets up light
/// and lens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImageQuality {
    /// Step from ground to bead \[grey levels of 256\].
    pub contrast_median_grey: Option<f64>,
    /// Blur of the edges \[px\].
    pub blur_median_px: Option<f64>,
    /// Noise of a pixel \[grey levels of 256\].
    pub noise_median_grey: Option<f64>,
    /// Mean share of saturated pixels.
    pub saturated_fraction_mean: Option<f64>,
    /// Mean share of caliper lines in use.
    pub used_fraction_mean: Option<f64>,
    /// How far the skew of the edges' flanks moves widths: measured less true width in the
    /// picture, the mean weighed by what each frame tells \[px\].
    pub skew_offset_px: Option<f64>,
    /// Its standard deviation \[px\].
    pub skew_offset_sigma_px: Option<f64>,
}
