//! A steady pulsation of pump or screw: pulsations of many periods are believed
//! in beside each other, and beside none, each as far as the widths bear it out.

use super::harmonic::Harmonic;

/// Shortest and longest period \[s\].
const PERIODS_S: (f64, f64) = (0.55, 10.0);
/// Step from one period to the next.
const PERIOD_RATIO: f64 = 1.02;
/// Evidence that a pulsation has against it at first, as the logarithm of
/// odds: a step that was not recognised looks like one for a while.
const PRIOR_LOG_ODDS: f64 = 14.0;
/// Periods over which evidence is forgotten.
const MEMORY_PERIODS: f64 = 10.0;
/// A pulsation that counts for less than this is left out.
const MIN_WEIGHT: f64 = 1e-3;
/// Longest time between two widths over which a phase is kept \[s\].
const LONGEST_GAP_S: f64 = 3.0;

/// Pulsations of all periods.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPulsation {
    /// A level that does not pulsate, against which all others are held.
    level_only: Harmonic,
    harmonics: Vec<HarmonicHypothesis>,
    last_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct HarmonicHypothesis {
    harmonic: Harmonic,
    /// Logarithm of its likelihood over that of no pulsation.
    evidence: f64,
    weight: f64,
}

impl FlowPulsation {
    /// Nothing has been seen.
    pub fn new() -> Self {
        let (shortest, longest) = PERIODS_S;
        let periods = std::iter::successors(Some(shortest), |period| Some(period * PERIOD_RATIO));
        let tones = periods
            .take_while(|period| *period < longest)
            .map(|period| HarmonicHypothesis {
                harmonic: Harmonic::new(period),
                evidence: 0.0,
                weight: 0.0,
            })
            .collect();
        Self { level_only: Harmonic::new(f64::INFINITY), harmonics: tones, last_s: None }
    }

    /// Takes ln A as a width shows it, of bead laid at a time \[s\], with its
    /// variance, and the variance by which it has drifted since the last one.
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
        let mut most = PRIOR_LOG_ODDS;
        for believed in &mut self.harmonics {
            let likely = believed.harmonic.update(passed, value, variance, drift);
            let kept = 1.0 - (passed / (MEMORY_PERIODS * believed.harmonic.period_s())).min(1.0);
            believed.evidence = (believed.evidence * kept + likely - plain).max(-PRIOR_LOG_ODDS);
            most = most.max(believed.evidence);
        }
        self.update_weights(most);
    }

    fn update_weights(&mut self, most: f64) {
        let mut total = libm::exp(PRIOR_LOG_ODDS - most);
        for believed in &mut self.harmonics {
            let less = believed.evidence - most;
            believed.weight = if less > -PRIOR_LOG_ODDS { libm::exp(less) } else { 0.0 };
            total += believed.weight;
        }
        for believed in &mut self.harmonics {
            believed.weight /= total;
        }
    }

    /// The flow has changed by a share that is known to a variance.
    pub fn shift(&mut self, by: f64, variance: f64) {
        self.level_only.shift(by, variance);
        for believed in &mut self.harmonics {
            believed.harmonic.shift(by, variance);
        }
    }

    /// Its share in the width of bead laid at a time \[s\].
    pub fn at(&self, at_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        self.likely().map(|believed| believed.weight * believed.harmonic.at(at_s - last)).sum()
    }

    /// The mean of that over some time \[s\].
    pub fn mean(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        let mean = |tone: &Harmonic| tone.mean(from_s - last, to_s - last);
        self.likely().map(|believed| believed.weight * mean(&believed.harmonic)).sum()
    }

    /// Its period \[s\], where there is likely one.
    pub fn period_s(&self) -> Option<f64> {
        let all: f64 = self.likely().map(|believed| believed.weight).sum();
        let best = self.likely().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        (all > 0.5).then(|| best.harmonic.period_s())
    }

    fn likely(&self) -> impl Iterator<Item = &HarmonicHypothesis> {
        self.harmonics.iter().filter(|believed| believed.weight > MIN_WEIGHT)
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
    fn a_pulsation_is_found_within_five_periods_and_foretold() {
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
