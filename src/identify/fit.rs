//! Fits transfer functions with dead time to samples of an input and an output.
//!
//! ```text
//! Samples::new(input, output, dt) / Samples::at_times(…)
//!   → fit(&samples, &Settings) → Fit{ model, parameters ± errors, quality, … }
//!   → Fit::validate(&other samples, Before) → Quality
//! compare(&samples, Some(&validation), &[Settings]) → Comparison{ rows, chosen, reason }
//! ```
//!
//! **Method.** Output error in continuous time: the model is simulated exactly
//! between the samples on the input alone and its parameters are those with the
//! least sum of squared differences from the output (Levenberg 1944, Marquardt
//! 1963). That is unbiased whatever the colour of the noise, as long as the noise
//! does not depend on the input, and efficient where it is white. Starting
//! values come from least squares behind a state-variable filter (Young 1970) at
//! several bandwidths and all along the range of the dead time; the best few are
//! carried to the end, so that no local minimum decides.
//!
//! **Operating point.** y = output level + G·(u − input level): the input level
//! is where the input stood before the first sample ([`Before`]); the output
//! level is estimated unless it is known ([`Level`]).
//!
//! **Standard errors.** The output of an extruder carries coloured noise, and
//! errors that take it as white come out too small. [`Parameter`] gives both:
//! `sigma` allows for the residuals' own colour (an autoregressive model of them
//! between the two halves of the sandwich), `sigma_if_white` does not.

mod compare;
mod error;
mod levenberg;
mod named;
mod problem;
mod quality;
mod report;
mod samples;
mod settings;
mod spread;
mod start;

pub use compare::{Comparison, Row, compare};
pub use error::FitError;
pub use quality::Quality;
pub use report::{Fit, Note, Parameter};
pub use samples::{DataError, Samples};
pub use settings::{Before, DeadTime, Level, Settings, Structure};

use problem::Problem;

/// Most poles of a fit.
pub const MOST_POLES: usize = 4;

/// Fits one model. Fails where the data cannot tell one ([`DataError`]) and where
/// the outcome is none ([`FitError`]); every message says what was found.
pub fn fit(samples: &Samples, settings: &Settings) -> Result<Fit, FitError> {
    settings.check(samples)?;
    samples.check_input(settings.before)?;
    samples.check_clipped()?;
    let problem = Problem::new(samples, settings);
    let best = start::best(&problem)?;
    report::report(&problem, settings, &best)
}

#[cfg(test)]
mod tests;
