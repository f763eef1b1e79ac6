//! A steady pulsation of the flow by pump or screw: a multiple-model filter with one
//! hypothesis for each period and one without a pulsation, weighted by their likelihoods.

use super::harmonic::Harmonic;

/// Shortest and longest period \[s\]. Shorter ones are blurred by the gauge; longer ones are
/// followed as drift.
const PERIODS_S: (f64, f64) = (0.55, 10.0);
/// Ratio of one period to the next. Derived: over the memory of 10 periods a harmonic that is
/// off by half a step, 1 %, loses a tenth of a period.
const PERIOD_RATIO: f64 = 1.02;
/// Prior log odds against a pulsation. A flow change that is not yet detected looks like one
/// for a while; a smaller value accepts it, a larger one finds a pulsation later.
const PRIOR_LOG_ODDS: f64 = 14.0;
/// Time constant of the log likelihood ratios, in periods.
const MEMORY_PERIODS: f64 = 10.0;
/// Hypotheses of smaller weight are left out of sums, for speed.
const MIN_WEIGHT: f64 = 1e-3;
/// Periods that must have been seen before a pulsation is used: a part of one may be a drift.
const MIN_PERIODS: f64 = 1.0;
/// Part of a pulsation that the mean over a gauge must keep for its estimate to be used: less
/// of it is lost in the noise.
const MIN_KEPT: f64 = 0.3;
/// Longest time between two widths over which phases are kept \[s\].
const LONGEST_GAP_S: f64 = 3.0;

/// What a width says of a pulsation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulsationSample {
    /// When the middle of its gauge was laid \[s\].
    pub laid_s: f64,
    /// How long the nozzle took for the gauge \[s\].
    pub lasted_s: f64,
    /// ln A of the width.
    pub value: f64,
    /// Its variance.
    pub variance: f64,
    /// Variance of the drift since the last width.
    pub drift: f64,
}

/// Hypotheses of all periods.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPulsation {
    /// The hypothesis without a pulsation.
    level_only: Harmonic,
    harmonics: Vec<HarmonicHypothesis>,
    last_s: Option<f64>,
    /// Time over which widths have come \[s\].
    observed_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct HarmonicHypothesis {
    harmonic: Harmonic,
    /// Logarithm of its likelihood over that of no pulsation.
    log_ratio: f64,
    weight: f64,
}

impl FlowPulsation {
    /// Before the first width.
    pub fn new() -> Self {
        let (shortest, longest) = PERIODS_S;
        let periods = std::iter::successors(Some(shortest), |period| Some(period * PERIOD_RATIO));
        let hypothesis = |period| HarmonicHypothesis {
            harmonic: Harmonic::new(period),
            log_ratio: 0.0,
            weight: 0.0,
        };
        let harmonics = periods.take_while(|period| *period < longest).map(hypothesis).collect();
        Self { level_only: Harmonic::new(f64::INFINITY), harmonics, last_s: None, observed_s: 0.0 }
    }

    /// Adds one width.
    pub fn update(&mut self, one: &PulsationSample) {
        let laid_s = one.laid_s;
        let passed = self.last_s.map_or(0.0, |last| laid_s - last);
        if passed < 0.0 {
            return;
        }
        if passed > LONGEST_GAP_S {
            *self = Self::new();
        }
        self.last_s = Some(laid_s);
        self.observed_s += passed;
        let plain = self.level_only.update(passed, one);
        let mut largest = PRIOR_LOG_ODDS;
        for hypothesis in &mut self.harmonics {
            let likely = hypothesis.harmonic.update(passed, one);
            let kept = 1.0 - (passed / (MEMORY_PERIODS * hypothesis.harmonic.period_s())).min(1.0);
            hypothesis.log_ratio =
                (hypothesis.log_ratio * kept + likely - plain).max(-PRIOR_LOG_ODDS);
            largest = largest.max(hypothesis.log_ratio);
        }
        let mut total = libm::exp(PRIOR_LOG_ODDS - largest);
        for hypothesis in &mut self.harmonics {
            let less = hypothesis.log_ratio - largest;
            let is_kept = hypothesis.harmonic.kept_over(one.lasted_s).abs() > MIN_KEPT;
            let is_seen = self.observed_s > MIN_PERIODS * hypothesis.harmonic.period_s();
            let is_likely = is_kept && is_seen && less > -PRIOR_LOG_ODDS;
            hypothesis.weight = if is_likely { libm::exp(less) } else { 0.0 };
            total += hypothesis.weight;
        }
        for hypothesis in &mut self.harmonics {
            hypothesis.weight /= total;
        }
    }

