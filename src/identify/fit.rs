//! Fits transfer functions with dead time to samples of an input and an output.
//!
//! ```text
//! Samples::new(input, output, dt)
//!   → fit(&samples, &FitSettings) → Fit{ model, parameters ± errors, quality, … }
//!   → Fit::validate(&other samples, InitialCondition) → FitQuality
//! compare(&samples, Some(&validation), &[FitSettings]) → ModelComparison{ rows, chosen, reason }
//! ```
//!
//! **Method.** Output error in continuous time: the model is simulated exactly between the
//! samples on the input alone, and its parameters minimise the sum of squared differences from
//! the output (Levenberg 1944, Marquardt 1963). That is unbiased for any autocorrelation of the
//! noise, as long as the noise does not depend on the input, and efficient for white noise.
//! Initial values come from least squares with a state-variable filter (Young 1970) at several
//! bandwidths and dead times; the best few are followed to the end, against local minima.
//!
//! **Operating point.** y = output level + G·(u − input level): the input level is the input
//! before the first sample ([`InitialCondition`]); the output level is estimated unless it is
//! known ([`OutputLevel`]).
//!
//! **Standard errors.** The output of an extruder has autocorrelated noise, and errors for
//! white noise are too small. [`Parameter`] has both: `sigma` takes the autocorrelation of the
//! residuals into account (an autoregressive model of them in the sandwich estimator),
//! `sigma_if_white` does not.

mod autoregression;
mod check;
mod clipped;
mod compare;
mod detrended;
mod drift;
mod error;
mod estimate;
mod identifiability;
mod named;
mod problem;
mod quality;
mod report;
mod samples;
mod settings;
mod spread;
mod start;
mod trend;

pub use clipped::{Clipped, Extreme};
pub use compare::{ComparedModel, ModelComparison, compare};
pub use detrended::DetrendedGain;
pub use error::FitError;
pub use estimate::{Fit, FitNote, Parameter};
pub use quality::FitQuality;
pub use samples::{Samples, SamplesError};
pub use settings::{DeadTime, FitSettings, InitialCondition, MAX_POLES, OutputLevel, Structure};
pub use trend::{DOMINANT_FRACTION, Trend};
pub use undetermined::Undetermined;

use crate::numeric::lti::Between;
use problem::FitProblem;

/// Fits one model. Fails where the data do not allow identification ([`SamplesError`]) and
/// where the result is invalid ([`FitError`]); every message says what was found.
pub fn fit(samples: &Samples, settings: &FitSettings) -> Result<Fit, FitError> {
    check::check(settings, samples)?;
    samples.check_input(settings.initial_state)?;
    samples.check_clipped().map_err(SamplesError::from)?;
    let problem = FitProblem::new(samples, settings);
    let best = start::best(&problem)?;
    let straight_through = settings.structure.zeros() == settings.structure.poles();
    match settings.dead_time {
        DeadTime::Estimated { min_s, max_s }
            if straight_through && settings.between == Between::Held =>
        {
            let near_s = problem.dead_time_s(&best.theta);
            with_dead_time_to_a_step(samples, settings, [min_s, max_s], near_s)
        }
        _ => report::report(&problem, settings, &best),
    }
}

/// Whole steps on either side of the first estimate that are tried.
const NEIGHBOUR_STEPS: u32 = 2;

/// With as many zeros as poles and a held input, a dead time within a step is equivalent to
/// another numerator: only the whole step is identifiable.
fn with_dead_time_to_a_step(
    samples: &Samples,
    settings: &FitSettings,
    [min_s, max_s]: [f64; 2],
    near_s: f64,
) -> Result<Fit, FitError> {
    let dt_s = samples.dt_s();
    let first = (near_s / dt_s).floor() - f64::from(NEIGHBOUR_STEPS);
    let whole = (0..=2 * NEIGHBOUR_STEPS + 1).map(|k| (first + f64::from(k)) * dt_s);
    let mut found = Vec::new();
    for dead_time_s in whole.filter(|dead_time_s| (min_s..=max_s).contains(dead_time_s)) {
        let settings = FitSettings { dead_time: DeadTime::Known(dead_time_s), ..*settings };
        let problem = FitProblem::new(samples, &settings);
        found.extend(start::best(&problem).ok().map(|best| (settings, problem, best)));
    }
    let least = found.iter().min_by(|a, b| a.2.sum_of_squares.total_cmp(&b.2.sum_of_squares));
    let (settings, problem, best) = least.ok_or(FitError::NoStart)?;
    let dead_time_s = problem.dead_time_s(&[]);
    if dead_time_s + dt_s > max_s {
        return Err(FitError::DeadTimeAtBound { end: "upper", bound_s: max_s });
    }
    let mut fit = report::report(problem, settings, best)?;
    fit.notes.push(FitNote::DeadTimeToAStep { dead_time_s });
    Ok(fit)
}

#[cfg(test)]
mod tests;
pub mod undetermined;
