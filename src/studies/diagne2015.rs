//! The experiments of Diagne et al. 2015: a screw whose plug is to grow from
//! 100 to 160 mm, with a conveying speed that is steady or pulsates (the
//! paper's cases a and b), fed open loop, by the law without a predictor, and
//! by the law with one.

pub mod experiment;
pub mod response;
pub mod robustness;
pub mod run;
pub mod table;

use crate::core::units::Mm;
use crate::extruder::screw::feedback::PlugSetpoint;
use crate::extruder::screw::{
    FillFeedback, PiecewiseExponential, SaturatedLinear, Screw, ScrewDesign, ScrewError,
    SpeedPulsation, TurnUnit,
};

pub use response::{Cycle, PlugResponse, PlugSample};
pub use run::{FeedMethod, RunPlan, follow};

/// Plug at the start.
pub const START: Mm = Mm::constant(100.0);
/// Where it shall be, and the most that is fed: the paper does not print the
/// latter.
pub const SETPOINT: PlugSetpoint = PlugSetpoint { plug: Mm::constant(160.0), max_fill: 0.9 };
/// What the paper adds to the flattest slope \[1/m\].
pub const STEEPER_PER_M: f64 = 30.0;
/// Settled means within 2 % of the step from start to setpoint for good \[mm\].
pub const SETTLING_BAND_MM: f64 = 0.02 * (160.0 - 100.0);
/// Last part of a run, over which a swing is measured \[s\]: a turn of the
/// slower pulsation.
pub const CYCLE_S: f64 = 16.0;

/// A course of the conveying speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulsationCase {
    /// Its name.
    pub name: &'static str,
    /// How the speed pulsates.
    pub pulsation: SpeedPulsation,
}

/// Steady, and the paper's two.
pub const CASES: [PulsationCase; 3] = [
    case("constant", 0.0, 0.0),
    case("a: ε 0.1, ω 3.5 rad/s", 0.1, 3.5),
    case("b: ε 0.4, ω 0.4 rad/s", 0.4, 0.4),
];

const fn case(name: &'static str, share: f64, rad_per_s: f64) -> PulsationCase {
    PulsationCase {
        name,
        pulsation: SpeedPulsation { relative_amplitude: share, rad_per_s, phase_rad: 0.0 },
    }
}

impl PulsationCase {
    /// The paper's screw in this case.
    pub fn screw(&self, unit: TurnUnit) -> Result<Screw, ScrewError> {
        ScrewDesign { unit, ..ScrewDesign::DIAGNE_2015 }.screw(self.pulsation)
    }
}

/// The paper's law: the exponentials with `S_min` + 30.
pub fn paper_controller(screw: &Screw) -> Result<PiecewiseExponential, ScrewError> {
    let slope = SETPOINT.min_slope(screw)? + STEEPER_PER_M;
    PiecewiseExponential::new(screw, SETPOINT, slope)
}

/// Our law: as much as can be fed, until shortly before the setpoint; how
/// shortly is a matter of the slope \[1/m\].
pub fn saturated(screw: &Screw, slope_per_m: f64) -> Result<FillFeedback, ScrewError> {
    SaturatedLinear::new(screw, SETPOINT, slope_per_m).map(FillFeedback::Saturated)
}
