//! A steady pulsation of the flow by pump or screw: a multiple-model filter with one
//! hypothesis for each period and some without a pulsation, weighted by their likelihoods.

use super::exponent::Exponent;
use super::pulsating_bead::PulsatingBead;
use super::width_model::{ExpectedBead, WiderExponent};

/// Shortest and longest period \[s\]. Shorter ones are blurred by the gauge; longer ones are
/// followed as drift.
const PERIODS_S: (f64, f64) = (0.55, 10.0);
/// Ratio of one period to the next. Derived: over 10 periods a harmonic that is off by half a step,
/// 1 %, loses a tenth of a period.
const PERIOD_RATIO: f64 = 1.02;
/// Drifts of a flow without a pulsation over the stated one, as variances. Without the larger ones a
/// restless flow would be taken for a pulsation.
const DRIFT_RATIOS: [f64; 3] = [1.0, 10.0, 100.0];
/// Prior log odds against a pulsation. A flow change that is not yet detected looks like one
/// for a while; a smaller value accepts it, a larger one finds a pulsation later.
const PRIOR_LOG_ODDS: f64 = 14.0;
/// Time constant of the log likelihoods \[s\]. Derived: two of the longest periods. A larger one
/// gives up a wrong period later.
const MEMORY_S: f64 = 20.0;
/// Periods that must have been seen before one is used. Derived: a part of one may be a drift. Until
/// then it keeps its weight, and says nothing.
const MIN_PERIODS: f64 = 1.0;
/// Hypotheses of smaller weight are left out of sums, for speed.
const MIN_WEIGHT: f64 = 1e-3;
/// Part of a pulsation that the mean over a gauge must keep for it to be cancelled: less of it is
/// lost in the noise.
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
    /// ln w.
    pub ln_width: f64,
    /// ln(v/v₀).
    pub ln_speed: f64,
    /// Variance of `ln_width`.
    pub variance: f64,
    /// Variance of the drift since the last width.
    pub drift: f64,
}

/// Hypotheses of all periods, and of none.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPulsation {
    hypotheses: Vec<Hypothesis>,
    last_s: Option<f64>,
    /// How long the nozzle took for the gauge of the last width \[s\].
    lasted_s: f64,
    /// When the newest width was laid, whether it was used or not \[s\].
    seen_s: Option<f64>,
    /// Time over which widths have come \[s\].
    observed_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Hypothesis {
    bead: PulsatingBead,
    /// Logarithm of its likelihood over that of the likeliest.
    log_ratio: f64,
    weight: f64,
}

impl FlowPulsation {
    /// Before the first width.
    pub fn new(exponent: Exponent) -> Self {
        let (shortest, longest) = PERIODS_S;
        let steady = DRIFT_RATIOS
            .map(|ratio| PulsatingBead::new(f64::INFINITY, ratio, exponent))
            .into_iter();
        let periods = std::iter::successors(Some(shortest), |period| Some(period * PERIOD_RATIO));
        let pulsating = periods
            .take_while(|period| *period < longest)
            .map(|period| PulsatingBead::new(period, 1.0, exponent));
        Self {
            hypotheses: steady.chain(pulsating).map(Hypothesis::new).collect(),
            last_s: None,
            lasted_s: 0.0,
            seen_s: None,
            observed_s: 0.0,
        }
    }

    /// Phases are not known any more; b remains.
    fn begin_again(&mut self) {
        self.observed_s = 0.0;
        for one in &mut self.hypotheses {
            (one.bead, one.log_ratio, one.weight) = (one.bead.begin_again(), 0.0, 0.0);
        }
    }

    /// A width has come that may not be used. After a gap phases are not known any more.
    pub fn see(&mut self, laid_s: f64) {
        if self.seen_s.is_some_and(|seen| laid_s - seen > LONGEST_GAP_S) {
            self.begin_again();
        }
        self.seen_s = Some(self.seen_s.map_or(laid_s, |seen| seen.max(laid_s)));
    }

    /// Adds one width.
    pub fn update(&mut self, one: &PulsationSample) {
        let passed = self.last_s.map_or(0.0, |last| one.laid_s - last);
        if passed < 0.0 {
            return;
        }
        (self.last_s, self.lasted_s) = (Some(one.laid_s), one.lasted_s);
        self.observed_s += passed;
        for hypothesis in &mut self.hypotheses {
            hypothesis.update(passed, one);
        }
        self.weigh();
    }

    fn weigh(&mut self) {
        let largest = |of: fn(&Hypothesis) -> f64| {
            self.hypotheses.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
        };
        let likeliest = largest(|one| one.log_ratio);
        let most_probable = largest(Hypothesis::log_odds) - likeliest;
        let mut total = 0.0;
        for one in &mut self.hypotheses {
            one.log_ratio = (one.log_ratio - likeliest).max(-PRIOR_LOG_ODDS - one.log_prior());
            let less = one.log_odds() - most_probable;
            one.weight = if less > -PRIOR_LOG_ODDS { libm::exp(less) } else { 0.0 };
            total += one.weight;
        }
        for one in &mut self.hypotheses {
            one.weight /= total;
        }
    }

