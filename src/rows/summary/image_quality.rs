//! Quality of a run's images.

use serde::Serialize;

/// Medians over the measured frames, within 0.14 %, for setting up light and lens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImageQuality {
    /// Step from ground to bead \[grey levels of 256\].
    pub contrast_median_grey: Option<f64>,
    /// Blur of the edges \[px\].
    pub blur_median_px: Option<f64>,
    /// Noise of a pixel \[grey levels of 256\].
    pub noise_median_grey: Option<f64>,
    /// Mean fraction of saturated pixels.
    pub saturated_fraction_mean: Option<f64>,
    /// Mean fraction of caliper lines in use.
    pub used_fraction_mean: Option<f64>,
    /// How far the skew of the edges' flanks moves widths: measured less true width in the
    /// image, the mean weighted by the inverse variances of the frames \[px\].
    pub skew_offset_px: Option<f64>,
    /// Its standard deviation \[px\].
    pub skew_offset_sigma_px: Option<f64>,
}
