//! The camera's true offset: several offsets about the stated one, each weighted by how
//! well it predicts the widths when the speed changes (a multiple-model estimate).

use super::speed_history::SpeedHistory;
use super::width_model::MAX_SQUARED_INNOVATION;

/// Number of hypotheses; with the step they reach 24 % to either side of the stated offset.
const HYPOTHESES: usize = 9;
/// Step between neighbouring hypotheses, as a fraction of the stated offset.
const FACTOR_STEP: f64 = 0.06;
/// Smallest standard deviation of the estimate, as a fraction: a third of a step, below which
/// the grid does not resolve offsets.
const MIN_SIGMA: f64 = 0.02;
/// Relative standard deviation of the flow that no model predicts, added to the noise of each
/// width. A smaller value trusts one change of speed more.
const UNMODELLED_SIGMA: f64 = 0.01;
/// Factor on the variance of the flow's drift. The level of a hypothesis has no exponent of
/// its own, so an error of the exponent has to be taken up by the level.
const DRIFT_FACTOR: f64 = 16.0;
/// Gain of the moving average of the normalised innovation squared.
const NIS_GAIN: f64 = 0.05;
/// Smallest log likelihood of a hypothesis relative to the best one, so that it can recover.
const MIN_LOG_LIKELIHOOD: f64 = -12.0;

/// Hypotheses of the offset, as factors on the stated offset, with their likelihoods.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetEstimator {
    hypotheses: [OffsetHypothesis; HYPOTHESES],
    factor: f64,
    sigma: f64,
    /// Moving average of the normalised innovation squared of the best hypothesis. Where it
    /// exceeds 1, something other than the offset moves the width, and likelihoods count less.
    nis: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct OffsetHypothesis {
    factor: f64,
    log_likelihood: f64,
    /// ln A and its variance, after the first width.
    level: Option<(f64, f64)>,
}

/// A width, before it is attributed to a position of the bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetObservation {
    /// Path of the nozzle at the capture \[mm\].
    pub nozzle_path: f64,
    /// The stated offset \[mm\].
    pub offset: f64,
    /// Length of the gauge \[mm\].
    pub gauge: f64,
    /// Logarithm of the width, less the pulsation.
    pub ln_width: f64,
    /// Exponent b.
    pub exponent: f64,
    /// Variance of `ln_width`.
    pub variance: f64,
    /// Variance of the drift of ln A since the last width.
    pub drift: f64,
}

impl OffsetEstimator {
    /// Around the stated offset, with a relative standard deviation.
    pub fn new(sigma: f64) -> Self {
        let mut number = 0.0;
        let hypotheses = [(); HYPOTHESES].map(|()| {
            #[expect(clippy::cast_precision_loss, reason = "a handful")]
            let away = (number - (HYPOTHESES / 2) as f64) * FACTOR_STEP;
            number += 1.0;
            let log_likelihood = -0.5 * (away / sigma.max(1e-3)).powi(2);
            OffsetHypothesis { factor: 1.0 + away, log_likelihood, level: None }
        });
        let mut estimator = Self { hypotheses, factor: 1.0, sigma, nis: 1.0 };
        estimator.summarise();
        estimator
    }

