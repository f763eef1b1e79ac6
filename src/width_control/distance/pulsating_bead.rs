//! A bead whose flow pulsates with a known period: a Kalman filter on ln A, on b and on the two
//! components of the harmonic. They are estimated together: a wrong b is an error of the level
//! where the speed changes, and would be taken for a pulsation.
//!
//! The period and all lengths of time have one unit: seconds, or pulses of a screw.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2, TAU};

use nalgebra::{Matrix4, UnitComplex, Vector4};

use super::exponent::Exponent;
use super::width_model::{MAX_SQUARED_INNOVATION, MIN_LN_SPEED_DIFFERENCE, WiderExponent};

/// Initial standard deviation of either component, as a fraction of the width: pulsations of
/// a pump or a screw are a few percent.
const AMPLITUDE_SIGMA: f64 = 0.03;
/// Random walk of either component: standard deviation over a radian. A larger value follows
/// a pulsation that changes and takes more noise for one.
const DRIFT_PER_ROOT_RAD: f64 = 2e-4;
/// Initial standard deviation of the level.
const LEVEL_SIGMA: f64 = 0.1;

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

/// A piece of bead by when it was laid, in the unit of the period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LaidInterval {
    /// From the middle of the last width's piece to the middle of this one.
    pub after_last: f64,
    /// How long it took.
    pub lasted: f64,
}

/// By how much a harmonic turns from the last width to this one, and what this one shows of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    by: UnitComplex<f64>,
    rad: f64,
    /// What the mean over the gauge keeps of the amplitude; negative where it inverts it.
    kept: f64,
    cos_half_gauge: f64,
}

impl Turn {
    /// Of a harmonic with twice the frequency: faster than computing it from the interval.
    pub fn doubled(&self) -> Self {
        Self {
            by: self.by * self.by,
            rad: 2.0 * self.rad,
            kept: self.kept * self.cos_half_gauge,
            cos_half_gauge: 2.0 * self.cos_half_gauge * self.cos_half_gauge - 1.0,
        }
    }
}

/// State: ln A, b, and the components of the harmonic at phase 0 and a quarter of a period later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulsatingBead {
    rad_per_unit: f64,
    /// Its drift over the stated one, as a variance.
    drift_ratio: f64,
    /// Of the last width.
    phase: UnitComplex<f64>,
    exponent: Exponent,
    state: Vector4<f64>,
    covariance: Matrix4<f64>,
    known: bool,
}

impl PulsatingBead {
    /// For a period; infinite for a bead without pulsation. Its flow drifts `drift_ratio` times as much
    /// as stated, as a variance.
    pub fn new(period: f64, drift_ratio: f64, exponent: Exponent) -> Self {
        let bead = Self {
            rad_per_unit: TAU / period,
            drift_ratio,
            phase: UnitComplex::identity(),
            exponent,
            state: Vector4::new(0.0, exponent.prior, 0.0, 0.0),
            covariance: Matrix4::zeros(),
            known: false,
        };
        bead.begin(exponent.prior_variance())
    }

    /// Before the first width of a bead: of all that was known, b remains.
    pub fn begin_again(self) -> Self {
        self.begin(self.covariance.m22)
    }

    fn begin(mut self, exponent_variance: f64) -> Self {
        let part = if self.pulsates() { AMPLITUDE_SIGMA * AMPLITUDE_SIGMA } else { 0.0 };
        let spread = Vector4::new(LEVEL_SIGMA * LEVEL_SIGMA, exponent_variance, part, part);
        self.state = Vector4::new(0.0, self.state.y, 0.0, 0.0);
        self.covariance = Matrix4::from_diagonal(&spread);
        self.known = false;
        self
    }

    /// Whether it has a pulsation.
    pub fn pulsates(&self) -> bool {
        self.rad_per_unit > 0.0
    }

    /// Its period.
    pub fn period(&self) -> f64 {
        TAU / self.rad_per_unit
    }

    /// How its harmonic turns to an interval.
    pub fn turn(&self, to: LaidInterval) -> Turn {
        let rad = self.rad_per_unit * to.after_last;
        let (sin, cos) = libm::sincos(rad);
        let half = 0.5 * self.rad_per_unit * to.lasted;
        let (sin_half, cos_half_gauge) = libm::sincos(half);
        let kept = if half.abs() < 1e-9 { 1.0 } else { sin_half / half };
        Turn { by: UnitComplex::from_cos_sin_unchecked(cos, sin), rad, kept, cos_half_gauge }
    }

