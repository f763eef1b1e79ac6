//! Transfer functions in continuous time with a dead time.

use nalgebra::Complex;

use super::polynomial::{self, evaluate, multiply, trim};

/// Why a model is invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A coefficient or time is NaN or infinite.
    #[error("{what} is {value}; a model needs finite numbers")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// A zero denominator.
    #[error("the denominator is zero")]
    NoDenominator,
    /// More zeros than poles.
    #[error(
        "{zeros} zeros and only {poles} poles: it differentiates its input; put a filter of at \
         least {} poles in series",
        .zeros - .poles
    )]
    Improper {
        /// Degree of the numerator.
        zeros: usize,
        /// Degree of the denominator.
        poles: usize,
    },
    /// A negative dead time.
    #[error("a dead time of {seconds} s; it cannot be negative")]
    NegativeDeadTime {
        /// What was found \[s\].
        seconds: f64,
    },
    /// A number that must be above zero.
    #[error("{what} is {value}; it must be above zero")]
    NotPositive {
        /// Which number.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// An unstable inverse.
    #[error(
        "a zero at {re:.4} ± {im:.4}i 1/s in the right half plane becomes an unstable pole of the \
         inverse"
    )]
    InverseUnstable {
        /// Its real part \[1/s\].
        re: f64,
        /// Size of its imaginary part \[1/s\].
        im: f64,
    },
    /// An integrator has no steady state for an input other than zero.
    #[error("a model with a pole at zero integrates and has no steady state")]
    NoSteadyState,
    /// A dead time that is not a whole number of steps, for a method that needs one.
    #[error(
        "the dead time of {dead_time_s} s is {steps:.3} steps of {dt_s} s; this method keeps \
         whole steps only: take a hold, or round the dead time"
    )]
    PartOfAStep {
        /// Dead time \[s\].
        dead_time_s: f64,
        /// Dead time in steps.
        steps: f64,
        /// Step \[s\].
        dt_s: f64,
    },
}

/// b(s)/a(s)·e^(−Ls), with no more zeros than poles.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferFunction {
    num: Vec<f64>,
    den: Vec<f64>,
    dead_time_s: f64,
}

impl TransferFunction {
    /// From numerator and denominator, highest power of s \[1/s\] first, and a dead time \[s\].
    /// Fails where a number is not finite, the denominator is zero, there are more zeros than poles
    /// or the dead time is negative.
    pub fn new(num: &[f64], den: &[f64], dead_time_s: f64) -> Result<Self, ModelError> {
        let bad = |row: &[f64]| row.iter().copied().find(|c| !c.is_finite());
        if let Some(value) = bad(num) {
            return Err(ModelError::NotFinite { what: "a coefficient of the numerator", value });
        }
        if let Some(value) = bad(den) {
            return Err(ModelError::NotFinite { what: "a coefficient of the denominator", value });
        }
        if !dead_time_s.is_finite() {
            return Err(ModelError::NotFinite { what: "the dead time", value: dead_time_s });
        }
        if dead_time_s < 0.0 {
            return Err(ModelError::NegativeDeadTime { seconds: dead_time_s });
        }
        let (num, den) = (trim(num), trim(den));
        if den.iter().all(|c| *c == 0.0) {
            return Err(ModelError::NoDenominator);
        }
        let (zeros, poles) = (num.len().saturating_sub(1), den.len() - 1);
        if zeros > poles {
            return Err(ModelError::Improper { zeros, poles });
        }
        let num = if num.is_empty() { vec![0.0] } else { num.to_vec() };
        Ok(Self { num, den: den.to_vec(), dead_time_s })
    }

    /// A gain without dynamics. Fails where it is not finite.
    pub fn gain(gain: f64) -> Result<Self, ModelError> {
        Self::new(&[gain], &[1.0], 0.0)
    }

    /// Numerator, highest power first, without leading zeros.
    pub fn num(&self) -> &[f64] {
        &self.num
    }

    /// Denominator, highest power first, without leading zeros.
    pub fn den(&self) -> &[f64] {
        &self.den
    }

    /// Dead time \[s\].
    pub fn dead_time_s(&self) -> f64 {
        self.dead_time_s
    }

    /// The transfer function with another dead time \[s\].
    pub fn with_dead_time(&self, dead_time_s: f64) -> Result<Self, ModelError> {
        Self::new(&self.num, &self.den, dead_time_s)
    }

    /// Number of poles.
    pub fn order(&self) -> usize {
        self.den.len() - 1
    }

    /// Value at s \[1/s\], with the dead time.
    pub fn at(&self, s: Complex<f64>) -> Complex<f64> {
        let delay = -s * self.dead_time_s;
        let (sin, cos) = libm::sincos(delay.im);
        let turn = Complex::new(cos, sin) * libm::exp(delay.re);
        evaluate(&self.num, s) / evaluate(&self.den, s) * turn
    }

