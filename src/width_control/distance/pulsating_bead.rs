//! A bead whose flow pulsates with a known frequency: a Kalman filter on ln A, on b and on the two
//! components of the harmonic. They are estimated together: a wrong b is an error of the level
//! where the speed changes, and would be taken for a pulsation.
//!
//! Times are in the unit of the period: seconds, or pulses of a screw.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2, TAU};
use std::ops::Range;

use nalgebra::{Complex, Matrix4, Vector2, Vector4};

use super::estimate::{BeadEstimate, Exponent};
use super::width_model::{MAX_SQUARED_INNOVATION, WidthObservation};

/// Initial standard deviation of either component, as a fraction of the width: pulsations of
/// a pump or a screw are a few percent.
const AMPLITUDE_SIGMA: f64 = 0.03;
/// Random walk of either component: standard deviation over a radian. A larger value follows
/// a pulsation that changes and takes more noise for one.
const DRIFT_PER_ROOT_RAD: f64 = 2.8e-4;
/// Shortest time over which a mean is computed. A shorter one counts as this: the value at a point.
/// Derived: a millionth of the unit turns no phase by what a width shows.
const MIN_LASTED: f64 = 1e-6;

/// The phases of a harmonic at the ends of a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phases {
    start: Complex<f64>,
    end: Complex<f64>,
    /// By how much it turns in between \[rad\].
    turned: f64,
}

impl Phases {
    /// Of a harmonic with twice the frequency: faster than computing them.
    pub fn doubled(&self) -> Self {
        Self { start: self.start * self.start, end: self.end * self.end, turned: 2.0 * self.turned }
    }

    /// What a mean over the time shows of either component; nothing without a pulsation.
    fn mean(&self) -> Vector2<f64> {
        let mean = (self.end - self.start) / self.turned;
        if self.turned > 0.0 { Vector2::new(mean.im, -mean.re) } else { Vector2::zeros() }
    }
}

/// State: ln A, b, and the components of the harmonic at phase 0 and a quarter of a period later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulsatingBead {
    rad_per_unit: f64,
    /// Its drift over the stated one, as a variance.
    drift_ratio: f64,
    exponent: Exponent,
    /// What is known of it.
    pub estimate: BeadEstimate,
}

impl PulsatingBead {
    /// For a frequency; 0 for a bead without pulsation. Its flow drifts `drift_ratio` times as much as
    /// stated, as a variance.
    pub fn new(frequency: f64, drift_ratio: f64, exponent: Exponent) -> Self {
        let part = if frequency > 0.0 { AMPLITUDE_SIGMA * AMPLITUDE_SIGMA } else { 0.0 };
        Self {
            rad_per_unit: TAU * frequency,
            drift_ratio,
            exponent,
            estimate: BeadEstimate::new(exponent, part),
        }
    }

    /// Before the first width of a bead: of all that was known, b remains.
    pub fn begin_again(&mut self) {
        let before = self.estimate;
        *self = Self::new(self.frequency(), self.drift_ratio, self.exponent);
        self.estimate.state.y = before.state.y;
        self.estimate.covariance.m22 = before.covariance.m22;
    }

    /// Whether it has a pulsation.
    pub fn pulsates(&self) -> bool {
        self.rad_per_unit > 0.0
    }

    /// Its frequency.
    pub fn frequency(&self) -> f64 {
        self.rad_per_unit / TAU
    }

    /// The phases of its harmonic at the ends of a time.
    pub fn phases(&self, over: &Range<f64>) -> Phases {
        let lasted = (over.end - over.start).max(MIN_LASTED);
        let at = |time: f64| {
            let (sin, cos) = libm::sincos(self.rad_per_unit * time);
            Complex::new(cos, sin)
        };
        let turned = self.rad_per_unit * lasted;
        Phases { start: at(over.start), end: at(over.start + lasted), turned }
    }

    /// Adds a width with the phases at the ends of its gauge, `passed` after the last one, over which ln
    /// A has drifted by a variance. Returns its log likelihood, without the constant.
    pub fn update(
        &mut self,
        observation: &WidthObservation,
        phases: &Phases,
        passed: f64,
        drift: f64,
    ) -> f64 {
        let WidthObservation { ln_width, ln_speed, variance, .. } = *observation;
        if !self.estimate.is_known() {
            self.estimate.begin(ln_width, ln_speed);
            return 0.0;
        }
        let harmonic = phases.mean();
        let covariance = self.drifted(passed, drift);
        let predicts = Vector4::new(1.0, -ln_speed, harmonic.x, harmonic.y);
        let informs = Vector4::new(1.0, -self.informing_speed(ln_speed), harmonic.x, harmonic.y);
        let informed = covariance * informs;
        let total = informs.dot(&informed).max(0.0) + variance;
        let by = ln_width - predicts.dot(&self.estimate.state);
        let squared = by * by / total;
        let excess = squared / MAX_SQUARED_INNOVATION;
        let gain = informed / total;
        self.estimate.state += gain * if excess > 1.0 { by / excess.sqrt() } else { by };
        self.estimate.covariance = covariance - gain * informed.transpose();
        self.estimate.keep_exponent_in_range();
        -0.5 * (squared.min(MAX_SQUARED_INNOVATION) + ln(total))
    }

    /// ln(v/v₀) by which a width informs b: near the speed at which the width is known best, that
    /// speed, which says nothing of b.
    fn informing_speed(&self, ln_speed: f64) -> f64 {
        let estimate = &self.estimate;
        if estimate.shows_exponent(ln_speed) { ln_speed } else { estimate.best_known() }
    }