    /// Adds a width. Returns its log likelihood, without the constant.
    pub fn update(&mut self, turn: &Turn, one: &PulsationSample) -> f64 {
        let PulsationSample { ln_width, ln_speed, variance, drift, .. } = *one;
        if !self.known {
            self.known = true;
            self.state.x = ln_width + self.state.y * ln_speed;
            let both = ln_speed * self.covariance.m22;
            (self.covariance.m12, self.covariance.m21) = (both, both);
            self.covariance.m11 += ln_speed * both;
            return 0.0;
        }
        self.phase *= turn.by;
        let harmonic = turn.kept * self.phase.as_ref();
        let covariance = self.drifted(turn.rad, drift);
        let predicts = Vector4::new(1.0, -ln_speed, harmonic.re, harmonic.im);
        let informs = Vector4::new(1.0, -self.informing_speed(ln_speed), harmonic.re, harmonic.im);
        let informed = covariance * informs;
        let total = informs.dot(&informed).max(0.0) + variance;
        let by = ln_width - predicts.dot(&self.state);
        let squared = by * by / total;
        let excess = squared / MAX_SQUARED_INNOVATION;
        let gain = informed / total;
        self.state += gain * if excess > 1.0 { by / excess.sqrt() } else { by };
        self.covariance = covariance - gain * informed.transpose();
        self.exponent.keep_in_range(&mut self.state, &mut self.covariance);
        -0.5 * (squared.min(MAX_SQUARED_INNOVATION) + ln(total))
    }

    /// ln(v/v₀) by which a width informs b: near the speed at which the width is known best, that
    /// speed, which says nothing of b.
    fn informing_speed(&self, ln_speed: f64) -> f64 {
        let (both, exponent) = (self.covariance.m12, self.covariance.m22);
        if exponent <= 0.0 {
            return ln_speed;
        }
        let known_best = both / exponent;
        if (ln_speed - known_best).abs() > MIN_LN_SPEED_DIFFERENCE { ln_speed } else { known_best }
    }

    /// The covariance after an angle in which ln A has drifted by a variance.
    fn drifted(&self, rad: f64, drift: f64) -> Matrix4<f64> {
        let part = 2.0 * DRIFT_PER_ROOT_RAD * DRIFT_PER_ROOT_RAD * rad;
        let drifts = Vector4::new(drift * self.drift_ratio, 0.0, part, part);
        self.covariance + Matrix4::from_diagonal(&drifts)
    }

    /// ln A without the pulsation.
    pub fn level(&self) -> f64 {
        self.state.x
    }

    /// b.
    pub fn exponent(&self) -> f64 {
        self.state.y
    }

    /// Variance of b.
    pub fn exponent_variance(&self) -> f64 {
        self.covariance.m22
    }

    /// The flow has stepped: ln A has changed.
    pub fn shift(&mut self, by: f64) {
        self.state.x += by;
    }

    /// ln A may have changed by a variance.
    pub fn loosen(&mut self, variance: f64) {
        self.covariance.m11 += variance;
    }

    /// b is less certain.
    pub fn widen_exponent(&mut self, by: &WiderExponent) {
        by.widen(&mut self.covariance);
    }

    /// What a mean over a time keeps of the amplitude; negative where it inverts it.
    pub fn kept_over(&self, lasted: f64) -> f64 {
        self.turn(LaidInterval { after_last: 0.0, lasted }).kept
    }

    /// The pulsation of ln w in its mean over an interval.
    pub fn mean(&self, over: LaidInterval) -> f64 {
        self.harmonic(over).dot(&self.state)
    }

    /// Expected square of that mean.
    pub fn mean_square(&self, over: LaidInterval) -> f64 {
        let harmonic = self.harmonic(over);
        harmonic.dot(&self.state).powi(2) + harmonic.dot(&(self.covariance * harmonic))
    }

    /// By how much the state acts as a pulsation in the mean over an interval.
    fn harmonic(&self, over: LaidInterval) -> Vector4<f64> {
        let turn = self.turn(over);
        let phase = self.phase * turn.by;
        Vector4::new(0.0, 0.0, phase.re, phase.im) * turn.kept
    }
}

