//! Starts and stops from a recording: the delay of the first flow after a pause, and the flow
//! after a stop.
//!
//! ```text
//! command ─▶ episodes: runs and the pauses between them
//! flow after every stop, over that before  ─▶ stop:   L', T', D, τd      (all stops together)
//! flow after every start, over that later  ─▶ start:  d of each start, T
//! d over the pauses                        ─▶ delay:  L, V∞, τ
//! ```
//!
//! The command may have any unit: only its on and off times and the flow matter. Standard
//! errors come from the variation between the starts and between the stops.

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

/// Parameters of starts and stops from a command, in any unit, and a flow \[mm³/s\]. Fails
/// where the recording does not determine them.
pub fn fit(command: &TimeSeries, flow: &TimeSeries) -> Result<StartStopFit, StartStopFitError> {
    let episodes = episodes::find(command, flow)?;
    let fall = stop::fit(&episodes.stops)?;
    let rise = start::fit(&episodes.starts, &stop::model(fall.value))?;
    let void = delay::fit(&rise.starts)?;
    let parts = |[first_flow_s, void_mm3, idle_s]: [f64; 3], rise_s: f64, stop: [f64; 4]| {
        StartStop::from_parts([first_flow_s, rise_s, void_mm3, idle_s], stop)
    };
    let parameters = parts(void.value, rise.time_constant_s, fall.value);
    let sigma = parts(void.sigma, rise.sigma_s, fall.sigma);
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

pub mod start;
pub mod stop;
#[cfg(test)]
mod tests;
