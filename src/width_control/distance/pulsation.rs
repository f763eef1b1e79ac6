//! A steady pulsation of the flow by pump or screw: a multiple-model filter with one
//! hypothesis for each period and some without a pulsation, weighted by their likelihoods. Where
//! pulses are counted by the speed of a screw, there is one period: a pulse.

use std::ops::Range;

use super::exponent::Exponent;
use super::pulsating_bead::{LaidInterval, PulsatingBead, PulsationSample, Turn};
use super::pulse_counter::{PulseCounter, ScrewPulses};
use super::width_model::{ExpectedBead, WiderExponent};
use crate::core::Rpm;

/// Shortest and longest period \[s\]. Shorter ones are blurred by the gauge; longer ones are
/// followed as drift.
pub const PERIODS_S: (f64, f64) = (0.55, 10.0);
/// Periods in an octave. Derived: over 10 periods a harmonic that is off by half a step, 1 %, loses a
/// tenth of a period.
const PERIODS_IN_OCTAVE: u8 = 35;
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

/// Hypotheses of all periods, and of none.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPulsation {
    /// From the longest period to the shortest, and those without a pulsation.
    hypotheses: Vec<Hypothesis>,
    /// Counts pulses, the unit of the period, where a screw makes them; none where it is seconds.
    counter: Option<PulseCounter>,
    last: Option<LastWidth>,
    /// When the newest width was laid, whether it was used or not \[s\].
    seen_s: Option<f64>,
    /// Time over which widths have come, in the unit of the period.
    observed: f64,
}

/// When the last width that was used was laid.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LastWidth {
    /// In seconds.
    laid_s: f64,
    /// In the unit of the period.
    laid: f64,
    /// How long the nozzle took for its gauge, in the unit of the period.
    lasted: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Hypothesis {
    bead: PulsatingBead,
    /// Logarithm of its likelihood over that of the likeliest.
    log_ratio: f64,
    weight: f64,
}

impl FlowPulsation {
    /// Before the first width. Without a screw the period is searched for.
    pub fn new(exponent: Exponent, screw: Option<ScrewPulses>) -> Self {
        let (shortest, longest) = PERIODS_S;
        let ratio = libm::exp2(1.0 / f64::from(PERIODS_IN_OCTAVE));
        let searched = std::iter::successors(Some(shortest), |period| Some(period * ratio))
            .take_while(|period| *period < longest);
        let periods = if screw.is_some() { vec![1.0] } else { searched.collect() };
        let pulsating =
            periods.into_iter().rev().map(|period| PulsatingBead::new(period, 1.0, exponent));
        let steady = DRIFT_RATIOS.map(|ratio| PulsatingBead::new(f64::INFINITY, ratio, exponent));
        Self {
            hypotheses: pulsating.chain(steady).map(Hypothesis::new).collect(),
            counter: screw.map(|screw| PulseCounter::new(screw, 1.0 / longest..=1.0 / shortest)),
            last: None,
            seen_s: None,
            observed: 0.0,
        }
    }

    /// The extruder reported the speed of its screw.
    pub fn screw_reported(&mut self, at_s: f64, speed: Rpm) {
        let goes_on = self.counter.as_mut().is_none_or(|counter| counter.report(at_s, speed));
        if !goes_on {
            self.begin_again();
        }
    }

    /// Phases are not known any more; b remains.
    fn begin_again(&mut self) {
        (self.last, self.observed) = (None, 0.0);
        for one in &mut self.hypotheses {
            (one.bead, one.log_ratio, one.weight) = (one.bead.begin_again(), 0.0, 0.0);
        }
    }

    /// A width has come, whether it will be used or not. After a gap, and where no pulse is counted, phases are
    /// not known any more.
    pub fn see(&mut self, laid_s: f64) {
        let is_after_gap = self.seen_s.is_some_and(|seen| laid_s - seen > LONGEST_GAP_S);
        if is_after_gap || self.phases(laid_s..laid_s).is_none() {
            self.begin_again();
        }
        self.seen_s = Some(self.seen_s.map_or(laid_s, |seen| seen.max(laid_s)));
    }

