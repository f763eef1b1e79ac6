//! The noise of a width as an estimate of the bead: its roughness, and the measurement.

use std::f64::consts::PI;

/// Smallest part of the correlation length over which two widths differ at all.
const MIN_SPACING_RATIO: f64 = 0.01;
/// Path over which innovations are averaged \[mm\].
const AVERAGED_MM: f64 = 300.0;
/// Normalised innovations squared are clipped at seven standard deviations: an outlier in fifty
/// widths makes the noise at most twice as large. The mean of a consistent filter stays 1.
const MAX_NIS: f64 = 50.0;

/// Roughness of a bead: a stationary process along it whose autocorrelation is
/// exp(−(distance/length)²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadRoughness {
    /// Standard deviation of the width at a point, as a fraction.
    pub ratio: f64,
    /// Correlation length \[mm\].
    pub length_mm: f64,
}

/// Noise of a series of widths along the bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthNoise {
    /// Integral of the autocovariance over all distances \[mm\].
    density_mm: f64,
    /// Distance over which widths are independent \[mm\].
    reach_mm: f64,
    /// Moving average of the normalised innovation squared.
    nis: f64,
}

impl WidthNoise {
    /// For a gauge of a length \[mm\].
    pub fn new(roughness: BeadRoughness, gauge_mm: f64) -> Self {
        let reach = PI.sqrt() * roughness.length_mm;
        Self {
            density_mm: roughness.ratio * roughness.ratio * reach,
            reach_mm: gauge_mm + reach,
            nis: 1.0,
        }
    }

    /// Variance of ln w of a width after this much path \[mm\] by the roughness. Widths that
    /// show the same bead count together as one: their mean over a long piece has the variance
    /// of that piece's roughness.
    pub fn variance(&self, spacing_mm: f64) -> f64 {
        let least = MIN_SPACING_RATIO * self.reach_mm;
        self.density_mm / spacing_mm.clamp(least, self.reach_mm)
    }

    /// Adds a normalised innovation squared, of a width after this much path \[mm\].
    pub fn observe(&mut self, squared: f64, spacing_mm: f64) {
        let weight = -libm::expm1(-spacing_mm / AVERAGED_MM);
        self.nis += weight * (squared.min(MAX_NIS) - self.nis);
    }

    /// How much larger than predicted innovations have been, as a variance; at least 1.
    pub fn excess(&self) -> f64 {
        self.nis.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_close_together_count_as_one() {
        let noise = WidthNoise::new(BeadRoughness { ratio: 0.0025, length_mm: 5.0 }, 12.7);
        let over = |spacing: f64| 100.0 / spacing / noise.variance(spacing);
        // The mean over 100 mm is as certain whether widths come every millimetre or every five.
        assert!((over(1.0) / over(5.0) - 1.0).abs() < 1e-9);
        // Widths that share no bead are independent: 0.071 mm of 42 for a gauge of 12.7 mm.
        assert!((noise.variance(500.0).sqrt() * 42.0 - 0.071).abs() < 0.01);
    }

    #[test]
    fn innovations_that_are_too_large_make_the_noise_larger_and_small_ones_do_not_lower_it() {
        let mut noise = WidthNoise::new(BeadRoughness { ratio: 0.0025, length_mm: 5.0 }, 12.7);
        for _ in 0..400 {
            noise.observe(0.2, 2.0);
        }
        assert_eq!(noise.excess(), 1.0);
        for _ in 0..400 {
            noise.observe(4.0, 2.0);
        }
        assert!((noise.excess() - 4.0).abs() < 0.3, "{noise:?}");
    }
}
