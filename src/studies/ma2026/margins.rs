//! Gain and dead-time margins of a controller, found by simulation.

use super::experiment::{PressureExperiment, TestedController};
use super::plant::{DEAD_TIME_S, Factors, LOAD_RPM};
use crate::extruder::pressure::PressureError;
use crate::sim::pressure::LoadChange;

/// Largest model mismatch with which the pressure settles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MismatchMargins {
    /// Gain over the model's gain.
    pub gain: f64,
    /// Dead time in addition to the model's \[s\].
    pub dead_time_s: f64,
}

/// The margins of a controller. Beyond them the standard deviation of the pressure, from 40 s
/// after a step of the load on, is more than 5 kPa.
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

/// The largest value at which a property holds, to 1 %, by bisection. It must hold at `low`.
fn largest(
    mut low: f64,
    mut high: f64,
    holds: impl Fn(f64) -> Result<bool, PressureError>,
) -> Result<f64, PressureError> {
    while high / low > 1.01 {
        let middle = (low * high).sqrt();
        *(if holds(middle)? { &mut low } else { &mut high }) = middle;
    }
    Ok(low)
}
