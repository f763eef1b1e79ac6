//! The noise of a width as an estimate of the bead: its roughness, and the measurement.

use std::collections::VecDeque;
use std::f64::consts::PI;

/// Smallest part of the correlation length over which two widths differ at all.
const MIN_SPACING_RATIO: f64 = 0.01;
/// Path over which innovations are averaged \[mm\] ...
const AVERAGED_MM: f64 = 300.0;
/// ... and its least number of correlation lengths. Derived: of one gauge alone the estimate is half of
/// the truth in the median; a mean over 50 lengths has a fifth of it as its standard deviation.
const AVERAGED_LENGTHS: f64 = 50.0;
/// Innovations are clipped at this many standard deviations. Derived: 7² / 50 = 1, so that an
/// outlier in fifty widths makes the noise at most twice as large. The mean square of a consistent filter stays 1.
const MAX_SIGMAS: f64 = 7.0;
/// Largest number of innovations that are kept.
const MAX_KEPT: usize = 256;

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
#[derive(Debug, Clone, PartialEq)]
pub struct WidthNoise {
    /// Integral of the autocovariance over all distances \[mm\].
    density_mm: f64,
    /// Distance over which widths are independent \[mm\].
    reach_mm: f64,
    /// Path over which innovations are averaged \[mm\].
    averaged_mm: f64,
    /// Moving average of half the squared difference of two normalised innovations that are
    /// independent.
    nis: f64,
    /// The last normalised innovations, over the distance over which they depend on each other.
    last: VecDeque<Innovation>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Innovation {
    position_mm: f64,
    normalised: f64,
}

impl WidthNoise {
    /// For a gauge of a length \[mm\].
    pub fn new(roughness: BeadRoughness, gauge_mm: f64) -> Self {
        let reach = PI.sqrt() * roughness.length_mm;
        Self {
            density_mm: roughness.ratio * roughness.ratio * reach,
            reach_mm: gauge_mm + reach,
            averaged_mm: AVERAGED_MM.max(AVERAGED_LENGTHS * roughness.length_mm),
            nis: 1.0,
            last: VecDeque::new(),
        }
    }

    /// Variance of ln w of a width after this much path \[mm\] by the roughness. Widths that
    /// show the same bead count together as one: their mean over a long piece has the variance
    /// of that piece's roughness.
    pub fn variance(&self, spacing_mm: f64) -> f64 {
        let least = MIN_SPACING_RATIO * self.reach_mm;
        self.density_mm / spacing_mm.clamp(least, self.reach_mm)
    }

    /// Discards the last innovations.
    pub fn begin_bead(&mut self) {
        self.last.clear();
    }

    /// Adds a normalised innovation of a width at a position \[mm\]. Only its difference to an
    /// independent one counts: innovations that agree along the bead are a drift of the flow.
    pub fn observe(&mut self, normalised: f64, position_mm: f64) {
        let normalised = normalised.clamp(-MAX_SIGMAS, MAX_SIGMAS);
        let spacing = self.last.back().map_or(0.0, |last| position_mm - last.position_mm);
        if spacing <= 0.0 && !self.last.is_empty() {
            return;
        }
        self.last.push_back(Innovation { position_mm, normalised });
        let mut independent = None;
        while self.last.len() > MAX_KEPT
            || self.last.front().is_some_and(|one| position_mm - one.position_mm >= self.reach_mm)
        {
            independent = self.last.pop_front();
        }
        let Some(before) = independent else { return };
        self.last.push_front(before);
        let squared = 0.5 * (normalised - before.normalised).powi(2);
        let weight = -libm::expm1(-spacing / self.averaged_mm);
        self.nis += weight * (squared - self.nis);
    }

    /// How much larger than predicted innovations have been, as a variance; at least 1.
    pub fn excess(&self) -> f64 {
        self.nis.max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash;

    #[test]
    fn widths_close_together_count_as_one() {
        let noise = WidthNoise::new(BeadRoughness { ratio: 0.0025, length_mm: 5.0 }, 12.7);
        let over = |spacing: f64| 100.0 / spacing / noise.variance(spacing);
        // The mean over 100 mm is as certain whether widths come every millimetre or every five.
        assert!((over(1.0) / over(5.0) - 1.0).abs() < 1e-9);
        // Widths that share no bead are independent: 0.071 mm of 42 for a gauge of 12.7 mm.
        assert!((noise.variance(500.0).sqrt() * 42.0 - 0.071).abs() < 0.01);
    }

    /// Innovations of a standard deviation every two millimetres from a position on.
    fn observe(noise: &mut WidthNoise, from_mm: f64, innovation: impl Fn(f64) -> f64) {
        for number in 0..400_u32 {
            let position = from_mm + 2.0 * f64::from(number);
            noise.observe(innovation(position), position);
        }
    }

    fn normal(position: f64) -> f64 {
        hash::normal_pair(hash::mix(&[11, position.to_bits()]))[0]
    }

    #[test]
    fn innovations_that_are_too_large_make_the_noise_larger_and_small_ones_do_not_lower_it() {
        let mut noise = WidthNoise::new(BeadRoughness { ratio: 0.0025, length_mm: 5.0 }, 12.7);
        observe(&mut noise, 0.0, |position| 0.5 * normal(position));
        assert_eq!(noise.excess(), 1.0);
        observe(&mut noise, 800.0, |position| 2.0 * normal(position));
        assert!((noise.excess() - 4.0).abs() < 1.0, "{noise:?}");
    }

    #[test]
    fn innovations_that_agree_along_the_bead_are_no_noise() {
        let mut noise = WidthNoise::new(BeadRoughness { ratio: 0.0025, length_mm: 5.0 }, 12.7);
        observe(&mut noise, 0.0, |position| 3.0 * libm::sin(position / 150.0));
        assert_eq!(noise.excess(), 1.0);
    }
}
