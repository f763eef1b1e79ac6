//! A straight line in time through a row, and how much of it is drift.

use super::autoregression::ArModel;
use crate::numeric::number::to_f64;

/// F ratio from which a line is significant. Derived: with many degrees of freedom the
/// probability of 15.1 by chance is 1e-4.
const MIN_F_RATIO: f64 = 15.0;
/// Explained fraction below which a line is negligible.
const MIN_EXPLAINED: f64 = 0.1;
/// Explained fraction above which a line dominates a row.
pub const DOMINANT_FRACTION: f64 = 0.5;

/// The least-squares line of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// Fraction of the variance that it explains.
    pub explained_fraction: f64,
    /// Its change from the first sample to the last.
    pub rise: f64,
    /// Sum of squares about the line.
    pub residual_sum_of_squares: f64,
}

impl Trend {
    /// For a row at even times; zero for fewer than two samples.
    pub fn of(row: &[f64]) -> Self {
        let n = to_f64(row.len().max(1));
        let mean = row.iter().sum::<f64>() / n;
        let middle = 0.5 * (n - 1.0);
        let from_middle = |k: usize| to_f64(k) - middle;
        let (mut along, mut across, mut whole) = (0.0, 0.0, 0.0);
        for (k, value) in row.iter().enumerate() {
            along += from_middle(k) * from_middle(k);
            across += from_middle(k) * (value - mean);
            whole += (value - mean) * (value - mean);
        }
        if !(along > 0.0 && whole > 0.0) {
            return Self { explained_fraction: 0.0, rise: 0.0, residual_sum_of_squares: whole };
        }
        let slope = across / along;
        let explained = (slope * across).min(whole);
        Self {
            explained_fraction: explained / whole,
            rise: slope * (n - 1.0),
            residual_sum_of_squares: whole - explained,
        }
    }

    /// A row without its line; the mean stays.
    pub fn detrend(&self, row: &[f64]) -> Vec<f64> {
        let last = to_f64(row.len().max(2)) - 1.0;
        let slope = self.rise / last;
        row.iter().enumerate().map(|(k, value)| value - slope * (to_f64(k) - 0.5 * last)).collect()
    }

    /// The line of a row where it is significant: more than a tenth of the variance, and an F
    /// ratio over the independent samples above the bound.
    pub fn significant_in(row: &[f64]) -> Option<Self> {
        let trend = Self::of(row);
        if trend.explained_fraction < MIN_EXPLAINED {
            return None;
        }
        let mean = row.iter().sum::<f64>() / to_f64(row.len().max(1));
        let left: Vec<f64> = trend.detrend(row).iter().map(|value| value - mean).collect();
        let ratio = trend.explained_fraction
            / (1.0 - trend.explained_fraction).max(f64::MIN_POSITIVE)
            * ArModel::of(&left).effective_samples(left.len());
        (ratio > MIN_F_RATIO).then_some(trend)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn noise(seed: u64, keep: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut value = 0.0;
        let mut next = || {
            let drawn: f64 = StandardNormal.sample(&mut random);
            value = keep * value + (1.0 - keep * keep).sqrt() * drawn;
            value
        };
        (0..2000).map(|_| next()).collect()
    }

    #[test]
    fn a_line_is_found_with_its_rise() {
        let line: Vec<f64> = (0..101).map(|k| 3.0 - 0.2 * f64::from(k)).collect();
        let found = Trend::of(&line);
        assert!((found.explained_fraction - 1.0).abs() < 1e-12 && (found.rise + 20.0).abs() < 1e-9);
        assert!(found.residual_sum_of_squares < 1e-9);
        assert!(found.detrend(&line).iter().all(|value| (value + 7.0).abs() < 1e-9));
        assert_eq!(
            Trend::of(&[4.0; 9]),
            Trend { explained_fraction: 0.0, rise: 0.0, residual_sum_of_squares: 0.0 }
        );
        assert_eq!(Trend::of(&[]).explained_fraction, 0.0);
    }

    #[test]
    fn drift_is_seen_below_noise_and_noise_is_none() {
        for seed in 0..30 {
            assert_eq!(Trend::significant_in(&noise(seed, 0.0)), None, "{seed}");
            assert_eq!(Trend::significant_in(&noise(seed, 0.98)), None, "{seed}");
            let drifts = noise(seed, 0.5);
            let drifts: Vec<f64> =
                (0..2000).zip(drifts).map(|(k, e)| e + 1e-3 * f64::from(k)).collect();
            let seen = Trend::significant_in(&drifts).unwrap();
            assert!((seen.rise - 2.0).abs() < 0.8, "{seen:?}");
        }
    }

    #[test]
    fn the_f_ratio_is_one_of_ten_thousand_by_chance() {
        let phi = crate::numeric::normal_distribution::cumulative(MIN_F_RATIO.sqrt());
        assert!((2.0 * (1.0 - phi) - 1e-4).abs() < 1e-5);
    }
}
