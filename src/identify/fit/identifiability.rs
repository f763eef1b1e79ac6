//! Whether the data determine the parameters of a fit, and which they leave open.

use nalgebra::{Complex, DMatrix};

use super::loose::Loose;
use super::named::Named;
use super::problem::Problem;
use super::spread::Spread;
use crate::numeric::lti::polynomial;

/// By how many standard errors a coefficient must differ from zero.
const SEEN_SIGMAS: f64 = 2.0;
/// A pole and a zero that are closer than this share of their size all but
/// cancel.
const CANCELS: f64 = 0.3;
/// Parameters that move by this share of the one that moves most belong to a
/// combination.
const MOVES: f64 = 0.1;

/// What the data leave open; none where they determine everything.
pub(super) fn loose(
    problem: &Problem,
    theta: &[f64],
    spread: &Spread,
    named: &Named,
    turn: &DMatrix<f64>,
) -> Option<Loose> {
    let last = problem.layout().poles_from + problem.poles - 1;
    let sigma = spread.coloured[(last, last)].max(0.0).sqrt();
    if sigma.is_nan() || SEEN_SIGMAS * sigma >= theta[last].abs() {
        let (poles, coefficient) = (problem.poles, theta[last]);
        return Some(Loose::Pole { poles, coefficient, sigma, pair: pair(problem, theta) });
    }
    let (gain, sigma) = (theta[0], spread.coloured[(0, 0)].max(0.0).sqrt());
    if sigma.is_nan() || SEEN_SIGMAS * sigma >= gain.abs() {
        return Some(Loose::Gain { gain, sigma });
    }
    if let Some(late) = loose_dead_time(problem, theta, spread) {
        return Some(late);
    }
    let direction = spread.loose.as_ref()?;
    let names = together(direction, named, turn);
    Some(Loose::Together { names, pair: pair(problem, theta) })
}

/// A dead time whose standard error is beyond itself and beyond the slowest time
/// constant, which no controller could go by.
fn loose_dead_time(problem: &Problem, theta: &[f64], spread: &Spread) -> Option<Loose> {
    let place = problem.layout().dead_time?;
    let (dead_time_s, sigma_s) = (theta[place], spread.coloured[(place, place)].max(0.0).sqrt());
    let poles = polynomial::roots(&problem.den(theta));
    let slowest_s = poles.iter().map(|pole| 1.0 / pole.norm()).fold(0.0, f64::max);
    let is_loose = sigma_s.is_nan() || sigma_s > dead_time_s.max(slowest_s);
    is_loose.then_some(Loose::DeadTime { dead_time_s, sigma_s })
}

/// The reported parameters that move along the direction which nothing holds.
fn together(direction: &[f64], named: &Named, turn: &DMatrix<f64>) -> Vec<String> {
    let moves = |i: usize| {
        let sum: f64 = direction.iter().enumerate().map(|(j, by)| turn[(i, j)] * by).sum();
        (sum / named.values[i]).abs()
    };
    let moved: Vec<f64> = (0..named.names.len()).map(moves).collect();
    let most = moved.iter().copied().filter(|by| by.is_finite()).fold(0.0, f64::max);
    let names = named.names.iter().zip(&moved);
    names.filter(|(_, by)| **by >= MOVES * most).map(|(name, _)| name.clone()).collect()
}

/// The pole and the zero that are closest to each other, if they all but cancel.
fn pair(problem: &Problem, theta: &[f64]) -> Option<(f64, f64)> {
    let model = problem.transfer(theta)?;
    let apart = |pole: &Complex<f64>, zero: &Complex<f64>| (pole - zero).norm() / pole.norm();
    let zeros = polynomial::roots(model.num());
    let pairs = polynomial::roots(model.den()).into_iter();
    let pairs = pairs.flat_map(|pole| zeros.iter().map(move |zero| (pole, *zero)));
    let nearest = pairs.min_by(|a, b| apart(&a.0, &a.1).total_cmp(&apart(&b.0, &b.1)))?;
    let near = apart(&nearest.0, &nearest.1) < CANCELS;
    near.then_some((nearest.0.re, nearest.1.re))
}
