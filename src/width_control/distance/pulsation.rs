//! A steady pulsation of the flow by pump or screw: a multiple-model filter with one
//! hypothesis for each period and one without a pulsation, weighted by their likelihoods.

use super::harmonic::Harmonic;

/// Shortest and longest period \[s\]. Shorter ones are blurred by the gauge; longer ones are
/// followed as drift.
const PERIODS_S: (f64, f64) = (0.55, 10.0);
/// Ratio of one period to the next. Over the memory of 10 periods a harmonic that is off by
/// half a step, 1 %, loses a tenth of a period.
const PERIOD_RATIO: f64 = 1.02;
/// Prior log odds against a pulsation. A flow change that is not yet detected looks like one
/// for a while; a smaller value accepts it, a larger one finds a pulsation later.
const PRIOR_LOG_ODDS: f64 = 14.0;
/// Time constant of the log likelihood ratios, in periods.
const MEMORY_PERIODS: f64 = 10.0;
/// Hypotheses of smaller weight are left out of sums, for speed.
const MIN_WEIGHT: f64 = 1e-3;
/// Longest time between two widths over which phases are kept \[s\].
const LONGEST_GAP_S: f64 = 3.0;

/// Hypotheses of all periods.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPulsation {
    /// The hypothesis without a pulsation.
    level_only: Harmonic,
    harmonics: Vec<HarmonicHypothesis>,
    last_s: Option<f64>,
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
        Self { level_only: Harmonic::new(f64::INFINITY), harmonics, last_s: None }
    }

    /// Adds ln A of one width, of bead laid at a time \[s\], with its variance, and the
    /// variance of the drift since the last one.
    pub fn update(&mut self, laid_s: f64, value: f64, variance: f64, drift: f64) {
        let passed = self.last_s.map_or(0.0, |last| laid_s - last);
        if passed < 0.0 {
            return;
        }
        if passed > LONGEST_GAP_S {
            *self = Self::new();
        }
        self.last_s = Some(laid_s);
        let plain = self.level_only.update(passed, value, variance, drift);
        let mut largest = PRIOR_LOG_ODDS;
        for hypothesis in &mut self.harmonics {
            let likely = hypothesis.harmonic.update(passed, value, variance, drift);
            let kept = 1.0 - (passed / (MEMORY_PERIODS * hypothesis.harmonic.period_s())).min(1.0);
            hypothesis.log_ratio =
                (hypothesis.log_ratio * kept + likely - plain).max(-PRIOR_LOG_ODDS);
            largest = largest.max(hypothesis.log_ratio);
        }
        let mut total = libm::exp(PRIOR_LOG_ODDS - largest);
        for hypothesis in &mut self.harmonics {
            let less = hypothesis.log_ratio - largest;
            hypothesis.weight = if less > -PRIOR_LOG_ODDS { libm::exp(less) } else { 0.0 };
            total += hypothesis.weight;
        }
        for hypothesis in &mut self.harmonics {
            hypothesis.weight /= total;
        }
    }

    /// The flow has changed: shifts ln A of every hypothesis by `by`, which has this variance.
    pub fn shift(&mut self, by: f64, variance: f64) {
        self.level_only.shift(by, variance);
        for hypothesis in &mut self.harmonics {
            hypothesis.harmonic.shift(by, variance);
        }
    }

    /// The pulsation of ln w of bead laid at a time \[s\].
    pub fn at(&self, at_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        self.likely()
            .map(|hypothesis| hypothesis.weight * hypothesis.harmonic.at(at_s - last))
            .sum()
    }

    /// Mean pulsation of ln w of bead laid between two times \[s\].
    pub fn mean(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        let mean = |harmonic: &Harmonic| harmonic.mean(from_s - last, to_s - last);
        self.likely().map(|hypothesis| hypothesis.weight * mean(&hypothesis.harmonic)).sum()
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
            pulsation.update(at, 3.7 + wave(at) + 0.0086 * noise, 0.0086 * 0.0086, 5e-8);
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
            let off = pulsation.at(last + 0.8) - wave(last + 0.8);
            assert!(off.abs() < 0.3 * 0.03, "{period}: {off}");
        }
    }

    #[test]
    fn noise_alone_is_no_pulsation() {
        for rate in [10, 50] {
            let (pulsation, last) = watch(40, rate, |_| 0.0);
            assert_eq!(pulsation.period_s(), None);
            assert!(pulsation.at(last + 0.5).abs() < 1e-3);
        }
    }
}
