//! The experiments of Diagne et al. 2015: a screw whose filled length (plug) has to grow from
//! 100 to 160 mm, with a conveying speed that is steady or pulsates (the paper's cases a and
//! b), fed open loop, by feedback without a predictor, and by feedback with one.

pub mod experiment;
pub mod response;
pub mod robustness;
pub mod run;
pub mod table;

use crate::core::Mm;
use crate::extruder::screw::feedback::PlugSetpoint;
use crate::extruder::screw::{
    FillFeedback, PiecewiseExponential, SaturatedLinear, Screw, ScrewDesign, ScrewError,
    SpeedPulsation, TurnUnit,
};

pub use response::{Cycle, PlugResponse, PlugSample};
pub use run::{FeedMethod, RunPlan, follow};

/// Plug at the start, x₀ = 0.1 m. Diagne et al. 2015, section VII.
pub const START: Mm = Mm::constant(100.0);
/// Target x* = 0.16 m (Diagne et al. 2015, section VII), and the largest fill, which the paper
/// does not give (papers.md, "use 0.9").
pub const SETPOINT: PlugSetpoint = PlugSetpoint { plug: Mm::constant(160.0), max_fill: 0.9 };
/// Slope above the smallest one, S = `S_min` + 30 \[1/m\]. Diagne et al. 2015, section VII.
pub const STEEPER_PER_M: f64 = 30.0;
/// Settled means within 2 % of the step from start to setpoint \[mm\] (papers.md, "2 % band").
pub const SETTLING_BAND_MM: f64 = 0.02 * (160.0 - 100.0);
/// Last part of a run, over which an oscillation is measured \[s\]. Derived: a period of the
/// slower pulsation, 2π/0.4.
pub const CYCLE_S: f64 = 16.0;

/// A conveying speed over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulsationCase {
    /// Its name in tables.
    pub name: &'static str,
    /// How the speed pulsates.
    pub pulsation: SpeedPulsation,
}

/// A steady speed, and the two pulsations of Diagne et al. 2015, section VII.
pub const CASES: [PulsationCase; 3] = [
    case("constant", 0.0, 0.0),
    case("a: ε 0.1, ω 3.5 rad/s", 0.1, 3.5),
    case("b: ε 0.4, ω 0.4 rad/s", 0.4, 0.4),
];

const fn case(name: &'static str, relative_amplitude: f64, rad_per_s: f64) -> PulsationCase {
    let pulsation = SpeedPulsation { relative_amplitude, rad_per_s, phase_rad: 0.0 };
    PulsationCase { name, pulsation }
}

impl PulsationCase {
    /// The paper's screw in this case.
    pub fn screw(&self, unit: TurnUnit) -> Result<Screw, ScrewError> {
        ScrewDesign { unit, ..ScrewDesign::DIAGNE_2015 }.screw(self.pulsation)
    }
}

/// The paper's control law, eqs. (20)–(22), with the slope `S_min` + 30.
pub fn paper_controller(screw: &Screw) -> Result<PiecewiseExponential, ScrewError> {
    let slope = SETPOINT.min_slope(screw)? + STEEPER_PER_M;
    PiecewiseExponential::new(screw, SETPOINT, slope)
}

/// Our controller: the largest feed until shortly before the setpoint, then linear with a slope
/// \[1/m\].
pub fn saturated(screw: &Screw, slope_per_m: f64) -> Result<FillFeedback, ScrewError> {
    SaturatedLinear::new(screw, SETPOINT, slope_per_m).map(FillFeedback::Saturated)
}