    /// The flow has stepped: ln A of every hypothesis has changed.
    pub fn shift(&mut self, by: f64) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.bead.shift(by);
        }
    }

    /// ln A of every hypothesis may have changed by a variance.
    pub fn loosen(&mut self, variance: f64) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.bead.loosen(variance);
        }
    }

    /// b of every hypothesis is less certain.
    pub fn widen_exponent(&mut self, by: &WiderExponent) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.bead.widen_exponent(by);
        }
    }

    /// The bead that is laid between two times \[s\]: the mean of all hypotheses. Without a pulsation
    /// it is as `steady` says.
    pub fn bead(&self, from_s: f64, to_s: f64, steady: ExpectedBead) -> ExpectedBead {
        let Some(last) = self.last_s else { return steady };
        let mut expected = steady;
        let square_of_steady = steady.exponent_variance + steady.exponent.powi(2);
        let mut square = square_of_steady;
        for Hypothesis { bead, weight, .. } in self.pulsating() {
            let is_seen = bead.kept_over(self.lasted_s).abs() > MIN_KEPT;
            let pulsation = if is_seen { bead.mean(from_s - last, to_s - last) } else { 0.0 };
            expected.ln_width += weight * (bead.level() + pulsation - steady.ln_width);
            expected.exponent += weight * (bead.exponent() - steady.exponent);
            square +=
                weight * (bead.exponent_variance() + bead.exponent().powi(2) - square_of_steady);
        }
        expected.exponent_variance = (square - expected.exponent.powi(2)).max(0.0);
        expected
    }

    /// Mean pulsation of ln w of bead laid between two times \[s\].
    pub fn mean(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        let mean = |bead: &PulsatingBead| bead.mean(from_s - last, to_s - last);
        self.pulsating().map(|hypothesis| hypothesis.weight * mean(&hypothesis.bead)).sum()
    }

    /// Variance of that mean: of every hypothesis, and between them.
    pub fn variance(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(last) = self.last_s else { return 0.0 };
        let mean = self.mean(from_s, to_s);
        let squares: f64 = self
            .pulsating()
            .map(|one| one.weight * one.bead.mean_square(from_s - last, to_s - last))
            .sum();
        (squares - mean * mean).max(0.0)
    }

    /// Whether a pulsation is more probable than none.
    pub fn is_found(&self) -> bool {
        self.pulsating().map(|hypothesis| hypothesis.weight).sum::<f64>() > 0.5
    }

    /// Period of the most probable pulsation \[s\]; none where no pulsation is more probable.
    pub fn period_s(&self) -> Option<f64> {
        let best = self.pulsating().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        self.is_found().then(|| best.bead.period_s())
    }

    /// The hypotheses of a pulsation that count. A bead without one has no period that has passed.
    fn pulsating(&self) -> impl Iterator<Item = &Hypothesis> {
        let has_passed = |one: &Hypothesis| self.observed_s > MIN_PERIODS * one.bead.period_s();
        self.hypotheses.iter().filter(move |one| one.weight > MIN_WEIGHT && has_passed(one))
    }
}

impl Hypothesis {
    fn new(bead: PulsatingBead) -> Self {
        Self { bead, log_ratio: 0.0, weight: 0.0 }
    }

    fn update(&mut self, passed_s: f64, one: &PulsationSample) {
        let kept = 1.0 - (passed_s / MEMORY_S).min(1.0);
        self.log_ratio = self.log_ratio * kept + self.bead.update(passed_s, one);
    }

    fn log_prior(&self) -> f64 {
        if self.bead.pulsates() { 0.0 } else { PRIOR_LOG_ODDS }
    }

    fn log_odds(&self) -> f64 {
        self.log_ratio + self.log_prior()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::sim::hash;

    fn watch(seconds: u32, rate_hz: u32, wave: impl Fn(f64) -> f64) -> (FlowPulsation, f64) {
        let mut pulsation = FlowPulsation::new(Exponent { prior: 0.25, learns: true });
        let mut at = 0.0;
        for k in 0..seconds * rate_hz {
            at = f64::from(k) / f64::from(rate_hz);
            let [noise, _] = hash::normal_pair(hash::mix(&[7, u64::from(k)]));
            pulsation.update(&PulsationSample {
                laid_s: at,
                lasted_s: 0.0,
                ln_width: 3.7 + wave(at) + 0.0086 * noise,
                ln_speed: 0.0,
                variance: 0.0086 * 0.0086,
                drift: 5e-8,
            });
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

    #[test]
    fn a_restless_flow_is_no_pulsation() {
        let mut found = 0;
        for seed in 0..20 {
            let mut pulsation = FlowPulsation::new(Exponent { prior: 0.25, learns: true });
            let (mut ln_width, variance, drift) = (3.7, 1e-6_f64, 1e-7_f64);
            for k in 0..400_u32 {
                let [walk, noise] = hash::normal_pair(hash::mix(&[seed, u64::from(k)]));
                ln_width += 7.0 * drift.sqrt() * walk;
                pulsation.update(&PulsationSample {
                    laid_s: 0.1 * f64::from(k),
                    lasted_s: 0.0,
                    ln_width: ln_width + variance.sqrt() * noise,
                    ln_speed: 0.0,
                    variance,
                    drift,
                });
                found += u32::from(pulsation.is_found());
            }
        }
        assert_eq!(found, 0, "of 8000 widths");
    }
}