/// ln x for x > 0 with an error below 3e-8, in half the time of `libm::log`. Derived: for
/// x = m·2^e and z = (m − √½)/(m + √½), at most 0.172, ln x = (e − ½)·ln 2 + 2 artanh z; the series of
/// artanh ends before z⁹/9.
fn ln(x: f64) -> f64 {
    let (mantissa, exponent) = libm::frexp(x);
    let z = (mantissa - FRAC_1_SQRT_2) / (mantissa + FRAC_1_SQRT_2);
    let square = z * z;
    let series = 1.0 + square * (1.0 / 3.0 + square * (1.0 / 5.0 + square * (1.0 / 7.0)));
    (f64::from(exponent) - 0.5) * LN_2 + 2.0 * z * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash;

    const EXPONENT: Exponent = Exponent { prior: 0.25, learns: true };

    fn sample(ln_width: f64, ln_speed: f64) -> PulsationSample {
        let (laid_s, lasted_s) = (0.0, 0.0);
        PulsationSample { laid_s, lasted_s, ln_width, ln_speed, variance: 1e-6, drift: 1e-9 }
    }

    fn after(after_last: f64) -> LaidInterval {
        LaidInterval { after_last, lasted: 0.0 }
    }

    fn add(bead: &mut PulsatingBead, laid: LaidInterval, sample: &PulsationSample) {
        let _ = bead.update(&bead.turn(laid), sample);
    }

    #[test]
    fn the_fast_logarithm_is_a_logarithm() {
        for k in -4000..4000 {
            let x = 2.0_f64.powf(0.01 * f64::from(k));
            assert!((ln(x) - libm::log(x)).abs() < 3e-8, "{x}");
        }
    }

    #[test]
    fn half_the_period_turns_twice_as_far() {
        let interval = LaidInterval { after_last: 0.37, lasted: 0.8 };
        let turn = |period| PulsatingBead::new(period, 1.0, EXPONENT).turn(interval);
        let (doubled, computed) = (turn(2.0).doubled(), turn(1.0));
        assert!((doubled.by.as_ref() - computed.by.as_ref()).norm() < 1e-12);
        assert!((doubled.kept - computed.kept).abs() < 1e-12);
        assert!((doubled.cos_half_gauge - computed.cos_half_gauge).abs() < 1e-12);
        assert_eq!(doubled.rad, computed.rad);
    }

    #[test]
    fn a_pulsation_of_its_period_is_predicted() {
        let period = 2.3;
        let truth = |at: f64| 3.7 + 0.02 * (TAU * at / period + 0.4).sin();
        let mut bead = PulsatingBead::new(period, 1.0, EXPONENT);
        for k in 0..600 {
            add(&mut bead, after(0.02), &sample(truth(0.02 * f64::from(k)), 0.0));
        }
        let last = 0.02 * 599.0;
        for ahead in [0.0, 0.5, 1.3] {
            let found = bead.mean(after(ahead)) - (truth(last + ahead) - 3.7);
            assert!(found.abs() < 1e-4, "{ahead}: {found}");
        }
        let mean = bead.mean(LaidInterval { after_last: 0.2 + 0.5 * period, lasted: period });
        assert!(mean.abs() < 1e-9, "a whole period has no mean: {mean}");
    }

    #[test]
    fn a_change_of_the_speed_in_a_pulsation_shows_the_exponent() {
        let (period, exponent) = (2.3, 0.32);
        let mut bead = PulsatingBead::new(period, 1.0, EXPONENT);
        for k in 0..600 {
            let at = 0.02 * f64::from(k);
            let ln_speed = if at < 1.5 { 0.0 } else { -0.4 };
            let ln_width = 3.7 - exponent * ln_speed + 0.02 * (TAU * at / period).sin();
            add(&mut bead, after(0.02), &sample(ln_width, ln_speed));
        }
        assert!((bead.exponent() - exponent).abs() < 2e-3, "{bead:?}");
        assert!((bead.level() - 3.7).abs() < 1e-3);
    }

    #[test]
    fn noise_of_a_constant_speed_says_nothing_of_the_exponent() {
        let mut bead = PulsatingBead::new(2.3, 1.0, EXPONENT);
        for k in 0..2000 {
            let [speed_noise, width_noise] = hash::normal_pair(hash::mix(&[5, k]));
            add(&mut bead, after(0.1), &sample(3.7 + 0.001 * width_noise, 0.002 * speed_noise));
        }
        assert!((bead.exponent() - EXPONENT.prior).abs() < 0.01, "{}", bead.exponent());
        assert!(bead.exponent_variance() > 0.8 * EXPONENT.prior_variance());
    }

    #[test]
    fn a_steady_bead_has_no_pulsation() {
        let mut bead = PulsatingBead::new(f64::INFINITY, 1.0, EXPONENT);
        for k in 0..100 {
            add(&mut bead, after(0.1), &sample(3.7 + 0.01 * f64::from(k % 2), 0.0));
        }
        assert_eq!(bead.mean(after(0.3)), 0.0);
    }

    #[test]
    fn a_mean_over_a_gauge_is_less_than_the_pulsation_at_the_nozzle() {
        let (period, lasted) = (2.0, 0.8);
        let half = 0.5 * TAU * lasted / period;
        let truth = |at: f64| 0.02 * (TAU * at / period).sin();
        let mut bead = PulsatingBead::new(period, 1.0, EXPONENT);
        for k in 0..600 {
            let seen = 3.7 + truth(0.02 * f64::from(k)) * half.sin() / half;
            add(&mut bead, LaidInterval { after_last: 0.02, lasted }, &sample(seen, 0.0));
        }
        let off = bead.mean(after(0.5)) - truth(0.02 * 599.0 + 0.5);
        assert!(off.abs() < 1e-4, "{off}");
    }

    #[test]
    fn of_the_bead_before_only_the_exponent_remains() {
        let mut bead = PulsatingBead::new(2.0, 1.0, EXPONENT);
        for k in 0..100 {
            let ln_speed = if k < 50 { 0.0 } else { -0.4 };
            add(&mut bead, after(0.1), &sample(3.7 - 0.3 * ln_speed, ln_speed));
        }
        let again = bead.begin_again();
        assert_eq!(again.exponent(), bead.exponent());
        assert_eq!(again.mean(after(0.0)), 0.0);
    }
}
