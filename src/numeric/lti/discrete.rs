//! Discretisation of a transfer function.

use nalgebra::{Complex, DMatrix, DVector};

use super::polynomial::{add, evaluate, from_roots, multiply};
use super::simulate::{Between, Sampled, split};
use super::transfer::{ModelError, TransferFunction};
use crate::numeric::number::to_f64;

/// Method of discretisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiscretisationMethod {
    /// Exact for an input that is held between samples; also with a dead time that ends within
    /// a step.
    ZeroOrderHold,
    /// Exact for an input that is linear between samples; also with any dead time.
    FirstOrderHold,
    /// Tustin's: s = (2/dt)(z − 1)/(z + 1).
    Bilinear,
    /// s = (z − 1)/(dt·z).
    BackwardDifference,
    /// Poles and zeros are mapped to e^(s·dt), missing zeros but one to −1, and the static gain
    /// is kept (with a pole or zero there: the magnitude at 0.1/dt).
    MatchedPoleZero,
}

/// b(z)/a(z)·z^(−delay): coefficients with the highest power first, numerator and denominator
/// of equal length, the denominator with a leading 1.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteTransfer {
    /// Numerator.
    pub num: Vec<f64>,
    /// Denominator.
    pub den: Vec<f64>,
    /// Additional delay in whole steps.
    pub delay: usize,
    /// Step \[s\].
    pub dt_s: f64,
}

impl TransferFunction {
    /// On a grid of `dt_s` \[s\]. Fails where the step is not above zero, and where the dead
    /// time is not a whole number of steps and the method is not a hold.
    pub fn discretise(
        &self,
        dt_s: f64,
        method: DiscretisationMethod,
    ) -> Result<DiscreteTransfer, ModelError> {
        let (delay, rest_s) = split(self.dead_time_s(), dt_s)?;
        let held = matches!(
            method,
            DiscretisationMethod::ZeroOrderHold | DiscretisationMethod::FirstOrderHold
        );
        if rest_s > 0.0 && !held {
            return Err(ModelError::PartOfAStep {
                dead_time_s: self.dead_time_s(),
                steps: self.dead_time_s() / dt_s,
                dt_s,
            });
        }
        let (num, den) = match method {
            DiscretisationMethod::ZeroOrderHold => hold(self, dt_s, Between::Held)?,
            DiscretisationMethod::FirstOrderHold => hold(self, dt_s, Between::Linear)?,
            DiscretisationMethod::Bilinear => {
                let per_s = 2.0 / dt_s;
                substitute(self, &[per_s, -per_s], &[1.0, 1.0])
            }
            DiscretisationMethod::BackwardDifference => {
                substitute(self, &[1.0 / dt_s, -1.0 / dt_s], &[1.0, 0.0])
            }
            DiscretisationMethod::MatchedPoleZero => matched(self, dt_s),
        };
        let length = num.len().max(den.len());
        let padded = |mut row: Vec<f64>| {
            row.resize(length, 0.0);
            row
        };
        Ok(DiscreteTransfer { num: padded(num), den: padded(den), delay, dt_s })
    }
}

/// Coefficients of det(zI − Φ), and the adjoint Σ N(i)·z^(n−1−i) (Faddeev–LeVerrier algorithm).
struct Resolvent {
    den: Vec<f64>,
    adjoint: Vec<DMatrix<f64>>,
}

impl Resolvent {
    fn of(state: &DMatrix<f64>) -> Self {
        let n = state.nrows();
        let mut den = vec![1.0];
        let mut adjoint = Vec::with_capacity(n);
        let mut current = DMatrix::identity(n, n);
        for k in 1..=n {
            let moved = state * &current;
            let coefficient = -moved.trace() / to_f64(k);
            adjoint.push(current);
            den.push(coefficient);
            current = moved + DMatrix::identity(n, n) * coefficient;
        }
        Self { den, adjoint }
    }

    /// Numerator in powers of 1/z of C·(I − Φ/z)^(−1)·g.
    fn num(&self, c: &DVector<f64>, g: &DVector<f64>) -> Vec<f64> {
        self.adjoint.iter().map(|n| c.dot(&(n * g))).collect()
    }
}

/// A row in powers of 1/z, delayed and padded to a length, for sums with `add`.
fn delayed_row(row: &[f64], steps: usize, length: usize) -> Vec<f64> {
    let mut padded = vec![0.0; steps];
    padded.extend_from_slice(row);
    padded.resize(length, 0.0);
    padded
}

fn hold(
    tf: &TransferFunction,
    dt_s: f64,
    between: Between,
) -> Result<(Vec<f64>, Vec<f64>), ModelError> {
    let sampled = Sampled::of(tf, dt_s, between)?;
    let resolvent = Resolvent::of(&sampled.state);
    let order = tf.order();
    let length = order + 2;
    let mut num = vec![0.0; length];
    for (steps, tap) in sampled.taps.iter().enumerate().filter(|(_, tap)| tap.amax() > 0.0) {
        num = add(&num, &delayed_row(&resolvent.num(&sampled.c, tap), steps, length));
    }
    for (steps, through) in sampled.through.iter().enumerate() {
        let straight = multiply(&resolvent.den, &[*through]);
        num = add(&num, &delayed_row(&straight, steps, length));
    }
    if num[order + 1] == 0.0 {
        num.pop();
    }
    Ok((num, resolvent.den))
}

/// Substitutes upper(z)/lower(z) for s.
fn substitute(tf: &TransferFunction, upper: &[f64], lower: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let order = tf.order();
    let power = |row: &[f64], n: usize| (0..n).fold(vec![1.0], |p, _| multiply(&p, row));
    let put = |row: &[f64]| {
        let terms =
            row.iter().rev().enumerate().map(|(i, c)| {
                multiply(&multiply(&power(upper, i), &power(lower, order - i)), &[*c])
            });
        terms.fold(vec![0.0; order + 1], |sum, term| add(&sum, &term))
    };
    let (num, den) = (put(tf.num()), put(tf.den()));
    let lead = den[0];
    (num.iter().map(|c| c / lead).collect(), den.iter().map(|c| c / lead).collect())
}

fn matched(tf: &TransferFunction, dt_s: f64) -> (Vec<f64>, Vec<f64>) {
    let map = |roots: Vec<Complex<f64>>| -> Vec<Complex<f64>> {
        roots.iter().map(|s| exp(s * dt_s)).collect()
    };
    let poles = map(tf.poles());
    let mut zeros = map(tf.zeros());
    let missing = poles.len() - zeros.len();
    zeros.extend((1..missing).map(|_| Complex::new(-1.0, 0.0)));
    let (num, den) = (from_roots(&zeros), from_roots(&poles));
    let without = TransferFunction::with_dead_time(tf, 0.0).unwrap_or_else(|_| tf.clone());
    let ratio = |s: Complex<f64>| {
        let z = exp(s * dt_s);
        without.at(s) * evaluate(&den, z) / evaluate(&num, z)
    };
    let at_rest = ratio(Complex::new(0.0, 0.0));
    let gain = if at_rest.re.is_finite() && at_rest.re != 0.0 {
        at_rest.re
    } else {
        let beside = ratio(Complex::new(0.0, 0.1 / dt_s));
        beside.norm() * beside.re.signum()
    };
    let num: Vec<f64> = num.iter().map(|c| c * gain).collect();
    let first = den.len() - num.len();
    (delayed_row(&num, first, den.len()), den)
}

fn exp(s: Complex<f64>) -> Complex<f64> {
    let (sin, cos) = libm::sincos(s.im);
    Complex::new(cos, sin) * libm::exp(s.re)
}

#[cfg(test)]
mod tests;
