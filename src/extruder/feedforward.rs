//! Feedforward from models (bcs-thesis, chapter 4): the extruder's command gives the flow that
//! will leave the nozzle, and that flow over the target section gives the speed of wheel, feed or
//! robot; or, in the other direction, a demanded flow gives the extruder's command.
//!
//! ```text
//! command ─G1─▶ rpm ─G2─▶ flow ┐                     forecast::FlowForecast
//!   area or pressure ─▶ unmodelled flow ┴─▶ ÷ area   observer::FlowObserver
//!                                 └─▶ speed ─GC─▶ drive of wheel or robot
//! demanded flow ─(G1·G2)⁻¹─▶ command                 inverse::Inverse
//!                     the same within limits             tracker::Tracker
//! ```
//!
//! Everything runs on the fixed grid of the commands, 200 Hz in the thesis.

mod follow;
mod forecast;
mod inverse;
mod observer;
#[cfg(test)]
mod tests;
mod tracker;

pub use follow::{FlowMeasurement, SpeedFeedforward, SpeedStep};
pub use forecast::{ExtruderModel, FlowForecast, ScrewSpeed};
pub use inverse::{Inverse, InverseSettings, RightHalfPlaneZeros};
pub use observer::{FlowObserver, FlowResidual, UnmodelledFlow, unpredictable_fraction};
pub use tracker::Tracker;

use nalgebra::Complex;

use super::limits::LimitError;
use crate::numeric::lti::{ModelError, TransferFunction};

/// A feedforward that cannot be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FeedforwardError {
    /// The model is not valid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model that is not stable; its pole \[1/s\].
    #[error(
        "the model has a pole at {:.4} ± {:.4}i 1/s: it is not stable, and a command without \
         feedback cannot hold it", .0.re, .0.im.abs()
    )]
    Unstable(Complex<f64>),
    /// No static gain.
    #[error("the model's gain at rest is {0}: no command gives a steady output")]
    NoGain(f64),
    /// A zero in the right half plane \[1/s\], whose inverse is not stable.
    #[error(
        "the model has a zero at {:.4} ± {:.4}i 1/s, in the right half plane: its inverse \
         would grow without bound. Mirror it (the output is then delayed by 2·Re/|z|²), or fit a \
         model with fewer zeros", .0.re, .0.im.abs()
    )]
    NonMinimumPhase(Complex<f64>),
    /// Poles that are too fast for the rate of commands.
    #[error(
        "the placed poles' time constant is {time_constant_s} s, which commands every {period_s} s \
         cannot follow: at least {least_s} s, or command more often"
    )]
    PolesTooFast {
        /// The requested time \[s\].
        time_constant_s: f64,
        /// Time between two commands \[s\].
        period_s: f64,
        /// The limit \[s\].
        least_s: f64,
    },
    /// The dead time exceeds preview and allowed delay.
    #[error(
        "the dead time of {dead_time_s:.4} s is longer than the {known_s:.4} s for which the \
         demand is known ahead and the {late_s:.4} s that the output may be delayed: plan further \
         ahead, or allow for it"
    )]
    DeadTime {
        /// Dead time, with the delay by mirrored zeros \[s\].
        dead_time_s: f64,
        /// Preview of the demand \[s\].
        known_s: f64,
        /// Allowed delay \[s\].
        late_s: f64,
    },
    /// A forecast beyond the commands so far.
    #[error(
        "a forecast of {ahead_s:.4} s ahead must lie between 0 and the models' dead time of \
         {dead_time_s:.4} s: beyond it the flow depends on commands that are still to come"
    )]
    TooFarAhead {
        /// The requested time \[s\].
        ahead_s: f64,
        /// Dead time of drive and flow \[s\].
        dead_time_s: f64,
    },
    /// A number that is not positive.
    #[error("{what} is {value}: it must be above 0")]
    NotPositive {
        /// Name of the number.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// Limits that leave no command.
    #[error(transparent)]
    Limits(#[from] LimitError),
}

fn positive(what: &'static str, value: f64) -> Result<f64, FeedforwardError> {
    let is_valid = value > 0.0 && value.is_finite();
    if is_valid { Ok(value) } else { Err(FeedforwardError::NotPositive { what, value }) }
}

/// The static gain of a model that can be commanded without feedback.
fn usable_gain(model: &TransferFunction) -> Result<f64, FeedforwardError> {
    if !model.is_stable()
        && let Some(pole) = model.poles().iter().max_by(|a, b| a.re.total_cmp(&b.re))
    {
        return Err(FeedforwardError::Unstable(*pole));
    }
    let gain = model.dc_gain();
    if gain.is_finite() && gain != 0.0 { Ok(gain) } else { Err(FeedforwardError::NoGain(gain)) }
}
