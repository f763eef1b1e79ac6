//! Nonlinear least squares within ranges (Levenberg 1944, Marquardt 1963): the diagonal of
//! the normal equations is raised by a factor 1 + λ until a step lowers the sum of squares.

use nalgebra::DVector;

use super::linear::{normal_matrix, norms};
use super::row::dot;

/// λ at first. Marquardt 1963 suggests 1e-2; the starts here are near the minimum and need less.
const INITIAL_DAMPING: f64 = 1e-3;
/// λ is not lowered further: below it the factor 1 + λ differs from 1 by rounding only.
const MIN_DAMPING: f64 = 1e-12;
/// Factor ν by which λ is raised or lowered (Marquardt 1963).
const DAMPING_STEP: f64 = 10.0;

/// The damping λ.
#[derive(Debug, Clone, Copy)]
pub struct Damping {
    value: f64,
    max: f64,
}

impl Damping {
    /// At its initial value; no step is tried with `max` or more.
    pub fn up_to(max: f64) -> Self {
        Self { value: INITIAL_DAMPING, max }
    }

    /// The first accepted step of at most `tries`, each with ten times the damping of the one
    /// before. The next call begins with a tenth of the accepted one. `None` if no step is
    /// accepted.
    pub fn descend<T>(
        &mut self,
        tries: usize,
        mut step: impl FnMut(f64) -> Option<T>,
    ) -> Option<T> {
        for _ in 0..tries {
            if self.value >= self.max {
                return None;
            }
            if let Some(next) = step(self.value) {
                self.value = (self.value * (1.0 / DAMPING_STEP)).max(MIN_DAMPING);
                return Some(next);
            }
            self.value *= DAMPING_STEP;
        }
        None
    }
}

/// A model, its data and the ranges of its parameters.
pub trait LeastSquares {
    /// Data less prediction; `None` for parameters that are not admissible.
    fn residuals(&self, at: &[f64]) -> Option<Vec<f64>>;

    /// Derivatives of the prediction, a column for each parameter; `None` where there are none.
    fn jacobian(&self, at: &[f64]) -> Option<Vec<Vec<f64>>>;

    /// Smallest and largest value of a parameter; may depend on the others.
    fn range(&self, at: &[f64], number: usize) -> [f64; 2];

    /// Moves every parameter into its range.
    fn project(&self, at: &mut [f64]) {
        for number in 0..at.len() {
            let [least, most] = self.range(at, number);
            at[number] = at[number].clamp(least, most);
        }
    }
}

/// When a descent ends.
#[derive(Debug, Clone, Copy)]
pub struct Descent {
    /// Largest number of steps.
    pub max_steps: usize,
    /// Values of the damping that are tried for a step.
    pub max_tries: usize,
    /// A step that lowers the sum of squares by no more than this fraction gains nothing.
    pub min_relative_gain: f64,
    /// Ends after this many steps in a row without gain.
    pub max_idle_steps: usize,
}

/// Where a descent ended.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// The parameters.
    pub theta: Vec<f64>,
    /// Sum of the squared residuals.
    pub sum_of_squares: f64,
}

/// Descends from a start. `None` where the start is not admissible.
pub fn minimise(problem: &impl LeastSquares, start: &[f64], descent: Descent) -> Option<Minimum> {
    let mut theta = start.to_vec();
    problem.project(&mut theta);
    let mut left = problem.residuals(&theta)?;
    let mut sum_of_squares = dot(&left, &left);
    let mut damping = Damping::up_to(f64::INFINITY);
    let mut idle = 0;
    for _ in 0..descent.max_steps {
        let Some(columns) = problem.jacobian(&theta) else { break };
        let step = step_of(problem, &theta, &columns, &left);
        let next = damping.descend(descent.max_tries, |damping| {
            let mut next = theta.clone();
            next.iter_mut().zip(step(damping)?).for_each(|(value, by)| *value += by);
            problem.project(&mut next);
            let left = problem.residuals(&next)?;
            let squares = dot(&left, &left);
            (squares < sum_of_squares).then_some((next, left, squares))
        });
        let Some((next, new, squares)) = next else { break };
        let gain = sum_of_squares - squares;
        idle = if gain <= descent.min_relative_gain * sum_of_squares { idle + 1 } else { 0 };
        (theta, left, sum_of_squares) = (next, new, squares);
        if idle == descent.max_idle_steps {
            break;
        }
    }
    Some(Minimum { theta, sum_of_squares })
}

