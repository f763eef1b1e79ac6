//! An output that goes its own way with time, and a model that follows it.

use super::error::FitError;
use super::estimate::Fit;
use super::problem::Problem;
use super::row::dot;
use super::trend::{DOMINATES, Trend};
use crate::numeric::number::float;

/// Refuses a model of an output that a straight line in time dominates, and not
/// the input, where the model tells no more than that line, or follows it with a
/// time constant that the record is too short to show.
pub(super) fn check_drift(problem: &Problem, fit: &Fit) -> Result<(), FitError> {
    let line = Trend::of(&problem.output);
    if line.share < DOMINATES || Trend::of(&problem.input).share > DOMINATES {
        return Ok(());
    }
    let record_s = problem.duration_s();
    let is_slow = fit.model.poles().iter().any(|pole| -pole.re * record_s < 1.0);
    if is_slow || !tells_more(fit, &line) {
        let share_percent = 100.0 * line.share;
        return Err(FitError::Drift { share_percent, rise: line.rise, record_s });
    }
    Ok(())
}

/// By Schwarz's criterion, over the independent samples; a line has two
/// parameters.
fn tells_more(fit: &Fit, line: &Trend) -> bool {
    let squares = dot(&fit.residuals, &fit.residuals).max(f64::MIN_POSITIVE);
    let n = fit.independent_samples.max(2.0);
    let more = float(fit.estimated) - 2.0;
    n * libm::log(line.squares.max(f64::MIN_POSITIVE) / squares) > more * libm::log(n)
}
