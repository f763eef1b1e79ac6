//! Least squares of few parameters within ranges, with difference quotients as derivatives.

use nalgebra::DMatrix;

use crate::numeric::levenberg_marquardt::{self, Descent, LeastSquares};
use crate::numeric::number::to_f64;

/// An estimate and its standard errors.
#[derive(Debug, Clone)]
pub(super) struct Estimate {
    pub at: Vec<f64>,
    /// Sum of the squared residuals.
    pub sum_of_squares: f64,
    /// Standard errors for independent residuals.
    pub sigma: Vec<f64>,
}

/// Step of the difference quotients as a fraction of a parameter's range: a compromise between
/// truncation and rounding.
const RELATIVE_STEP: f64 = 1e-6;
/// Limits of a descent. A choice: a fit of at most four parameters that needs more steps does
/// not converge.
const DESCENT: Descent =
    Descent { max_steps: 60, max_tries: 10, min_relative_gain: 1e-9, max_idle_steps: 1 };

/// Prediction less data as a function of the parameters, and their ranges.
struct Problem<'a> {
    errors: &'a dyn Fn(&[f64]) -> Vec<f64>,
    ranges: &'a [[f64; 2]],
}

impl LeastSquares for Problem<'_> {
    fn residuals(&self, at: &[f64]) -> Option<Vec<f64>> {
        let left: Vec<f64> = (self.errors)(at).iter().map(|error| -error).collect();
        let is_finite = left.iter().map(|left| left * left).sum::<f64>().is_finite();
        (is_finite && left.len() >= at.len()).then_some(left)
    }

    fn jacobian(&self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
        let column = |(number, [low, high]): (usize, &[f64; 2])| {
            let nudge = RELATIVE_STEP * (high - low);
            let moved = |by: f64| {
                let mut at = at.to_vec();
                at[number] += by;
                (self.errors)(&at)
            };
            moved(nudge).iter().zip(moved(-nudge)).map(|(a, b)| (a - b) / (2.0 * nudge)).collect()
        };
        Some(self.ranges.iter().enumerate().map(column).collect())
    }

    fn range(&self, _: &[f64], number: usize) -> [f64; 2] {
        self.ranges[number]
    }
}

/// The parameters, each within its range, with the least sum of squared errors. `None` where
/// the errors at the start are not finite or fewer than the parameters.
pub(super) fn minimise(
    errors: &dyn Fn(&[f64]) -> Vec<f64>,
    start: &[f64],
    ranges: &[[f64; 2]],
) -> Option<Estimate> {
    let problem = Problem { errors, ranges };
    let minimum = levenberg_marquardt::minimise(&problem, start, DESCENT)?;
    let sigma = standard_errors(&problem.jacobian(&minimum.theta)?, minimum.sum_of_squares);
    Some(Estimate { at: minimum.theta, sum_of_squares: minimum.sum_of_squares, sigma })
}

/// Roots of the diagonal of s²·(JᵀJ)⁻¹, with s² the residual variance; infinite where the data
/// do not determine a parameter.
fn standard_errors(columns: &[Vec<f64>], squares: f64) -> Vec<f64> {
    let (n, p) = (columns.first().map_or(0, Vec::len), columns.len());
    let slopes = DMatrix::from_fn(n, p, |row, column| columns[column][row]);
    let free = to_f64(n.saturating_sub(p).max(1));
    let inverse = (slopes.transpose() * slopes).try_inverse();
    let variance = |i: usize| inverse.as_ref().map_or(0.0, |inverse| inverse[(i, i)]);
    let sigma = |own: f64| if own > 0.0 { (own * squares / free).sqrt() } else { f64::INFINITY };
    (0..p).map(|number| sigma(variance(number))).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn a_decay_without_noise_is_found_again() {
        let seen: Vec<(f64, f64)> =
            (0..40).map(|k| f64::from(k) * 0.1).map(|t| (t, 3.0 * (-t / 0.7_f64).exp())).collect();
        let residuals = |p: &[f64]| -> Vec<f64> {
            seen.iter().map(|(t, y)| p[0] * (-t / p[1]).exp() - y).collect()
        };
        let solved = minimise(&residuals, &[1.0, 2.0], &[[0.0, 10.0], [0.01, 10.0]]).unwrap();
        assert!((solved.at[0] - 3.0).abs() < 1e-6 && (solved.at[1] - 0.7).abs() < 1e-6);
        assert!(solved.sum_of_squares < 1e-9);
    }

    #[test]
    fn a_line_has_the_standard_errors_of_the_textbook() {
        let seen = [(0.0, 1.1), (1.0, 2.9), (2.0, 5.2), (3.0, 6.8)];
        let residuals =
            |p: &[f64]| -> Vec<f64> { seen.iter().map(|(x, y)| p[0] + p[1] * x - y).collect() };
        let solved = minimise(&residuals, &[0.0, 0.0], &[[-9.0, 9.0], [-9.0, 9.0]]).unwrap();
        assert!((solved.at[0] - 1.09).abs() < 1e-6 && (solved.at[1] - 1.94).abs() < 1e-6);
        // s² = Σr²/2, var(slope) = s²/Σ(x − x̄)² = s²/5.
        assert!((solved.sigma[1] - (solved.sum_of_squares / 2.0 / 5.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn a_parameter_stays_in_its_range() {
        let residuals = |p: &[f64]| vec![p[0] - 5.0, 0.1 * (p[0] - 5.0)];
        assert_eq!(minimise(&residuals, &[1.0], &[[0.0, 2.0]]).unwrap().at, [2.0]);
        assert!(minimise(&residuals, &[1.0, 1.0, 1.0], &[[0.0, 2.0]; 3]).is_none());
    }
}
