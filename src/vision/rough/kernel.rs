//! Weights of a smoothing.

use crate::numeric::number::{float, narrow, whole};

/// The Gaussian kernel of a standard deviation \[samples\], normalised, from its
/// middle outwards; three standard deviations long.
pub fn gaussian(sigma: f64) -> Vec<f32> {
    let half = whole(narrow(3.0 * sigma)).max(1);
    let value = |k: usize| libm::exp(-0.5 * (float(k) / sigma).powi(2));
    let sum = 2.0 * (0..=half).map(value).sum::<f64>() - value(0);
    (0..=half).map(|k| narrow(value(k) / sum)).collect()
}
