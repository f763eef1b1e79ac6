//! Autocorrelation of the residuals of a model.

use crate::numeric::number::to_f64;

/// Derived: Φ⁻¹(0.995), the bound of 99 % of a normal variable in standard deviations.
const NORMAL_99: f64 = 2.5758;

/// The sample autocorrelation of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Autocorrelation {
    /// Autocorrelation at lag 0, 1, … samples; 1 at lag 0.
    pub coefficients: Vec<f64>,
    /// 99 % of the lags of white noise are within ± this (Bartlett 1946).
    pub bound: f64,
}

impl Autocorrelation {
    /// The coefficients up to a lag in samples, of the deviations from the mean.
    pub fn of(row: &[f64], max_lag: usize) -> Self {
        let n = to_f64(row.len().max(1));
        let mean = row.iter().sum::<f64>() / n;
        let deviations: Vec<f64> = row.iter().map(|value| value - mean).collect();
        let at = |lag: usize| -> f64 {
            let later = deviations.get(lag..).unwrap_or_default();
            deviations.iter().zip(later).map(|(a, b)| a * b).sum()
        };
        let energy = at(0);
        let correlation = |lag| if energy > 0.0 { at(lag) / energy } else { 0.0 };
        let max_lag = max_lag.min(row.len().saturating_sub(1));
        Self { coefficients: (0..=max_lag).map(correlation).collect(), bound: NORMAL_99 / n.sqrt() }
    }

    /// Fraction of the lags from 1 on that exceed the bound; about 1 % for white noise.
    pub fn fraction_outside(&self) -> f64 {
        let lags = self.coefficients.get(1..).unwrap_or_default();
        let outside = lags.iter().filter(|lag| lag.abs() > self.bound).count();
        to_f64(outside) / to_f64(lags.len().max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn noise(keep: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut value = 0.0;
        let mut next = || {
            let drawn: f64 = StandardNormal.sample(&mut random);
            value = keep * value + drawn;
            value
        };
        (0..20_000).map(|_| next()).collect()
    }

    #[test]
    fn white_noise_stays_within_its_bounds_and_autocorrelated_noise_does_not() {
        let white = Autocorrelation::of(&noise(0.0), 200);
        assert_eq!((white.coefficients[0], white.coefficients.len()), (1.0, 201));
        assert!(white.fraction_outside() < 0.04, "{}", white.fraction_outside());
        let autocorrelated = Autocorrelation::of(&noise(0.9), 10);
        assert!(
            (autocorrelated.coefficients[5] - 0.9_f64.powi(5)).abs() < 0.05,
            "{:?}",
            autocorrelated.coefficients
        );
        assert!(autocorrelated.fraction_outside() > 0.9);
    }

    #[test]
    fn nothing_correlates_with_nothing() {
        assert_eq!(Autocorrelation::of(&[], 5).coefficients, [0.0]);
        assert_eq!(Autocorrelation::of(&[3.0; 9], 3).coefficients, [0.0; 4]);
    }

    #[test]
    fn the_bound_holds_99_of_100_normal_numbers() {
        let phi = crate::numeric::normal_distribution::cumulative(NORMAL_99);
        assert!((phi - 0.995).abs() < 1e-6);
    }
}
