//! Where the camera really looks: several offsets about the stated one, each weighted by how
//! well it predicts the widths when the speed changes (a multiple-model estimate).

use super::speed_history::SpeedHistory;

/// Offsets that are believed in beside each other.
const HYPOTHESES: usize = 9;
/// Steps between them, as a share of the offset.
const FACTOR_STEP: f64 = 0.06;
/// Standard deviation that is always left, as a share: offsets are told to no
/// better than a part of a step.
const MIN_SIGMA: f64 = 0.02;
/// Relative standard deviation of the flow that no model tells.
const UNMODELLED_SIGMA: f64 = 0.01;
/// How much faster than it is said to the level may drift here, as variances:
/// an exponent that is not known yet is taken up by it.
const DRIFT_FACTOR: f64 = 16.0;
/// Most that one width may speak against an offset, as a squared surprise.
const MAX_SQUARED_INNOVATION: f64 = 9.0;
/// Share of a surprise that is taken into the unrest.
const NIS_GAIN: f64 = 0.05;
/// Least evidence that an offset keeps, so that it can come back.
const MIN_EVIDENCE: f64 = -12.0;

/// Offsets with the evidence for each, as shares of the one that was told.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetEstimator {
    hypotheses: [OffsetHypothesis; HYPOTHESES],
    factor: f64,
    sigma: f64,
    /// Squared surprise of the best guess: where even it is off, something else
    /// moves the flow, and nothing is learnt.
    nis: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct OffsetHypothesis {
    factor: f64,
    evidence: f64,
    /// ln A and its variance, if a width has been seen.
    level: Option<(f64, f64)>,
}

/// A width before it has a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetObservation {
    /// The nozzle's path at the capture \[mm\].
    pub nozzle_path: f64,
    /// The offset that was told \[mm\].
    pub offset: f64,
    /// Length of the gauge \[mm\].
    pub gauge: f64,
    /// Logarithm of the width, freed of the pulsation.
    pub ln_width: f64,
    /// Exponent that is believed.
    pub exponent: f64,
    /// Variance of `ln_width`.
    pub variance: f64,
    /// Variance by which ln A has drifted since the last width.
    pub drift: f64,
}

impl OffsetEstimator {
    /// The offset that was told, to within a share of it (standard deviation).
    pub fn new(sigma: f64) -> Self {
        let mut number = 0.0;
        let guesses = [(); HYPOTHESES].map(|()| {
            #[expect(clippy::cast_precision_loss, reason = "a handful")]
            let away = (number - (HYPOTHESES / 2) as f64) * FACTOR_STEP;
            number += 1.0;
            let evidence = -0.5 * (away / sigma.max(1e-3)).powi(2);
            OffsetHypothesis { factor: 1.0 + away, evidence, level: None }
        });
        let mut hypothesis = Self { hypotheses: guesses, factor: 1.0, sigma, nis: 1.0 };
        hypothesis.summarise();
        hypothesis
    }

    /// A new bead: the levels are new, the evidence stays.
    pub fn begin_bead(&mut self) {
        for guess in &mut self.hypotheses {
            guess.level = None;
        }
    }

    /// The offset as a share of the one that was told.
    pub fn factor(&self) -> f64 {
        self.factor
    }

    /// Standard deviation of that share.
    pub fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Takes a width, if the trail reaches to where every offset has it.
    pub fn update(&mut self, history: &SpeedHistory, sight: &OffsetObservation) {
        let half = 0.5 * sight.gauge;
        let mut plain = [0.0; HYPOTHESES];
        for (guess, plain) in self.hypotheses.iter().zip(&mut plain) {
            let position = sight.nozzle_path - sight.offset * guess.factor;
            let Some(speed) = history.mean_over(position - half, position + half) else { return };
            *plain = sight.ln_width + sight.exponent * speed.mean;
        }
        let noise = sight.variance + UNMODELLED_SIGMA * UNMODELLED_SIGMA;
        let (scale, best) = (self.nis.max(1.0), self.best());
        let mut left = self.nis;
        for (guess, plain) in self.hypotheses.iter_mut().zip(plain) {
            let innovation = guess.update(plain, noise, DRIFT_FACTOR * sight.drift);
            if guess.evidence >= best {
                left = innovation;
            }
            guess.evidence -= 0.5 * (innovation / scale).min(MAX_SQUARED_INNOVATION);
        }
        self.nis += NIS_GAIN * (left.min(25.0) - self.nis);
        self.summarise();
    }

    fn best(&self) -> f64 {
        self.hypotheses.iter().map(|guess| guess.evidence).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Mean and standard deviation over all offsets.
    fn summarise(&mut self) {
        let best = self.best();
        let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
        for guess in &mut self.hypotheses {
            guess.evidence = (guess.evidence - best).max(MIN_EVIDENCE);
            let weight = libm::exp(guess.evidence);
            total += weight;
            mean += weight * guess.factor;
            square += weight * guess.factor * guess.factor;
        }
        self.factor = mean / total;
        let variance = (square / total - self.factor * self.factor).max(0.0);
        self.sigma = (variance + MIN_SIGMA * MIN_SIGMA).sqrt();
    }
}

impl OffsetHypothesis {
    /// The surprise, squared and in variances; 0 for the first.
    fn update(&mut self, plain: f64, noise: f64, drift: f64) -> f64 {
        let Some((level, variance)) = self.level else {
            self.level = Some((plain, noise));
            return 0.0;
        };
        let variance = variance + drift;
        let total = variance + noise;
        let by = plain - level;
        let gain = variance / total;
        let most = 4.0 * total.sqrt();
        self.level = Some((level + gain * by.clamp(-most, most), variance * (1.0 - gain)));
        by * by / total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bead of exponent 0.25 whose speed steps once, seen `offset` behind the
    /// nozzle by a law that was told 88.4 mm.
    fn seen(offset: f64) -> OffsetEstimator {
        let mut history = SpeedHistory::new(100.0, 1e3);
        let mut hypothesis = OffsetEstimator::new(0.1);
        for k in 0..400 {
            let at = 0.02 * f64::from(k);
            let (first, second) = (at.min(3.0), (at - 3.0).max(0.0));
            let speed = if second > 0.0 { 70.0 } else { 100.0 };
            let path = 100.0 * first + 70.0 * second;
            history.report(at, path, speed, 1.0);
            let position = path - offset;
            let Some(truth) = history.mean_over(position - 6.35, position + 6.35) else { continue };
            hypothesis.update(
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
        hypothesis
    }

    #[test]
    fn a_step_of_the_speed_tells_the_offset() {
        for fraction in [0.8, 0.88, 1.0, 1.12, 1.2] {
            let hypothesis = seen(88.4 * fraction);
            assert!(
                (hypothesis.factor() - fraction).abs() < 0.04,
                "{fraction}: {}",
                hypothesis.factor()
            );
            assert!(hypothesis.sigma() < 0.06, "{fraction}: {}", hypothesis.sigma());
        }
    }

    #[test]
    fn without_a_change_of_speed_what_was_told_holds() {
        let hypothesis = OffsetEstimator::new(0.1);
        assert!((hypothesis.factor() - 1.0).abs() < 1e-12);
        assert!(hypothesis.sigma() > 0.08);
    }
}
