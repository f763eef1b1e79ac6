//! A steady pulsation of the flow by pump or screw: a multiple-model filter with one
//! hypothesis for each frequency and some without a pulsation, weighted by their likelihoods. Where
//! pulses are counted by the speed of a screw, there is one frequency: that of the pulses.

use std::ops::Range;

use super::estimate::{Exponent, WiderExponent};
use super::pulsating_bead::{Phases, PulsatingBead};
use super::pulse_counter::{PulseCounter, ScrewPulses};
use super::width_model::{ExpectedBead, WidthObservation};
use crate::core::Rpm;

/// Shortest and longest period \[s\]. Shorter ones are blurred by the gauge; longer ones are
/// followed as drift.
pub const PERIODS_S: (f64, f64) = (0.55, 10.0);
/// Frequencies in an octave. Derived: over 10 periods a harmonic that is off by half a step, 1 %, loses a
/// tenth of a period.
const FREQUENCIES_IN_OCTAVE: u8 = 35;
/// Drifts of a flow without a pulsation over the stated one, as variances. Without the larger ones a
/// restless flow would be taken for a pulsation.
const DRIFT_RATIOS: [f64; 3] = [1.0, 10.0, 100.0];
/// Prior log odds against a pulsation. A flow change that is not yet detected looks like one
/// for a while; a smaller value accepts it, a larger one finds a pulsation later.
const PRIOR_LOG_ODDS: f64 = 14.0;
/// Time constant of the log likelihoods \[s\]. Derived: two of the longest periods. A larger one
/// gives up a wrong period later.
const MEMORY_S: f64 = 20.0;
/// Log odds, beyond the prior ones, below which a hypothesis sinks no further: one that is true after all
/// has to win them back.
const LEAST_LOG_ODDS: f64 = -2.0 * PRIOR_LOG_ODDS;
/// Hypotheses of smaller weight are left out of sums, for speed.
const MIN_WEIGHT: f64 = 1e-3;
/// Longest time between two widths over which phases are kept \[s\].
const LONGEST_GAP_S: f64 = 3.0;

/// Hypotheses of all frequencies, and of none.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowPulsation {
    hypotheses: Vec<Hypothesis>,
    /// Counts pulses, the unit of the period, where a screw makes them; none where it is seconds.
    counter: Option<PulseCounter>,
    /// When the last width that was used was laid, in the unit of the period.
    last: Option<f64>,
    /// When the newest width was laid, whether it was used or not \[s\].
    seen_s: Option<f64>,
    /// Time over which widths have come, in the unit of the period.
    observed: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Hypothesis {
    bead: PulsatingBead,
    /// Logarithm of its probability, up to a constant that all hypotheses share.
    log_odds: f64,
    weight: f64,
}

