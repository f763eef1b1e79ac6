//! ln A and b of a bead w = A·(v/v₀)^−b, as a filter knows them.

use nalgebra::{Matrix4, Vector4};

/// Standard deviation of ln A after the first width, which may be an outlier.
const FIRST_SIGMA: f64 = 0.1;
/// Initial standard deviation of b, as a fraction of it. Exponents of beads range from 0.2 to
/// 1, so a stated one may be far off.
const EXPONENT_SIGMA: f64 = 0.4;
/// Range of b, as factors on its initial value. Too small an exponent makes control too
/// aggressive, so the lower end is nearer.
const EXPONENT_RANGE: (f64, f64) = (0.7, 2.2);
/// Largest standard deviation of b at an end of its range, as a fraction of its initial value.
const SIGMA_AT_RANGE_END: f64 = 0.3;
/// Variance of a constant exponent: a covariance with it can be inverted. Derived: a standard deviation
/// of 10⁻⁷ moves no width by what a camera sees.
const CONSTANT_VARIANCE: f64 = 1e-14;
/// Smallest difference of ln v to the best known speed at which a width shows b: noise of
/// reported speeds below it would bias b towards 0 (errors in variables).
const MIN_LN_SPEED_DIFFERENCE: f64 = 0.015;

/// The exponent as the cell states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponent {
    /// Its value.
    pub prior: f64,
    /// Whether it is estimated from the widths.
    pub learns: bool,
}

/// ln A, b and two components that the filter adds, with their covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadEstimate {
    /// The four components.
    pub state: Vector4<f64>,
    /// Their covariance.
    pub covariance: Matrix4<f64>,
    exponent: Exponent,
    is_known: bool,
}

/// An exponent that is less certain, about the width at a speed, which is as certain as it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WiderExponent {
    /// ln(v/v₀) of that speed.
    pub ln_speed: f64,
    /// By how much the variance of b grows.
    pub variance: f64,
}

impl BeadEstimate {
    /// Before the first width: a variance of 1 says that ln A is not known. The components that the
    /// filter adds are 0 with a variance.
    pub fn new(exponent: Exponent, added: f64) -> Self {
        let of_b = if exponent.learns {
            (EXPONENT_SIGMA * exponent.prior).powi(2)
        } else {
            CONSTANT_VARIANCE
        };
        let spread = Vector4::new(1.0, of_b, added, added);
        Self {
            state: Vector4::new(0.0, exponent.prior, 0.0, 0.0),
            covariance: Matrix4::from_diagonal(&spread),
            exponent,
            is_known: false,
        }
    }

    /// The first width: ln w of bead that was laid at ln(v/v₀).
    pub fn begin(&mut self, ln_width: f64, ln_speed: f64) {
        self.state.x = ln_width + self.exponent() * ln_speed;
        let both = ln_speed * self.covariance.m22;
        (self.covariance.m12, self.covariance.m21) = (both, both);
        self.covariance.m11 = FIRST_SIGMA * FIRST_SIGMA + ln_speed * both;
        self.is_known = true;
    }

    /// Whether there was a first width.
    pub fn is_known(&self) -> bool {
        self.is_known
    }

    /// ln A, A in mm.
    pub fn ln_width(&self) -> f64 {
        self.state.x
    }

    /// b.
    pub fn exponent(&self) -> f64 {
        self.state.y
    }

    /// ln(v/v₀) of the speed at which the width is known best.
    pub fn best_known(&self) -> f64 {
        self.covariance.m12 / self.covariance.m22
    }

    /// Whether a width at ln(v/v₀) shows b.
    pub fn shows_exponent(&self, ln_speed: f64) -> bool {
        (ln_speed - self.best_known()).abs() > MIN_LN_SPEED_DIFFERENCE
    }

    /// ln A has changed, and is less certain by a variance.
    pub fn shift(&mut self, by: f64, variance: f64) {
        self.state.x += by;
        self.covariance.m11 += variance;
    }

    /// b is less certain.
    pub fn widen_exponent(&mut self, by: &WiderExponent) {
        let slopes = Vector4::new(by.ln_speed, 1.0, 0.0, 0.0);
        self.covariance += slopes * slopes.transpose() * by.variance;
    }

    /// Clamps b to its range, and moves the others along the correlation. The range of a constant
    /// exponent is its value.
    pub fn keep_exponent_in_range(&mut self) {
        let Exponent { prior, learns } = self.exponent;
        let (min, max) = if learns { EXPONENT_RANGE } else { (1.0, 1.0) };
        let within = self.state.y.clamp(min * prior, max * prior);
        if within != self.state.y {
            let variance = self.covariance.m22;
            let slopes = self.covariance.column(1) / variance;
            self.state += slopes * (within - self.state.y);
            self.state.y = within;
            self.covariance -= slopes * slopes.transpose() * variance;
            self.covariance.m22 = variance.min((SIGMA_AT_RANGE_END * prior).powi(2));
        }
    }
}
