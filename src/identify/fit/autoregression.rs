//! Autoregressive model of the residuals.

use crate::numeric::number::to_f64;
use crate::numeric::row::dot;

/// Largest order of the model, and samples for each coefficient. A choice: longer correlations
/// are drifts.
const MAX_ORDER: usize = 30;
const SAMPLES_PER_LAG: usize = 20;

/// Autoregressive process: e(t) = −Σ a(k)·e(t−k) + white noise.
#[derive(Debug, Clone)]
pub(super) struct ArModel {
    coefficients: Vec<f64>,
    /// Standard deviation of the white noise.
    innovation_sigma: f64,
    /// Variance of the residuals themselves.
    pub variance: f64,
}

impl ArModel {
    /// By the Yule-Walker equations, which give a stable model, with the order of least BIC
    /// (Schwarz 1978).
    pub fn of(residuals: &[f64]) -> Self {
        let n = to_f64(residuals.len());
        let longest = MAX_ORDER.min(residuals.len() / SAMPLES_PER_LAG);
        let lagged = |lag: usize| dot(&residuals[lag..], residuals) / n;
        let correlation: Vec<f64> = (0..=longest).map(lagged).collect();
        let variance = correlation[0];
        let white = Self { coefficients: Vec::new(), innovation_sigma: variance.sqrt(), variance };
        let (mut best, mut least) = (white, n * libm::log(variance.max(f64::MIN_POSITIVE)));
        let mut row: Vec<f64> = Vec::new();
        let mut power = variance;
        for order in 1..=longest {
            if power <= 0.0 {
                break;
            }
            // The Levinson-Durbin recursion.
            let known: f64 = row.iter().rev().zip(&correlation[1..]).map(|(a, r)| a * r).sum();
            let reflection = -(correlation[order] + known) / power;
            let turned: Vec<f64> = row.iter().rev().map(|a| a * reflection).collect();
            row.iter_mut().zip(turned).for_each(|(a, by)| *a += by);
            row.push(reflection);
            power *= 1.0 - reflection * reflection;
            let cost = n * libm::log(power.max(f64::MIN_POSITIVE)) + to_f64(order) * libm::log(n);
            if cost < least {
                least = cost;
                let innovation_sigma = power.max(0.0).sqrt();
                best = Self { coefficients: row.clone(), innovation_sigma, variance };
            }
        }
        best
    }

    /// Number of independent samples whose mean has the same variance.
    pub fn effective_samples(&self, samples: usize) -> f64 {
        let n = to_f64(samples);
        let sum = 1.0 + self.coefficients.iter().sum::<f64>();
        let at_rest = self.innovation_sigma * self.innovation_sigma / (sum * sum);
        if at_rest > 0.0 { (n * self.variance / at_rest).clamp(1.0, n) } else { n }
    }

    /// Hᵀ·column, with H·Hᵀ the covariance of the residuals.
    pub fn weight(&self, column: &[f64]) -> Vec<f64> {
        let mut weighted = vec![0.0; column.len()];
        for t in (0..column.len()).rev() {
            let later = self.coefficients.iter().zip(weighted.get(t + 1..).unwrap_or_default());
            weighted[t] =
                self.innovation_sigma * column[t] - later.map(|(a, w)| a * w).sum::<f64>();
        }
        weighted
    }
}

#[cfg(test)]
pub(super) mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Noise of one lag.
    pub fn lagged(seed: u64, n: usize, pole: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut state = 0.0;
        (0..n)
            .map(|_| {
                let white: f64 = StandardNormal.sample(&mut random);
                state = pole * state + white;
                state
            })
            .collect()
    }

    #[test]
    fn the_order_of_a_lag_is_found_and_white_noise_has_none() {
        let model = ArModel::of(&lagged(1, 20_000, 0.7));
        assert!((model.coefficients[0] + 0.7).abs() < 0.02, "{model:?}");
        assert!((model.innovation_sigma - 1.0).abs() < 0.02, "{model:?}");
        let fraction = model.effective_samples(20_000) / 20_000.0;
        assert!((fraction - 0.3 / 1.7).abs() < 0.03, "{fraction}");
        assert!(ArModel::of(&lagged(2, 20_000, 0.0)).effective_samples(20_000) > 19_000.0);
    }
}