impl FlowPulsation {
    /// Before the first width. Without a screw the frequency is searched for.
    pub fn new(exponent: Exponent, screw: Option<ScrewPulses>) -> Self {
        let (shortest, longest) = PERIODS_S;
        let ratio = libm::exp2(1.0 / f64::from(FREQUENCIES_IN_OCTAVE));
        let searched = std::iter::successors(Some(1.0 / longest), |hz| Some(hz * ratio))
            .take_while(|hz| *hz < 1.0 / shortest);
        let frequencies = if screw.is_some() { vec![1.0] } else { searched.collect() };
        let pulsating =
            frequencies.into_iter().map(|frequency| PulsatingBead::new(frequency, 1.0, exponent));
        let steady = DRIFT_RATIOS.map(|ratio| PulsatingBead::new(0.0, ratio, exponent));
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
            one.bead.begin_again();
            *one = Hypothesis::new(one.bead);
        }
    }

    /// A width has come, whether it will be used or not. What was learnt of the probabilities fades.
    /// After a gap, and where no pulse is counted, phases are not known any more.
    pub fn see(&mut self, laid_s: &Range<f64>) {
        let seen = self.seen_s.unwrap_or(laid_s.end);
        let passed_s = (laid_s.end - seen).max(0.0);
        if passed_s > LONGEST_GAP_S || self.phases(laid_s).is_none() {
            self.begin_again();
        }
        self.seen_s = Some(seen + passed_s);
        for one in &mut self.hypotheses {
            one.log_odds += passed_s / MEMORY_S * (one.prior_log_odds() - one.log_odds);
        }
    }

    /// Adds a width that was laid over a time \[s\], and the variance of the drift since the width before
    /// it. One without a phase is not used.
    pub fn update(&mut self, observation: &WidthObservation, laid_s: &Range<f64>, drift: f64) {
        let Some(laid) = self.phases(laid_s) else { return };
        let passed = laid.end - self.last.unwrap_or(laid.end);
        if passed < 0.0 {
            return;
        }
        self.last = Some(laid.end);
        self.observed += passed;
        let phases = self.all_phases(&laid);
        for (one, phases) in self.hypotheses.iter_mut().zip(&phases) {
            one.log_odds += one.bead.update(observation, phases, passed, drift);
        }
        self.weigh();
    }

    /// The phases of all hypotheses at the ends of a time, an octave above others by doubling them.
    fn all_phases(&self, laid: &Range<f64>) -> Vec<Phases> {
        let mut all: Vec<Phases> = Vec::with_capacity(self.hypotheses.len());
        for Hypothesis { bead, .. } in &self.hypotheses {
            let octave_below = all.len().checked_sub(FREQUENCIES_IN_OCTAVE.into());
            let of_half = octave_below.and_then(|at| all.get(at)).filter(|_| bead.pulsates());
            all.push(of_half.map_or_else(|| bead.phases(laid), Phases::doubled));
        }
        all
    }

    /// A time \[s\] in the unit of the period; none where no pulse is counted.
    fn phases(&self, time_s: &Range<f64>) -> Option<Range<f64>> {
        let Some(counter) = &self.counter else { return Some(time_s.clone()) };
        counter.over(time_s)
    }

    fn weigh(&mut self) {
        let all = self.hypotheses.iter().map(|one| one.log_odds);
        let largest = all.fold(f64::NEG_INFINITY, f64::max);
        let mut total = 0.0;
        for one in &mut self.hypotheses {
            let least = LEAST_LOG_ODDS + one.prior_log_odds();
            one.log_odds = (one.log_odds - largest).max(least);
            // For speed: smaller ones are too small for any sum.
            one.weight = if one.log_odds > -PRIOR_LOG_ODDS { libm::exp(one.log_odds) } else { 0.0 };
            total += one.weight;
        }
        for one in &mut self.hypotheses {
            one.weight /= total;
        }
    }

    /// ln A of every hypothesis has changed, and is less certain by a variance.
    pub fn shift(&mut self, by: f64, variance: f64) {
        for one in &mut self.hypotheses {
            one.bead.estimate.shift(by, variance);
        }
    }

    /// b of every hypothesis is less certain.
    pub fn widen_exponent(&mut self, by: &WiderExponent) {
        for one in &mut self.hypotheses {
            one.bead.estimate.widen_exponent(by);
        }
    }

    /// The bead that is laid over a time \[s\]: the mean of all hypotheses. Without a pulsation it is as
    /// `steady` says.
    pub fn bead(&self, laid_s: &Range<f64>, steady: ExpectedBead) -> ExpectedBead {
        let mut expected = steady;
        let Some(laid) = self.phases(laid_s) else { return steady };
        for Hypothesis { bead, weight, .. } in self.pulsating() {
            expected.ln_width +=
                weight * (bead.estimate.ln_width() + bead.mean(&laid) - steady.ln_width);
            expected.exponent += weight * (bead.estimate.exponent() - steady.exponent);
        }
        expected
    }

    /// Mean pulsation of ln w of bead that is laid over a time \[s\].
    pub fn mean(&self, laid_s: &Range<f64>) -> f64 {
        let Some(laid) = self.phases(laid_s) else { return 0.0 };
        self.pulsating().map(|one| one.weight * one.bead.mean(&laid)).sum()
    }

    /// Whether a pulsation is more probable than none.
    pub fn is_found(&self) -> bool {
        self.pulsating().map(|hypothesis| hypothesis.weight).sum::<f64>() > 0.5
    }

    /// Period of the most probable pulsation \[s\]; none where no pulsation is more probable.
    pub fn period_s(&self) -> Option<f64> {
        let best = self.pulsating().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        let seconds = self.counter.as_ref().map_or(Some(1.0), PulseCounter::period_s)?;
        self.is_found().then(|| seconds / best.bead.frequency())
    }

    /// The hypotheses of a pulsation that count, of which a whole period has passed: a part of one may
    /// be a drift.
    fn pulsating(&self) -> impl Iterator<Item = &Hypothesis> {
        let has_passed = |one: &Hypothesis| self.observed * one.bead.frequency() > 1.0;
        self.hypotheses.iter().filter(move |one| one.weight > MIN_WEIGHT && has_passed(one))
    }
}

impl Hypothesis {
    fn new(bead: PulsatingBead) -> Self {
        let mut new = Self { bead, log_odds: 0.0, weight: 0.0 };
        new.log_odds = new.prior_log_odds();
        new
    }

    fn prior_log_odds(&self) -> f64 {
        if self.bead.pulsates() { 0.0 } else { PRIOR_LOG_ODDS }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::sim::hash;

    const EXPONENT: Exponent = Exponent { prior: 0.25, learns: true };

    fn width(ln_width: f64, variance: f64) -> WidthObservation {
        WidthObservation { ln_width, ln_speed: 0.0, ln_speed_beside: [0.0; 2], variance }
    }

    fn watch(seconds: u32, rate_hz: u32, wave: impl Fn(f64) -> f64) -> (FlowPulsation, f64) {
        let mut pulsation = FlowPulsation::new(EXPONENT, None);
        let mut at = 0.0;
        for k in 0..seconds * rate_hz {
            at = f64::from(k) / f64::from(rate_hz);
            let [noise, _] = hash::normal_pair(hash::mix(&[7, u64::from(k)]));
            pulsation.see(&(at..at));
            pulsation.update(
                &width(3.7 + wave(at) + 0.0086 * noise, 0.0086 * 0.0086),
                &(at..at),
                5e-8,
            );
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
            let then = last + 0.8;
            let off = pulsation.mean(&(then..then)) - wave(then);
            assert!(off.abs() < 0.3 * 0.03, "{period}: {off}");
        }
    }

    #[test]
    fn noise_alone_is_no_pulsation() {
        for rate in [10, 50] {
            let (pulsation, last) = watch(40, rate, |_| 0.0);
            assert_eq!(pulsation.period_s(), None);
            let then = last + 0.5;
            assert!(pulsation.mean(&(then..then)).abs() < 1e-3);
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
                let at = 0.1 * f64::from(k);
                let seen = width(ln_width + variance.sqrt() * noise, variance);
                pulsation.see(&(at..at));
                pulsation.update(&seen, &(at..at), drift);
                found += u32::from(pulsation.is_found());
            }
        }
        assert_eq!(found, 0, "of 8000 widths");
    }
}
