//! The exponent b of w = A·(v/v₀)^−b: what is known of it before the first width, and its range.

use nalgebra::{Matrix4, Vector4};

/// Initial standard deviation of b, as a fraction of it. Exponents of beads range from 0.2 to
/// 1, so a stated one may be far off.
const SIGMA: f64 = 0.4;
/// Range of b, as factors on its initial value. Too small an exponent makes control too
/// aggressive, so the lower end is nearer.
const RANGE: (f64, f64) = (0.7, 2.2);
/// Largest standard deviation of b at an end of its range, as a fraction of its initial value.
const SIGMA_AT_RANGE_END: f64 = 0.3;
/// Variance of a constant exponent: a covariance with it can be inverted. Derived: a standard deviation
/// of 10⁻⁷ moves no width by what a camera sees.
const CONSTANT_VARIANCE: f64 = 1e-14;

/// The exponent as the cell states it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponent {
    /// Its value.
    pub prior: f64,
    /// Whether it is estimated from the widths.
    pub learns: bool,
}

impl Exponent {
    /// Its variance before the first width.
    pub fn variance(&self) -> f64 {
        if self.learns { (SIGMA * self.prior).powi(2) } else { CONSTANT_VARIANCE }
    }

    /// Clamps b, the second component of a state, to its range, and moves the others along the
    /// correlation. The range of a constant exponent is its value.
    pub fn keep_in_range(&self, state: &mut Vector4<f64>, covariance: &mut Matrix4<f64>) {
        let (min, max) = if self.learns { RANGE } else { (1.0, 1.0) };
        let within = state.y.clamp(min * self.prior, max * self.prior);
        if within != state.y {
            let variance = covariance.m22;
            let slopes = covariance.column(1) / variance;
            *state += slopes * (within - state.y);
            state.y = within;
            *covariance -= slopes * slopes.transpose() * variance;
            covariance.m22 = variance.min((SIGMA_AT_RANGE_END * self.prior).powi(2));
        }
    }
}