    /// Adds one width; one without a phase is not used.
    pub fn update(&mut self, one: &PulsationSample) {
        let half = 0.5 * one.lasted_s;
        let Some(gauge) = self.phases(one.laid_s - half..one.laid_s + half) else { return };
        let (laid, lasted) = (0.5 * (gauge.start + gauge.end), gauge.end - gauge.start);
        let new = LastWidth { laid_s: one.laid_s, laid, lasted };
        let last = self.last.unwrap_or(new);
        if one.laid_s < last.laid_s {
            return;
        }
        self.last = Some(new);
        let interval = LaidInterval { after_last: laid - last.laid, lasted };
        self.observed += interval.after_last;
        let turns = self.turns(interval);
        let kept = 1.0 - ((one.laid_s - last.laid_s) / MEMORY_S).min(1.0);
        for (Hypothesis { bead, log_ratio, .. }, turn) in self.hypotheses.iter_mut().zip(&turns) {
            *log_ratio = *log_ratio * kept + bead.update(turn, one);
        }
        self.weigh();
    }

    /// How the harmonic of every hypothesis turns to an interval. Only those of the longest octave are
    /// computed: half the period is twice the angle.
    fn turns(&self, to: LaidInterval) -> Vec<Turn> {
        let mut turns: Vec<Turn> = Vec::with_capacity(self.hypotheses.len());
        for one in &self.hypotheses {
            let octave = turns.len().checked_sub(PERIODS_IN_OCTAVE.into());
            let twice_as_long = octave.and_then(|at| turns.get(at)).filter(|_| one.bead.pulsates());
            turns.push(twice_as_long.map_or_else(|| one.bead.turn(to), Turn::doubled));
        }
        turns
    }

    /// A time \[s\] in the unit of the period; none where no pulse is counted.
    fn phases(&self, time_s: Range<f64>) -> Option<Range<f64>> {
        let Some(counter) = &self.counter else { return Some(time_s) };
        counter.over(&time_s)
    }

    /// What is laid between two times \[s\]; none before the first width, and where no pulse is
    /// counted.
    fn laid_between(&self, from_s: f64, to_s: f64) -> Option<LaidInterval> {
        let Range { start, end } = self.phases(from_s..to_s)?;
        let after_last = 0.5 * (start + end) - self.last?.laid;
        Some(LaidInterval { after_last, lasted: end - start })
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
        let laid = self.laid_between(from_s, to_s);
        let Some((laid, last)) = laid.zip(self.last) else { return steady };
        let mut expected = steady;
        let square_of_steady = steady.exponent_variance + steady.exponent.powi(2);
        let mut square = square_of_steady;
        for Hypothesis { bead, weight, .. } in self.pulsating() {
            let is_seen = bead.kept_over(last.lasted).abs() > MIN_KEPT;
            let pulsation = if is_seen { bead.mean(laid) } else { 0.0 };
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
        let Some(laid) = self.laid_between(from_s, to_s) else { return 0.0 };
        self.pulsating().map(|one| one.weight * one.bead.mean(laid)).sum()
    }

    /// Variance of that mean: of every hypothesis, and between them.
    pub fn variance(&self, from_s: f64, to_s: f64) -> f64 {
        let Some(laid) = self.laid_between(from_s, to_s) else { return 0.0 };
        let mean = self.mean(from_s, to_s);
        let squares: f64 =
            self.pulsating().map(|one| one.weight * one.bead.mean_square(laid)).sum();
        (squares - mean * mean).max(0.0)
    }

    /// Whether a pulsation is more probable than none.
    pub fn is_found(&self) -> bool {
        self.pulsating().map(|hypothesis| hypothesis.weight).sum::<f64>() > 0.5
    }

    /// Period of the most probable pulsation \[s\]; none where no pulsation is more probable.
    pub fn period_s(&self) -> Option<f64> {
        let best = self.pulsating().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        let seconds = self.counter.as_ref().map_or(Some(1.0), PulseCounter::period_s)?;
        self.is_found().then(|| best.bead.period() * seconds)
    }

    /// The hypotheses of a pulsation that count. A bead without one has no period that has passed.
    fn pulsating(&self) -> impl Iterator<Item = &Hypothesis> {
        let has_passed = |one: &Hypothesis| self.observed > MIN_PERIODS * one.bead.period();
        self.hypotheses.iter().filter(move |one| one.weight > MIN_WEIGHT && has_passed(one))
    }
}

impl Hypothesis {
    fn new(bead: PulsatingBead) -> Self {
        Self { bead, log_ratio: 0.0, weight: 0.0 }
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

    const EXPONENT: Exponent = Exponent { prior: 0.25, learns: true };

    fn watch(seconds: u32, rate_hz: u32, wave: impl Fn(f64) -> f64) -> (FlowPulsation, f64) {
        let mut pulsation = FlowPulsation::new(EXPONENT, None);
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
            let mut pulsation = FlowPulsation::new(EXPONENT, None);
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
