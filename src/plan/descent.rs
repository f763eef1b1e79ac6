//! From a first choice to the best one near it: the change that a convex problem asks for,
//! as far as it really helps, and again.

use super::flow::KNOT_S;
use super::horizon::{Evaluation, Horizon, Iterate};
use super::subproblem::{Bounds, solve_subproblem};

/// Rounds at most.
const MAX_ROUNDS: usize = 25;
/// A round that gains less than this share is the last.
const MIN_RELATIVE_GAIN: f64 = 2e-3;
/// How far a round may change the square of a speed, as a share of it: at first and at
/// most, and below which nothing more is tried.
const MAX_TRUST_RADIUS: f64 = 0.6;
const MIN_TRUST_RADIUS: f64 = 5e-3;
/// Shares of a change that are tried.
const STEP_FRACTIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// Goes on from a choice that keeps the bounds until nothing is gained any more. All
/// that come of it keep them too. `None` where the first choice is none.
pub fn descend(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    first: Iterate,
) -> Option<(Iterate, Evaluation)> {
    let mut iterate = first;
    let mut outcome = horizon.evaluate(&iterate)?;
    let mut trust_radius = MAX_TRUST_RADIUS;
    for _ in 0..MAX_ROUNDS {
        let Some(change) = solve_subproblem(horizon, bounds, &iterate, &outcome, trust_radius)
        else {
            break;
        };
        let Some((next, better, fraction)) =
            line_search(horizon, bounds, &iterate, &outcome, &change)
        else {
            trust_radius *= 0.25;
            if trust_radius < MIN_TRUST_RADIUS {
                break;
            }
            continue;
        };
        let gain = 1.0 - better.cost / outcome.cost;
        (iterate, outcome) = (next, better);
        if gain < MIN_RELATIVE_GAIN {
            break;
        }
        trust_radius = if fraction < 1.0 {
            0.5 * trust_radius
        } else {
            (1.5 * trust_radius).min(MAX_TRUST_RADIUS)
        };
    }
    Some((iterate, outcome))
}

/// The largest share of a change that costs less.
fn line_search(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    iterate: &Iterate,
    outcome: &Evaluation,
    change: &Iterate,
) -> Option<(Iterate, Evaluation, f64)> {
    STEP_FRACTIONS.iter().find_map(|fraction| {
        let next = within_bounds(horizon, bounds, iterate, change, *fraction)?;
        let better = horizon.evaluate(&next)?;
        (better.cost < outcome.cost).then_some((next, better, *fraction))
    })
}

/// A share of a change, within the bounds to the last digit: the solver keeps them to its
/// own tolerance only.
fn within_bounds(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    iterate: &Iterate,
    change: &Iterate,
    fraction: f64,
) -> Option<Iterate> {
    let limits = bounds.floor.iter().zip(&bounds.ceiling);
    let squares = iterate.squares.iter().zip(&change.squares).zip(limits);
    let squares: Vec<f64> =
        squares.map(|((b, d), (low, high))| (b + fraction * d).clamp(*low, *high)).collect();
    let (min, max) = bounds.drive.range();
    let most = bounds.drive.rate_per_s() * KNOT_S;
    let mut before = horizon.extruder.command();
    let knots = iterate.knots.iter().zip(&change.knots).map(|(u, d)| {
        before = (u + fraction * d).clamp(before - most, before + most).clamp(min, max);
        before
    });
    let knots = knots.collect();
    Some(Iterate {
        squares: within_time(horizon, bounds, within_acceleration(horizon, bounds, squares))?,
        knots,
    })
}

/// Lowered where the acceleration is too much by the solver's tolerance.
fn within_acceleration(horizon: &Horizon<'_>, bounds: &Bounds, mut squares: Vec<f64>) -> Vec<f64> {
    super::limits::limit_acceleration(&horizon.path, &mut squares, bounds.accel);
    squares
}

/// As much nearer to the highest speeds as the time asks for. The time is convex in the
/// squares, so that a mixture never takes longer than the mean of both.
fn within_time(horizon: &Horizon<'_>, bounds: &Bounds, squares: Vec<f64>) -> Option<Vec<f64>> {
    let here = horizon.profile(&squares)?.duration_s();
    if here <= bounds.longest_s {
        return Some(squares);
    }
    let fastest = horizon.profile(&bounds.ceiling)?.duration_s();
    let fraction = ((here - bounds.longest_s) / (here - fastest)).clamp(0.0, 1.0);
    let mixed = squares.iter().zip(&bounds.ceiling);
    Some(mixed.map(|(b, high)| b + fraction * (high - b)).collect())
}