    /// The flow has stepped: the level of every hypothesis may have changed by a variance.
    pub fn loosen(&mut self, variance: f64) {
        self.level_only.loosen(variance);
        for hypothesis in &mut self.harmonics {
            hypothesis.harmonic.loosen(variance);
        }
    }

    /// Mean pulsation of ln w of bead laid between two times \[s\].
    pub fn mean(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        let mean = |harmonic: &Harmonic| harmonic.mean(from_s - last, to_s - last);
        self.likely().map(|hypothesis| hypothesis.weight * mean(&hypothesis.harmonic)).sum()
    }

    /// Variance of that mean: of every hypothesis, and between them.
    pub fn variance(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        let mean = self.mean(from_s, to_s);
        let squares: f64 = self
            .likely()
            .map(|one| one.weight * one.harmonic.mean_square(from_s - last, to_s - last))
            .sum();
        (squares - mean * mean).max(0.0)
    }

    /// Period of the most probable pulsation \[s\]; none where no pulsation is more probable.
    pub fn period_s(&self) -> Option<f64> {
        let all: f64 = self.likely().map(|hypothesis| hypothesis.weight).sum();
        let best = self.likely().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        (all > 0.5).then(|| best.harmonic.period_s())
    }

    fn likely(&self) -> impl Iterator<Item = &HarmonicHypothesis> {
        self.harmonics.iter().filter(|hypothesis| hypothesis.weight > MIN_WEIGHT)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::sim::hash;

    fn watch(seconds: u32, rate_hz: u32, wave: impl Fn(f64) -> f64) -> (FlowPulsation, f64) {
        let mut pulsation = FlowPulsation::new();
        let mut at = 0.0;
        for k in 0..seconds * rate_hz {
            at = f64::from(k) / f64::from(rate_hz);
            let [noise, _] = hash::normal_pair(hash::mix(&[7, u64::from(k)]));
            let value = 3.7 + wave(at) + 0.0086 * noise;
            let (variance, drift) = (0.0086 * 0.0086, 5e-8);
            let sample = PulsationSample { laid_s: at, lasted_s: 0.0, value, variance, drift };
            pulsation.update(&sample);
        }
        (pulsation, at)
    }

    #[test]
    fn a_pulsation_is_found_within_five_periods_and_predicted() {
        for (period, seconds) in [(1.0, 5), (2.6, 13), (6.0, 30)] {
            let wave = |at: f64| 0.03 * (TAU * at / period + 1.1).sin();
            let (pulsation, last) = watch(seconds, 50, wave);
            let found = pulsation.period_s().unwrap();
            assert!((found / period - 1.0).abs() < 0.03, "{period}: {found}");
            let off = pulsation.mean(last + 0.8, last + 0.8) - wave(last + 0.8);
            assert!(off.abs() < 0.3 * 0.03, "{period}: {off}");
        }
    }

    #[test]
    fn noise_alone_is_no_pulsation() {
        for rate in [10, 50] {
            let (pulsation, last) = watch(40, rate, |_| 0.0);
            assert_eq!(pulsation.period_s(), None);
            assert!(pulsation.mean(last + 0.5, last + 0.5).abs() < 1e-3);
        }
    }
}