/// The damped step as a function of the damping. A parameter that would leave its range, or
/// that has no effect, is held.
fn step_of<P: LeastSquares>(
    problem: &P,
    theta: &[f64],
    columns: &[Vec<f64>],
    left: &[f64],
) -> impl Fn(f64) -> Option<Vec<f64>> + use<P> {
    let norms = norms(columns);
    let mut matrix = normal_matrix(columns, &norms);
    let mut right = DVector::from_fn(columns.len(), |i, _| dot(&columns[i], left) / norms[i]);
    for number in 0..theta.len() {
        let [least, most] = problem.range(theta, number);
        let leaves = (theta[number] <= least && right[number] < 0.0)
            || (theta[number] >= most && right[number] > 0.0);
        if leaves || norms[number] <= f64::MIN_POSITIVE {
            matrix.row_mut(number).fill(0.0);
            matrix.column_mut(number).fill(0.0);
            matrix[(number, number)] = 1.0;
            right[number] = 0.0;
        }
    }
    move |damping| {
        let mut matrix = matrix.clone();
        for i in 0..matrix.nrows() {
            matrix[(i, i)] *= 1.0 + damping;
        }
        let step = matrix.cholesky()?.solve(&right);
        let step: Vec<f64> = step.iter().zip(&norms).map(|(x, norm)| x / norm).collect();
        step.iter().all(|x| x.is_finite()).then_some(step)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// The data set Misra1a of the NIST Statistical Reference Datasets: y and x.
    const MISRA1A: [(f64, f64); 14] = [
        (10.07, 77.6),
        (14.73, 114.9),
        (17.94, 141.1),
        (23.93, 190.8),
        (29.61, 239.9),
        (35.18, 289.0),
        (40.02, 332.8),
        (44.82, 378.4),
        (50.76, 434.8),
        (55.05, 477.3),
        (61.01, 536.8),
        (66.40, 593.1),
        (75.47, 689.1),
        (81.78, 760.0),
    ];

    /// y = b1·(1 − exp(−b2·x)).
    struct Misra1a {
        ranges: [[f64; 2]; 2],
    }

    impl LeastSquares for Misra1a {
        fn residuals(&self, at: &[f64]) -> Option<Vec<f64>> {
            Some(MISRA1A.iter().map(|(y, x)| y + at[0] * (-at[1] * x).exp_m1()).collect())
        }

        fn jacobian(&self, at: &[f64]) -> Option<Vec<Vec<f64>>> {
            let column = |of: &dyn Fn(f64) -> f64| MISRA1A.iter().map(|(_, x)| of(*x)).collect();
            let slope = |x: f64| at[0] * x * (-at[1] * x).exp();
            Some(vec![column(&|x| -(-at[1] * x).exp_m1()), column(&slope)])
        }

        fn range(&self, _: &[f64], number: usize) -> [f64; 2] {
            self.ranges[number]
        }
    }

    const DESCENT: Descent =
        Descent { max_steps: 100, max_tries: 12, min_relative_gain: 1e-12, max_idle_steps: 2 };

    #[test]
    fn the_certified_values_of_nist_are_found_from_both_starts() {
        let problem = Misra1a { ranges: [[0.0, 1e4], [0.0, 1.0]] };
        for start in [[500.0, 1e-4], [250.0, 5e-4]] {
            let found = minimise(&problem, &start, DESCENT).unwrap();
            for (value, certified) in [
                (found.theta[0], 2.389_421_291_8e2),
                (found.theta[1], 5.501_564_318_1e-4),
                (found.sum_of_squares, 1.245_513_889_4e-1),
            ] {
                assert!((value / certified - 1.0).abs() < 1e-6, "{value} {certified}");
            }
        }
    }

    #[test]
    fn a_parameter_stays_at_the_end_of_its_range() {
        let problem = Misra1a { ranges: [[0.0, 200.0], [0.0, 1.0]] };
        let found = minimise(&problem, &[150.0, 5e-4], DESCENT).unwrap();
        assert_eq!(found.theta[0], 200.0);
        assert!(found.sum_of_squares > 0.13);
    }

    #[test]
    fn the_damping_rises_tenfold_until_a_step_is_accepted() {
        let mut damping = Damping::up_to(1e2);
        let mut tried = Vec::new();
        let mut accept_from = |least: f64, tries| {
            damping.descend(tries, |value| {
                tried.push(value.log10().round());
                (value >= least).then_some(())
            })
        };
        assert_eq!(accept_from(0.5, 9), Some(()));
        assert_eq!(accept_from(1e9, 2), None);
        assert_eq!(accept_from(1e9, 9), None);
        assert_eq!(tried, [-3.0, -2.0, -1.0, 0.0, -1.0, 0.0, 1.0]);
    }
}
