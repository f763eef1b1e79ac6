//! From a first choice to the best one near it: the change that a convex problem asks for,
//! as far as it really helps, and again.

use super::flow::KNOT_S;
use super::horizon::{Choice, Horizon, Outcome};
use super::subproblem::{Bounds, step};

/// Rounds at most.
const ROUNDS: usize = 25;
/// A round that gains less than this share is the last.
const ENOUGH: f64 = 2e-3;
/// How far a round may change the square of a speed, as a share of it: at first and at
/// most, and below which nothing more is tried.
const REACH: f64 = 0.6;
const LEAST_REACH: f64 = 5e-3;
/// Shares of a change that are tried.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// Goes on from a choice that keeps the bounds until nothing is gained any more. All
/// that come of it keep them too. `None` where the first choice is none.
pub fn descend(horizon: &Horizon<'_>, bounds: &Bounds, first: Choice) -> Option<(Choice, Outcome)> {
    let mut choice = first;
    let mut outcome = horizon.outcome(&choice)?;
    let mut reach = REACH;
    for _ in 0..ROUNDS {
        let Some(change) = step(horizon, bounds, &choice, &outcome, reach) else { break };
        let Some((next, better, share)) = search(horizon, bounds, &choice, &outcome, &change)
        else {
            reach *= 0.25;
            if reach < LEAST_REACH {
                break;
            }
            continue;
        };
        let gain = 1.0 - better.cost / outcome.cost;
        (choice, outcome) = (next, better);
        if gain < ENOUGH {
            break;
        }
        reach = if share < 1.0 { 0.5 * reach } else { (1.5 * reach).min(REACH) };
    }
    Some((choice, outcome))
}

/// The largest share of a change that costs less.
fn search(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    choice: &Choice,
    outcome: &Outcome,
    change: &Choice,
) -> Option<(Choice, Outcome, f64)> {
    SHARES.iter().find_map(|share| {
        let next = kept(horizon, bounds, choice, change, *share)?;
        let better = horizon.outcome(&next)?;
        (better.cost < outcome.cost).then_some((next, better, *share))
    })
}

/// A share of a change, within the bounds to the last digit: the solver keeps them to its
/// own tolerance only.
fn kept(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    choice: &Choice,
    change: &Choice,
    share: f64,
) -> Option<Choice> {
    let limits = bounds.floor.iter().zip(&bounds.ceiling);
    let squares = choice.squares.iter().zip(&change.squares).zip(limits);
    let squares: Vec<f64> =
        squares.map(|((b, d), (low, high))| (b + share * d).clamp(*low, *high)).collect();
    let (min, max) = bounds.drive.range();
    let most = bounds.drive.rate_per_s() * KNOT_S;
    let mut before = horizon.extruder.command();
    let knots = choice.knots.iter().zip(&change.knots).map(|(u, d)| {
        before = (u + share * d).clamp(before - most, before + most).clamp(min, max);
        before
    });
    let knots = knots.collect();
    Some(Choice { squares: in_time(horizon, bounds, smooth(horizon, bounds, squares))?, knots })
}

/// Lowered where the acceleration is too much by the solver's tolerance.
fn smooth(horizon: &Horizon<'_>, bounds: &Bounds, mut squares: Vec<f64>) -> Vec<f64> {
    super::limits::reach(&horizon.path, &mut squares, bounds.accel);
    squares
}

/// As much nearer to the highest speeds as the time asks for. The time is convex in the
/// squares, so that a mixture never takes longer than the mean of both.
fn in_time(horizon: &Horizon<'_>, bounds: &Bounds, squares: Vec<f64>) -> Option<Vec<f64>> {
    let here = horizon.profile(&squares)?.duration_s();
    if here <= bounds.longest_s {
        return Some(squares);
    }
    let fastest = horizon.profile(&bounds.ceiling)?.duration_s();
    let share = ((here - bounds.longest_s) / (here - fastest)).clamp(0.0, 1.0);
    let mixed = squares.iter().zip(&bounds.ceiling);
    Some(mixed.map(|(b, high)| b + share * (high - b)).collect())
}
