//! Whether the data determine the parameters of a fit.

use nalgebra::{Complex, DMatrix};

use super::named::NamedParameters;
use super::problem::FitProblem;
use super::spread::Covariances;
use super::undetermined::Undetermined;
use crate::numeric::lti::polynomial;

/// Standard errors by which a coefficient must differ from zero. Derived: a normal error
/// exceeds them with a probability of 4.6 %.
const MIN_SIGMAS: f64 = 2.0;
/// Relative distance below which a pole and a zero nearly cancel.
const MAX_CANCELLING_DISTANCE: f64 = 0.3;
/// Relative change of a parameter over the largest one from which it belongs to a combination.
const MIN_RELATIVE_MOVE: f64 = 0.1;

/// What the data do not determine; `None` where they determine everything.
pub(super) fn undetermined(
    problem: &FitProblem,
    theta: &[f64],
    spread: &Covariances,
    named: &NamedParameters,
    turn: &DMatrix<f64>,
) -> Option<Undetermined> {
    let last = problem.layout().denominator_from + problem.poles - 1;
    let sigma = spread.correlated[(last, last)].max(0.0).sqrt();
    if sigma.is_nan() || MIN_SIGMAS * sigma >= theta[last].abs() {
        let (poles, coefficient) = (problem.poles, theta[last]);
        return Some(Undetermined::Pole { poles, coefficient, sigma, pair: pair(problem, theta) });
    }
    let (gain, sigma) = (theta[0], spread.correlated[(0, 0)].max(0.0).sqrt());
    if sigma.is_nan() || MIN_SIGMAS * sigma >= gain.abs() {
        return Some(Undetermined::Gain { gain, sigma });
    }
    if let Some(dead_time) = undetermined_dead_time(problem, theta, spread) {
        return Some(dead_time);
    }
    let direction = spread.weak_direction.as_ref()?;
    let names = combination(direction, named, turn);
    Some(Undetermined::Combination { names, pair: pair(problem, theta) })
}

/// A dead time whose standard error exceeds itself and the slowest time constant.
fn undetermined_dead_time(
    problem: &FitProblem,
    theta: &[f64],
    spread: &Covariances,
) -> Option<Undetermined> {
    let index = problem.layout().dead_time?;
    let (dead_time_s, sigma_s) = (theta[index], spread.correlated[(index, index)].max(0.0).sqrt());
    let poles = polynomial::roots(&problem.den(theta));
    let slowest_s = poles.iter().map(|pole| 1.0 / pole.norm()).fold(0.0, f64::max);
    let is_loose = sigma_s.is_nan() || sigma_s > dead_time_s.max(slowest_s);
    is_loose.then_some(Undetermined::DeadTime { dead_time_s, sigma_s })
}

/// The reported parameters that change along the weakest direction.
fn combination(direction: &[f64], named: &NamedParameters, turn: &DMatrix<f64>) -> Vec<String> {
    let moves = |i: usize| {
        let sum: f64 = direction.iter().enumerate().map(|(j, by)| turn[(i, j)] * by).sum();
        (sum / named.values[i]).abs()
    };
    let moved: Vec<f64> = (0..named.names.len()).map(moves).collect();
    let most = moved.iter().copied().filter(|by| by.is_finite()).fold(0.0, f64::max);
    let names = named.names.iter().zip(&moved);
    names.filter(|(_, by)| **by >= MIN_RELATIVE_MOVE * most).map(|(name, _)| name.clone()).collect()
}

/// The pole and the zero that are closest to each other, if they nearly cancel.
fn pair(problem: &FitProblem, theta: &[f64]) -> Option<(f64, f64)> {
    let model = problem.transfer(theta)?;
    let apart = |pole: &Complex<f64>, zero: &Complex<f64>| (pole - zero).norm() / pole.norm();
    let zeros = polynomial::roots(model.num());
    let pairs = polynomial::roots(model.den()).into_iter();
    let pairs = pairs.flat_map(|pole| zeros.iter().map(move |zero| (pole, *zero)));
    let nearest = pairs.min_by(|a, b| apart(&a.0, &a.1).total_cmp(&apart(&b.0, &b.1)))?;
    let near = apart(&nearest.0, &nearest.1) < MAX_CANCELLING_DISTANCE;
    near.then_some((nearest.0.re, nearest.1.re))
}
