//! Sequential quadratic programming from a first iterate: the solution of a convex subproblem, with
//! a line search and a trust region.

use super::flow::KNOT_S;
use super::horizon::{Evaluation, Horizon, Iterate};
use super::subproblem::{Bounds, solve_subproblem};

/// Largest number of iterations; most plans converge in fewer.
const MAX_ROUNDS: usize = 25;
/// Relative decrease of the cost below which the iteration ends. A smaller one costs time for no
/// visible difference of the width.
const MIN_RELATIVE_GAIN: f64 = 2e-3;
/// Initial and largest trust radius: relative change of the square of a speed in an iteration.
const MAX_TRUST_RADIUS: f64 = 0.6;
/// Trust radius below which the iteration ends.
const MIN_TRUST_RADIUS: f64 = 5e-3;
/// Step fractions of the line search.
const STEP_FRACTIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// Iterates from a first iterate within the bounds until the cost no longer falls. All iterates are
/// within the bounds. `None` where the first iterate is not valid.
pub fn descend(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    first: Iterate,
) -> Option<(Iterate, Evaluation)> {
    let mut iterate = first;
    let mut evaluation = horizon.evaluate(&iterate)?;
    let mut trust_radius = MAX_TRUST_RADIUS;
    for _ in 0..MAX_ROUNDS {
        let Some(change) = solve_subproblem(horizon, bounds, &iterate, &evaluation, trust_radius)
        else {
            break;
        };
        let Some((next, better, fraction)) =
            line_search(horizon, bounds, &iterate, &evaluation, &change)
        else {
            trust_radius *= 0.25;
            if trust_radius < MIN_TRUST_RADIUS {
                break;
            }
            continue;
        };
        let gain = 1.0 - better.cost / evaluation.cost;
        (iterate, evaluation) = (next, better);
        if gain < MIN_RELATIVE_GAIN {
            break;
        }
        trust_radius = if fraction < 1.0 {
            0.5 * trust_radius
        } else {
            (1.5 * trust_radius).min(MAX_TRUST_RADIUS)
        };
    }
    Some((iterate, evaluation))
}

/// The largest fraction of a change that lowers the cost.
fn line_search(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    iterate: &Iterate,
    evaluation: &Evaluation,
    change: &Iterate,
) -> Option<(Iterate, Evaluation, f64)> {
    STEP_FRACTIONS.iter().find_map(|fraction| {
        let next = within_bounds(horizon, bounds, iterate, change, *fraction)?;
        let better = horizon.evaluate(&next)?;
        (better.cost < evaluation.cost).then_some((next, better, *fraction))
    })
}

/// A fraction of a change, exactly within the bounds: the solver keeps them only to its tolerance.
fn within_bounds(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    iterate: &Iterate,
    change: &Iterate,
    fraction: f64,
) -> Option<Iterate> {
    let limits = bounds.floor.iter().zip(&bounds.ceiling);
    let squares = iterate.squares.iter().zip(&change.squares).zip(limits);
    let mut squares: Vec<f64> =
        squares.map(|((b, d), (low, high))| (b + fraction * d).clamp(*low, *high)).collect();
    super::limits::limit_acceleration(&horizon.path, &mut squares, bounds.accel);
    let (min, max) = bounds.drive.range();
    let max_change = bounds.drive.rate_per_s() * KNOT_S;
    let mut before = horizon.extruder.command();
    let knots = iterate.knots.iter().zip(&change.knots).map(|(u, d)| {
        before = (u + fraction * d).clamp(before - max_change, before + max_change).clamp(min, max);
        before
    });
    let knots = knots.collect();
    Some(Iterate { squares: within_time(horizon, bounds, squares)?, knots })
}

/// Squares that are moved towards the highest speeds as far as the time limit needs. The time is
/// convex in the squares, so a mixture never takes longer than the weighted mean of both.
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