    /// The covariance after a time in which ln A has drifted by a variance.
    fn drifted(&self, passed: f64, drift: f64) -> Matrix4<f64> {
        let part = DRIFT_PER_ROOT_RAD * DRIFT_PER_ROOT_RAD * self.rad_per_unit * passed;
        let drifts = Vector4::new(drift * self.drift_ratio, 0.0, part, part);
        self.estimate.covariance + Matrix4::from_diagonal(&drifts)
    }

    /// The pulsation of ln w in its mean over a time.
    pub fn mean(&self, over: &Range<f64>) -> f64 {
        self.phases(over).mean().dot(&self.estimate.state.fixed_rows::<2>(2))
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

    fn width(ln_width: f64, ln_speed: f64) -> WidthObservation {
        WidthObservation { ln_width, ln_speed, ln_speed_beside: [0.0; 2], variance: 1e-6 }
    }

    /// Adds a width at a point.
    fn add(bead: &mut PulsatingBead, at: f64, width: &WidthObservation) {
        let _ = bead.update(width, &bead.phases(&(at..at)), 0.02, 1e-9);
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
        let mean = |frequency| PulsatingBead::new(frequency, 1.0, EXPONENT).phases(&(3.1..3.9));
        assert!((mean(0.5).doubled().mean() - mean(1.0).mean()).norm() < 1e-12);
    }

    #[test]
    fn a_pulsation_of_its_period_is_predicted() {
        let period = 2.3;
        let truth = |at: f64| 3.7 + 0.02 * (TAU * at / period + 0.4).sin();
        let mut bead = PulsatingBead::new(1.0 / period, 1.0, EXPONENT);
        for k in 0..600 {
            let at = 0.02 * f64::from(k);
            add(&mut bead, at, &width(truth(at), 0.0));
        }
        for at in [12.0, 12.5, 13.3] {
            let found = bead.mean(&(at..at)) - (truth(at) - 3.7);
            assert!(found.abs() < 1e-4, "{at}: {found}");
        }
        let mean = bead.mean(&(12.2..12.2 + period));
        assert!(mean.abs() < 1e-9, "a whole period has no mean: {mean}");
    }

    #[test]
    fn a_change_of_the_speed_in_a_pulsation_shows_the_exponent() {
        let (period, exponent) = (2.3, 0.32);
        let mut bead = PulsatingBead::new(1.0 / period, 1.0, EXPONENT);
        for k in 0..600 {
            let at = 0.02 * f64::from(k);
            let ln_speed = if at < 1.5 { 0.0 } else { -0.4 };
            let ln_width = 3.7 - exponent * ln_speed + 0.02 * (TAU * at / period).sin();
            add(&mut bead, at, &width(ln_width, ln_speed));
        }
        assert!((bead.estimate.exponent() - exponent).abs() < 2e-3, "{bead:?}");
        assert!((bead.estimate.ln_width() - 3.7).abs() < 1e-3);
    }

    #[test]
    fn noise_of_a_constant_speed_says_nothing_of_the_exponent() {
        let mut bead = PulsatingBead::new(1.0 / 2.3, 1.0, EXPONENT);
        for k in 0..2000_u32 {
            let [speed_noise, width_noise] = hash::normal_pair(hash::mix(&[5, u64::from(k)]));
            let at = 0.1 * f64::from(k);
            add(&mut bead, at, &width(3.7 + 0.001 * width_noise, 0.002 * speed_noise));
        }
        assert!(
            (bead.estimate.exponent() - EXPONENT.prior).abs() < 0.01,
            "{}",
            bead.estimate.exponent()
        );
        assert!(bead.estimate.covariance.m22 > 0.8 * (0.4 * EXPONENT.prior).powi(2));
    }

    #[test]
    fn a_steady_bead_has_no_pulsation() {
        let mut bead = PulsatingBead::new(0.0, 1.0, EXPONENT);
        for k in 0..100 {
            add(&mut bead, 0.1 * f64::from(k), &width(3.7 + 0.01 * f64::from(k % 2), 0.0));
        }
        assert_eq!(bead.mean(&(10.0..10.3)), 0.0);
    }

    #[test]
    fn a_mean_over_a_gauge_is_less_than_the_pulsation_at_the_nozzle() {
        let (period, lasted) = (2.0, 0.8);
        let half = 0.5 * TAU * lasted / period;
        let truth = |at: f64| 0.02 * (TAU * at / period).sin();
        let mut bead = PulsatingBead::new(1.0 / period, 1.0, EXPONENT);
        for k in 0..600 {
            let at = 0.02 * f64::from(k);
            let seen = 3.7 + truth(at) * half.sin() / half;
            let gauge = at - 0.5 * lasted..at + 0.5 * lasted;
            let _ = bead.update(&width(seen, 0.0), &bead.phases(&gauge), 0.02, 1e-9);
        }
        let off = bead.mean(&(12.5..12.5)) - truth(12.5);
        assert!(off.abs() < 1e-4, "{off}");
    }

    #[test]
    fn of_the_bead_before_only_the_exponent_remains() {
        let mut bead = PulsatingBead::new(0.5, 1.0, EXPONENT);
        for k in 0..100 {
            let ln_speed = if k < 50 { 0.0 } else { -0.4 };
            add(&mut bead, 0.1 * f64::from(k), &width(3.7 - 0.3 * ln_speed, ln_speed));
        }
        let before = bead;
        bead.begin_again();
        assert_eq!(bead.estimate.exponent(), before.estimate.exponent());
        assert_eq!(bead.mean(&(10.0..10.0)), 0.0);
    }
}
