//! An output that drifts independently of the input, and a model that follows it.

use super::error::FitError;
use super::estimate::Fit;
use super::problem::FitProblem;
use super::trend::{DOMINANT_FRACTION, Trend};
use crate::numeric::number::to_f64;
use crate::numeric::row::dot;

/// Refuses a model of an output that a straight line in time dominates, but not the input,
/// where the model explains no more than the line, or follows it with a time constant that is
/// too long for the record.
pub(super) fn check_drift(problem: &FitProblem, fit: &Fit) -> Result<(), FitError> {
    let line = Trend::of(&problem.output);
    if line.explained_fraction < DOMINANT_FRACTION
        || Trend::of(&problem.input).explained_fraction > DOMINANT_FRACTION
    {
        return Ok(());
    }
    let record_s = problem.duration_s();
    let is_slow = fit.model.poles().iter().any(|pole| -pole.re * record_s < 1.0);
    if is_slow || !explains_more(fit, &line) {
        let explained_percent = 100.0 * line.explained_fraction;
        return Err(FitError::Drift { explained_percent, rise: line.rise, record_s });
    }
    Ok(())
}

/// By Schwarz's criterion over the independent samples; a line has two parameters.
fn explains_more(fit: &Fit, line: &Trend) -> bool {
    let squares = dot(&fit.residuals, &fit.residuals).max(f64::MIN_POSITIVE);
    let n = fit.independent_samples.max(2.0);
    let more = to_f64(fit.estimated) - 2.0;
    n * libm::log(line.residual_sum_of_squares.max(f64::MIN_POSITIVE) / squares)
        > more * libm::log(n)
}
