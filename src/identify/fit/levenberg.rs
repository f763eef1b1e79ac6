//! Least squares of a model's parameters: in one go those that act in proportion,
//! and by Levenberg's and Marquardt's steps within ranges the others.

use nalgebra::{DMatrix, DVector};

use super::linear::{least_squares, normal_matrix};
use super::problem::FitProblem;
use super::row::dot;
use super::settings::OutputLevel;
use crate::numeric::number::to_f64;

/// Where the steps ended.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    pub theta: Vec<f64>,
    /// Sum of the squared residuals.
    pub sum_of_squares: f64,
}

/// Puts the parameters that act in proportion where they fit best.
pub(super) fn solve_linear(problem: &FitProblem, theta: &mut [f64]) -> Option<f64> {
    let (numbers, columns) = problem.linear_columns(theta)?;
    let known = match problem.level {
        OutputLevel::Known(level) => level,
        OutputLevel::Estimated => 0.0,
    };
    let target: Vec<f64> = problem.output.iter().map(|y| y - known).collect();
    let found = least_squares(&columns, &target)?;
    let mut left = target;
    for ((number, value), column) in numbers.into_iter().zip(&found).zip(&columns) {
        theta[number] = *value;
        for (left, c) in left.iter_mut().zip(column) {
            *left -= value * c;
        }
    }
    Some(dot(&left, &left))
}

fn residuals(problem: &FitProblem, theta: &[f64]) -> Option<Vec<f64>> {
    let predicted = problem.predict(theta)?;
    Some(problem.output.iter().zip(&predicted).map(|(y, p)| y - p).collect())
}

/// Steps downhill from a start until nothing is gained. `None` where the start
/// is no stable model.
pub(super) fn minimise(problem: &FitProblem, start: &[f64], max_steps: usize) -> Option<Minimum> {
    let mut theta = start.to_vec();
    problem.project(&mut theta);
    let mut left = residuals(problem, &theta)?;
    let mut squares = dot(&left, &left);
    let mut damping = 1e-3;
    // Less than this of the residuals' variance tells nothing about a parameter.
    let nothing = 1e-5 / to_f64(left.len());
    let mut idle = 0;
    for _ in 0..max_steps {
        let scales = problem.scales(&theta);
        let Some(columns) = problem.jacobian(&theta, &scales) else { break };
        let slope: Vec<f64> = columns.iter().map(|c| dot(c, &left)).collect();
        let normal = held_normal(problem, &theta, &columns, &slope);
        let before = squares;
        for _ in 0..12 {
            let Some(step) = damped(&normal, damping) else {
                damping *= 10.0;
                continue;
            };
            let mut next = theta.clone();
            for (value, step) in next.iter_mut().zip(&step) {
                *value += step;
            }
            problem.project(&mut next);
            let tried = residuals(problem, &next).map(|left| (dot(&left, &left), left));
            match tried {
                Some((less, new)) if less < squares => {
                    (theta, squares, left) = (next, less, new);
                    damping = (damping * 0.1).max(1e-12);
                    break;
                }
                _ => damping *= 10.0,
            }
        }
        idle = if before - squares <= nothing * before { idle + 1 } else { 0 };
        if idle == 2 || squares == before {
            break;
        }
    }
    Some(Minimum { theta, sum_of_squares: squares })
}

/// Normal equations of the parameters that may move.
struct Normal {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
    sizes: Vec<f64>,
}

/// A parameter at an end of its range that would go beyond is held.
fn held_normal(problem: &FitProblem, theta: &[f64], columns: &[Vec<f64>], slope: &[f64]) -> Normal {
    let sizes: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(f64::MIN_POSITIVE)).collect();
    let mut matrix = normal_matrix(columns, &sizes);
    let mut right = DVector::from_fn(columns.len(), |i, _| slope[i] / sizes[i]);
    for number in 0..theta.len() {
        let [least, most] = problem.range(theta, number);
        let out = (theta[number] <= least && slope[number] < 0.0)
            || (theta[number] >= most && slope[number] > 0.0);
        if out {
            matrix.row_mut(number).fill(0.0);
            matrix.column_mut(number).fill(0.0);
            matrix[(number, number)] = 1.0;
            right[number] = 0.0;
        }
    }
    Normal { matrix, right, sizes }
}

fn damped(normal: &Normal, damping: f64) -> Option<Vec<f64>> {
    let mut matrix = normal.matrix.clone();
    for i in 0..matrix.nrows() {
        matrix[(i, i)] *= 1.0 + damping;
    }
    let step = matrix.cholesky()?.solve(&normal.right);
    let step: Vec<f64> = step.iter().zip(&normal.sizes).map(|(x, size)| x / size).collect();
    step.iter().all(|x| x.is_finite()).then_some(step)
}
