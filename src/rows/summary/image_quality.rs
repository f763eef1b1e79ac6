//! Quality of a run's images.

use serde::Serialize;

/// Medians over the measured frames, with an error of 0.14 %, for setting up light and lens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImageQuality {
    /// Contrast of bead and ground \[grey levels of 256\].
    pub contrast_median_grey: Option<f64>,
    /// Blur of the edges \[px\].
    pub blur_median_px: Option<f64>,
    /// Noise of a pixel \[grey levels of 256\].
    pub noise_median_grey: Option<f64>,
    /// Mean fraction of saturated pixels.
    pub saturated_fraction_mean: Option<f64>,
    /// Mean fraction of caliper lines in use.
    pub used_fraction_mean: Option<f64>,
    /// Offset of widths by skewed flanks: measured less true width in the image, mean over the
    /// frames weighted by their inverse variances \[px\].
    pub skew_offset_px: Option<f64>,
    /// Standard deviation of that offset \[px\].
    pub skew_offset_sigma_px: Option<f64>,
}
