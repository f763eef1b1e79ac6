//! Starts and stops from a recording: how late the first flow comes after a
//! pause, and what still comes after a stop.
//!
//! ```text
//! command ─▶ episodes: runs and the pauses between them
//! flow after every stop, over that before  ─▶ fall:  L', T', D, τd      (all stops together)
//! flow after every start, over that later  ─▶ rise:  d of each start, T
//! d over the pauses                        ─▶ void:  L, V∞, τ
//! ```
//!
//! The command is in any unit: what counts is when it runs, and the flow that
//! comes of it. Standard errors are those that the starts and the stops show
//! among themselves.

pub mod delay;
mod episodes;
mod error;
mod estimate;
pub mod file;
mod least_squares;
pub mod parameters;

pub use error::StartStopFitError;
pub use estimate::{ObservedStart, ObservedStop, StartStopFit};

use crate::identify::series::TimeSeries;
use parameters::StartStop;

/// Parameters of starts and stops from a command, in any unit, and a flow
/// \[mm³/s\]. Fails where the recording does not tell them.
pub fn fit(command: &TimeSeries, flow: &TimeSeries) -> Result<StartStopFit, StartStopFitError> {
    let episodes = episodes::find(command, flow)?;
    let fall = stop::fit(&episodes.stops)?;
    let rise = start::fit(&episodes.starts, &fall.model)?;
    let void = delay::fit(&rise.starts)?;
    let parameters = assemble(&fall.model, rise.time_constant_s, &void.value);
    let sigma = assemble(&fall.sigma, rise.sigma_s, &void.sigma);
    let starts = rise.starts.iter().map(|start| ObservedStart {
        modelled_s: parameters.delay_s(start.idle_s, start.flow_mm3_per_s),
        ..*start
    });
    Ok(StartStopFit {
        parameters,
        sigma,
        runs: episodes.runs,
        starts: starts.collect(),
        stops: fall.stops,
        delay_sigma_s: void.residual_sigma_s,
    })
}

fn assemble(fall: &stop::StopResponse, rise_s: f64, void: &delay::IdleDelay) -> StartStop {
    StartStop {
        first_flow_s: void.first_flow_s,
        rise_s,
        void_mm3: void.void_mm3,
        idle_time_constant_s: void.idle_time_constant_s,
        stop_s: fall.stop_s,
        fall_s: fall.fall_s,
        drool_s: fall.drool_s,
        drool_time_constant_s: fall.drool_time_constant_s,
    }
}

pub mod start;
pub mod stop;
#[cfg(test)]
mod tests;
