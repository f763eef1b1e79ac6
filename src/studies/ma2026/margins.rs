//! How far a process may be from the model until a law swings, tried out.

use super::experiment::{PressureExperiment, TestedController};
use super::plant::{DEAD_TIME_S, Factors, LOAD_RPM};
use crate::extruder::pressure::PressureError;
use crate::sim::pressure::LoadChange;

/// How far a process may be from the model until a law no longer comes to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MismatchMargins {
    /// Gain over that of the model.
    pub gain: f64,
    /// Dead time beyond that of the model \[s\].
    pub dead_time_s: f64,
}

/// The margins of a law, tried out: 40 s after a step of the load the pressure
/// still swings by more than 5 kPa.
pub fn margins(tried: TestedController) -> Result<MismatchMargins, PressureError> {
    let gain = largest(1.0, 12.0, |gain| rests(tried, Factors { gain, ..Factors::NONE }))?;
    let dead_time =
        largest(1.0, 12.0, |dead_time| rests(tried, Factors { dead_time, ..Factors::NONE }))?;
    Ok(MismatchMargins { gain, dead_time_s: (dead_time - 1.0) * DEAD_TIME_S })
}

fn rests(tried: TestedController, factors: Factors) -> Result<bool, PressureError> {
    let mut experiment = PressureExperiment::load(factors);
    let rpm = LOAD_RPM / factors.gain;
    experiment.disturbed.load = Some(LoadChange { at_s: 5.0, rpm });
    experiment.takes_s = 60.0;
    let (sigma, _) = experiment.run(tried)?.steadiness(45.0);
    Ok(sigma < 0.005)
}

/// Where a property that holds at `low` ends, to a percent.
fn largest(
    low: f64,
    high: f64,
    mut holds: impl FnMut(f64) -> Result<bool, PressureError>,
) -> Result<f64, PressureError> {
    let (mut low, mut high) = (low, high);
    while high / low > 1.01 {
        let middle = (low * high).sqrt();
        if holds(middle)? {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(low)
}