    /// Frequency response at ω \[rad/s\].
    pub fn at_frequency(&self, rad_per_s: f64) -> Complex<f64> {
        self.at(Complex::new(0.0, rad_per_s))
    }

    /// Static gain; infinite for an integrator.
    pub fn dc_gain(&self) -> f64 {
        let last = |row: &[f64]| row.last().copied().unwrap_or(0.0);
        last(&self.num) / last(&self.den)
    }

    /// Poles \[1/s\].
    pub fn poles(&self) -> Vec<Complex<f64>> {
        polynomial::roots(&self.den)
    }

    /// Zeros \[1/s\].
    pub fn zeros(&self) -> Vec<Complex<f64>> {
        polynomial::roots(&self.num)
    }

    /// Whether all poles have a negative real part.
    pub fn is_stable(&self) -> bool {
        polynomial::is_hurwitz(&self.den)
    }

    /// This and another one in series; dead times add. Equal poles and zeros are not cancelled.
    pub fn series(&self, other: &Self) -> Result<Self, ModelError> {
        Self::new(
            &multiply(&self.num, &other.num),
            &multiply(&self.den, &other.den),
            self.dead_time_s + other.dead_time_s,
        )
    }

    /// The inverse without the dead time in series with a filter, whose poles make it proper:
    /// the result in series with this is the filter after the dead time. Fails where the filter
    /// has too few poles or a zero is in the right half plane.
    pub fn inverse_through(&self, filter: &Self) -> Result<Self, ModelError> {
        if self.num.iter().all(|c| *c == 0.0) {
            return Err(ModelError::NoDenominator);
        }
        if let Some(zero) = self.zeros().iter().find(|zero| zero.re >= 0.0) {
            return Err(ModelError::InverseUnstable { re: zero.re, im: zero.im.abs() });
        }
        Self::new(
            &multiply(&self.den, &filter.num),
            &multiply(&self.num, &filter.den),
            filter.dead_time_s,
        )
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// Screw speed over drive voltage.
    fn drive() -> TransferFunction {
        TransferFunction::new(&[439.0, 35.08], &[1.523, 11.44, 1.0], 0.054).unwrap()
    }

    #[test]
    fn poles_zeros_and_gain_are_the_published_ones() {
        let g1 = drive();
        let mut poles: Vec<f64> = g1.poles().iter().map(|pole| pole.re).collect();
        poles.sort_by(f64::total_cmp);
        assert!((poles[0] + 7.43).abs() < 0.01 && (poles[1] + 0.09).abs() < 0.005, "{poles:?}");
        assert!((g1.zeros()[0].re + 0.08).abs() < 0.001);
        assert!((g1.dc_gain() - 35.08).abs() < 1e-12);
        assert!(g1.is_stable());
    }

    #[test]
    fn a_dead_time_turns_the_phase_and_leaves_the_size() {
        let with = drive();
        let without = with.with_dead_time(0.0).unwrap();
        let turned = with.at_frequency(3.0) / without.at_frequency(3.0);
        assert!((turned.norm() - 1.0).abs() < 1e-12);
        assert!((turned.arg() + 3.0 * 0.054).abs() < 1e-12);
    }

    #[test]
    fn an_inverse_in_series_with_its_plant_is_the_filter_after_the_dead_time() {
        let wheel = TransferFunction::new(&[2.517], &[0.0377, 1.0], 0.009).unwrap();
        let filter = TransferFunction::new(&[1.0], &[0.01, 1.0], 0.0).unwrap();
        let both = wheel.inverse_through(&filter).unwrap().series(&wheel).unwrap();
        let wanted = filter.with_dead_time(0.009).unwrap();
        for w in [0.1, 10.0, 300.0] {
            assert!((both.at_frequency(w) - wanted.at_frequency(w)).norm() < 1e-12);
        }
        let short = wheel.inverse_through(&TransferFunction::gain(1.0).unwrap());
        assert_eq!(short, Err(ModelError::Improper { zeros: 1, poles: 0 }));
    }

    #[test]
    fn what_is_no_model_is_refused() {
        let new = TransferFunction::new;
        assert_eq!(new(&[1.0], &[0.0, 0.0], 0.0), Err(ModelError::NoDenominator));
        assert_eq!(new(&[1.0], &[], 0.0), Err(ModelError::NoDenominator));
        assert_eq!(new(&[1.0], &[1.0], -0.1), Err(ModelError::NegativeDeadTime { seconds: -0.1 }));
        assert!(matches!(new(&[f64::NAN], &[1.0], 0.0), Err(ModelError::NotFinite { .. })));
        let words = new(&[1.0, 0.0, 0.0], &[1.0], 0.0).unwrap_err().to_string();
        assert!(words.contains("at least 2 poles"), "{words}");
        let right = new(&[-1.0, 1.0], &[1.0, 1.0], 0.0).unwrap();
        assert!(matches!(
            right.inverse_through(&TransferFunction::gain(1.0).unwrap()),
            Err(ModelError::InverseUnstable { re: 1.0, im: 0.0 })
        ));
    }
}
