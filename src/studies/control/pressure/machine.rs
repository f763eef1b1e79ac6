//! The extruder of the study, as it is where nothing is wrong.

use crate::core::{MPa, Rpm};
use crate::extruder::pressure::InitialState;
use crate::sim::pressure::Disturbances;
use crate::studies::ma2026::NOISE_MPA2;

/// The loop's name in the table.
pub const LOOP: &str = "pressure, 50/20 Hz";
/// Largest speed of the screw \[rpm\], as in Ma et al. 2026.
pub const FASTEST: Rpm = Rpm::constant(3.0);
/// Nothing turns.
pub const AT_REST: InitialState =
    InitialState { pressure: MPa::ZERO, target: MPa::ZERO, speed: Rpm::ZERO };

/// The noise of the paper's sensor.
pub fn noisy() -> Disturbances {
    Disturbances { noise_mpa2: NOISE_MPA2, ..Disturbances::default() }
}
