//! Gaussian kernels.

use crate::numeric::number::{narrow_to_f32, round_to_count, to_f64};

/// The Gaussian kernel of a standard deviation \[samples\], normalised, from its
/// middle outwards; three standard deviations long.
pub fn gaussian(sigma: f64) -> Vec<f32> {
    let half = round_to_count(narrow_to_f32(3.0 * sigma)).max(1);
    let value = |k: usize| libm::exp(-0.5 * (to_f64(k) / sigma).powi(2));
    let sum = 2.0 * (0..=half).map(value).sum::<f64>() - value(0);
    (0..=half).map(|k| narrow_to_f32(value(k) / sum)).collect()
}
