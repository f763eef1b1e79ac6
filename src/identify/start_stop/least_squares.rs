//! Least squares of few parameters within ranges, by Levenberg's and
//! Marquardt's steps with differences for derivatives.

use nalgebra::{DMatrix, DVector};

/// Where the steps ended.
#[derive(Debug, Clone)]
pub(super) struct LeastSquares {
    pub at: Vec<f64>,
    /// Sum of the squared residuals.
    pub sum_of_squares: f64,
    /// Standard errors, for residuals that have nothing to do with each other.
    pub sigma: Vec<f64>,
}

const MAX_STEPS: usize = 60;
/// A parameter is moved by this share of its range for a derivative.
const RELATIVE_STEP: f64 = 1e-6;
/// A step that gains less than this share of the squares gains nothing.
const MIN_RELATIVE_GAIN: f64 = 1e-9;

/// Steps downhill from a start, every parameter within its range. `None` where
/// the residuals are not finite or are fewer than the parameters.
pub(super) fn minimise(
    residuals: &dyn Fn(&[f64]) -> Vec<f64>,
    start: &[f64],
    ranges: &[[f64; 2]],
) -> Option<LeastSquares> {
    let mut at: Vec<f64> = start.iter().zip(ranges).map(|(x, [a, b])| x.clamp(*a, *b)).collect();
    let mut left = DVector::from_vec(residuals(&at));
    let mut squares = left.norm_squared();
    if !squares.is_finite() || left.len() < at.len() {
        return None;
    }
    let mut damping = 1e-3;
    for _ in 0..MAX_STEPS {
        let slopes = jacobian(residuals, &at, ranges);
        let before = squares;
        for _ in 0..10 {
            let next = step(&slopes, &left, &at, ranges, damping);
            let tried = next.map(|next| (DVector::from_vec(residuals(&next)), next));
            match tried.filter(|(new, _)| new.norm_squared() < squares) {
                Some((new, next)) => {
                    (squares, left, at) = (new.norm_squared(), new, next);
                    damping = (damping * 0.1).max(1e-12);
                    break;
                }
                None => damping *= 10.0,
            }
        }
        if before - squares <= MIN_RELATIVE_GAIN * before {
            break;
        }
    }
    let sigma = spread(&jacobian(residuals, &at, ranges), squares);
    Some(LeastSquares { at, sum_of_squares: squares, sigma })
}

fn jacobian(
    residuals: &dyn Fn(&[f64]) -> Vec<f64>,
    at: &[f64],
    ranges: &[[f64; 2]],
) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = ranges
        .iter()
        .enumerate()
        .map(|(number, [low, high])| {
            let nudge = RELATIVE_STEP * (high - low);
            let moved = |by: f64| {
                let mut at = at.to_vec();
                if let Some(value) = at.get_mut(number) {
                    *value += by;
                }
                DVector::from_vec(residuals(&at))
            };
            (moved(nudge) - moved(-nudge)) / (2.0 * nudge)
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// One damped step. A parameter at an end of its range that would go beyond is
/// held.
fn step(
    slopes: &DMatrix<f64>,
    left: &DVector<f64>,
    at: &[f64],
    ranges: &[[f64; 2]],
    damping: f64,
) -> Option<Vec<f64>> {
    let mut normal = slopes.transpose() * slopes;
    let mut right = -(slopes.transpose() * left);
    for (number, (value, [low, high])) in at.iter().zip(ranges).enumerate() {
        let down = *right.get(number)?;
        if (value <= low && down < 0.0) || (value >= high && down > 0.0) {
            normal.row_mut(number).fill(0.0);
            normal.column_mut(number).fill(0.0);
            right.row_mut(number).fill(0.0);
        }
        let own = normal.get_mut((number, number))?;
        *own = if *own > 0.0 { *own * (1.0 + damping) } else { 1.0 };
    }
    let by = normal.cholesky()?.solve(&right);
    let next = at.iter().zip(&by).zip(ranges).map(|((x, by), [a, b])| (x + by).clamp(*a, *b));
    Some(next.collect())
}

#[expect(clippy::cast_precision_loss, reason = "fewer than 2^52 samples")]
fn spread(slopes: &DMatrix<f64>, squares: f64) -> Vec<f64> {
    let free = slopes.nrows().saturating_sub(slopes.ncols()).max(1) as f64;
    let inverse = (slopes.transpose() * slopes).try_inverse();
    let variance =
        |number: usize| inverse.as_ref().and_then(|inverse| inverse.get((number, number)).copied());
    let sigma = |number: usize| match variance(number) {
        Some(own) if own > 0.0 => (own * squares / free).sqrt(),
        _ => f64::INFINITY,
    };
    (0..slopes.ncols()).map(sigma).collect()
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
