//! Feedforward from models (bcs-thesis, chapter 4): what the extruder is told
//! gives the flow that will leave the nozzle, and that flow over the wanted
//! section gives the speed of wheel, feed or robot; or, the other way round, a
//! demanded flow gives the extruder's command.
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

use super::limits::LimitError;
use crate::numeric::lti::{ModelError, TransferFunction};

/// A feedforward that cannot be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FeedforwardError {
    /// The model itself is no good.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model that is not stable.
    #[error(
        "the model has a pole at {re:.4} ± {im:.4}i 1/s: it is not stable, and a command without \
         feedback cannot hold it"
    )]
    Unstable {
        /// Real part \[1/s\].
        re: f64,
        /// Size of the imaginary part \[1/s\].
        im: f64,
    },
    /// Nothing comes of a command that stands.
    #[error("the model's gain at rest is {0}: no command gives a steady output")]
    NoGain(f64),
    /// A zero whose inverse is not stable.
    #[error(
        "the model has a zero at {re:.4} ± {im:.4}i 1/s, in the right half plane: its inverse \
         would grow without bound. Mirror it (the output is then delayed by 2·Re/|z|²), or fit a \
         model with fewer zeros"
    )]
    NonMinimumPhase {
        /// Real part \[1/s\].
        re: f64,
        /// Size of the imaginary part \[1/s\].
        im: f64,
    },
    /// Poles that commands so rare cannot place.
    #[error(
        "the placed poles' time constant is {time_constant_s} s, which commands every {period_s} s \
         cannot follow: at least {least_s} s, or command more often"
    )]
    PolesTooFast {
        /// What was asked for \[s\].
        time_constant_s: f64,
        /// Time between two commands \[s\].
        period_s: f64,
        /// What can be had \[s\].
        least_s: f64,
    },
    /// The output would be later than it may be.
    #[error(
        "the dead time of {dead_time_s:.4} s is longer than the {known_s:.4} s for which the \
         demand is known ahead and the {late_s:.4} s that the output may be delayed: plan further \
         ahead, or allow for it"
    )]
    DeadTime {
        /// Dead time with what mirrored zeros add \[s\].
        dead_time_s: f64,
        /// How far ahead the demand is known \[s\].
        known_s: f64,
        /// What is allowed beyond that \[s\].
        late_s: f64,
    },
    /// A forecast of what has not been told yet.
    #[error(
        "a forecast of {ahead_s:.4} s ahead must lie between 0 and the models' dead time of \
         {dead_time_s:.4} s: beyond it the flow depends on commands that are still to come"
    )]
    TooFarAhead {
        /// What was asked for \[s\].
        ahead_s: f64,
        /// Dead time of drive and flow \[s\].
        dead_time_s: f64,
    },
    /// A number that must be above zero.
    #[error("{what} is {value}: it must be above 0")]
    NotPositive {
        /// Which.
        what: &'static str,
        /// What was found.
        value: f64,
    },
    /// Limits that leave nothing.
    #[error(transparent)]
    Limits(#[from] LimitError),
}

fn positive(what: &'static str, value: f64) -> Result<f64, FeedforwardError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(FeedforwardError::NotPositive { what, value })
    }
}

/// The gain at rest of a model that can be commanded without feedback.
fn usable_gain(model: &TransferFunction) -> Result<f64, FeedforwardError> {
    if !model.is_stable()
        && let Some(pole) = model.poles().iter().max_by(|a, b| a.re.total_cmp(&b.re))
    {
        return Err(FeedforwardError::Unstable { re: pole.re, im: pole.im.abs() });
    }
    let gain = model.dc_gain();
    if gain.is_finite() && gain != 0.0 { Ok(gain) } else { Err(FeedforwardError::NoGain(gain)) }
}