    /// A new bead: the levels are new, the likelihoods stay.
    pub fn begin_bead(&mut self) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.level = None;
        }
    }

    /// The offset over the stated one.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Standard deviation of the factor.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Adds a width, if the speed is known at the position of every hypothesis.
    pub fn update(&mut self, history: &SpeedHistory, observation: &OffsetObservation) {
        let half = 0.5 * observation.gauge;
        let mut plain = [0.0; HYPOTHESES];
        for (hypothesis, plain) in self.hypotheses.iter().zip(&mut plain) {
            let position = observation.nozzle_path - observation.offset * hypothesis.factor;
            let Some(speed) = history.mean_over(position - half, position + half) else { return };
            *plain = observation.ln_width + observation.exponent * speed.mean;
        }
        let noise = observation.variance + UNMODELLED_SIGMA * UNMODELLED_SIGMA;
        let (scale, best) = (self.nis.max(1.0), self.best());
        let mut best_nis = self.nis;
        for (hypothesis, plain) in self.hypotheses.iter_mut().zip(plain) {
            let innovation = hypothesis.update(plain, noise, DRIFT_FACTOR * observation.drift);
            if hypothesis.log_likelihood >= best {
                best_nis = innovation;
            }
            hypothesis.log_likelihood -= 0.5 * (innovation / scale).min(MAX_SQUARED_INNOVATION);
        }
        self.nis += NIS_GAIN * (best_nis.min(25.0) - self.nis);
        self.summarise();
    }

    fn best(&self) -> f64 {
        let all = self.hypotheses.iter().map(|hypothesis| hypothesis.log_likelihood);
        all.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Mean and standard deviation over all hypotheses.
    fn summarise(&mut self) {
        let best = self.best();
        let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
        for hypothesis in &mut self.hypotheses {
            hypothesis.log_likelihood = (hypothesis.log_likelihood - best).max(MIN_LOG_LIKELIHOOD);
            let weight = libm::exp(hypothesis.log_likelihood);
            total += weight;
            mean += weight * hypothesis.factor;
            square += weight * hypothesis.factor * hypothesis.factor;
        }
        self.factor = mean / total;
        let variance = (square / total - self.factor * self.factor).max(0.0);
        self.sigma = (variance + MIN_SIGMA * MIN_SIGMA).sqrt();
    }
}

impl OffsetHypothesis {
    /// The normalised innovation squared; 0 for the first width.
    fn update(&mut self, plain: f64, noise: f64, drift: f64) -> f64 {
        let Some((level, variance)) = self.level else {
            self.level = Some((plain, noise));
            return 0.0;
        };
        let variance = variance + drift;
        let total = variance + noise;
        let by = plain - level;
        let gain = variance / total;
        let limit = 4.0 * total.sqrt();
        self.level = Some((level + gain * by.clamp(-limit, limit), variance * (1.0 - gain)));
        by * by / total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bead of exponent 0.25 whose speed steps once, measured `offset` behind the nozzle
    /// where 88.4 mm is stated.
    fn estimated(offset: f64) -> OffsetEstimator {
        let mut history = SpeedHistory::new(100.0, 1e3);
        let mut estimator = OffsetEstimator::new(0.1);
        for k in 0..400 {
            let at = 0.02 * f64::from(k);
            let (first, second) = (at.min(3.0), (at - 3.0).max(0.0));
            let speed = if second > 0.0 { 70.0 } else { 100.0 };
            let path = 100.0 * first + 70.0 * second;
            history.report(at, path, speed, 1.0);
            let position = path - offset;
            let Some(truth) = history.mean_over(position - 6.35, position + 6.35) else { continue };
            estimator.update(
                &history,
                &OffsetObservation {
                    nozzle_path: path,
                    offset: 88.4,
                    gauge: 12.7,
                    ln_width: 3.7 - 0.25 * truth.mean,
                    exponent: 0.25,
                    variance: 1e-4,
                    drift: 1e-7,
                },
            );
        }
        estimator
    }

    #[test]
    fn a_step_of_the_speed_identifies_the_offset() {
        for fraction in [0.8, 0.88, 1.0, 1.12, 1.2] {
            let estimator = estimated(88.4 * fraction);
            assert!(
                (estimator.factor() - fraction).abs() < 0.04,
                "{fraction}: {}",
                estimator.factor()
            );
            assert!(estimator.sigma() < 0.06, "{fraction}: {}", estimator.sigma());
        }
    }

    #[test]
    fn without_a_change_of_speed_the_stated_offset_holds() {
        let estimator = OffsetEstimator::new(0.1);
        assert!((estimator.factor() - 1.0).abs() < 1e-12);
        assert!(estimator.sigma() > 0.08);
    }
}
