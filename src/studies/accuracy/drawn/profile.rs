//! An edge as a random line: a stationary Gauss–Markov process.

use super::draw::Draw;
use crate::numeric::number::to_f64;

/// Points of a profile per pixel.
pub const POINTS_PER_PX: usize = 4;

/// Distance of a point of a profile from the profile's start \[px\].
pub fn height_of(position: usize) -> f64 {
    (to_f64(position) + 0.5) / to_f64(POINTS_PER_PX)
}

/// Deviations of an edge \[px\], [`POINTS_PER_PX`] per pixel, with standard deviation
/// `roughness_px` and autocorrelation exp(−|d|/`length_px`).
pub fn rough(count: usize, roughness_px: f64, length_px: f64, draw: &mut Draw) -> Vec<f64> {
    if roughness_px <= 0.0 {
        return vec![0.0; count];
    }
    let keep = libm::exp(-1.0 / (length_px * to_f64(POINTS_PER_PX)));
    let fresh = (1.0 - keep * keep).sqrt();
    let mut last = draw.normal();
    let deviations = (0..count).map(|_| {
        last = keep * last + fresh * draw.normal();
        roughness_px * last
    });
    deviations.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roughness_and_length_are_those_asked_for() {
        let count = 400_000;
        let line = rough(count, 2.0, 5.0, &mut Draw::new("test", 2));
        let covariance =
            |lag: usize| line.iter().zip(&line[lag..]).map(|(a, b)| a * b).sum::<f64>() / 400_000.0;
        // 100,000 px with a correlation length of 5 px hold 10,000 independent positions.
        assert!((covariance(0) / 4.0 - 1.0).abs() < 0.06, "{}", covariance(0));
        assert!((covariance(20) / 4.0 - libm::exp(-1.0)).abs() < 0.06, "{}", covariance(20));
    }
}
