//! Table 1: convergence times of tracking and estimate after a step.

use super::strand::{InputDisturbance, StrandParameters};
use super::{
    AdaptationMethod, HOLD_S, MODEL, STEP_AT_S, StrandExperiment, TOLERANCES, WATCHED_S,
    operating_point,
};
use crate::extruder::adaptive::SubSystemError;

/// A case of table 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableCase {
    /// Its number in the table.
    pub number: u32,
    /// The disturbed sub-system.
    pub of: SubSystem,
    /// Step in ṁ \[kg/s\], or in the plate's speed \[%\]: the unit of the table, m/s, cannot
    /// be right (papers.md).
    pub size: f64,
    /// Published convergence of tracking \[s\].
    pub tracking_s: f64,
    /// Published convergence of the estimate \[s\].
    pub estimate_s: f64,
}

/// A sub-system of the plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SubSystem {
    /// Sub-system 1.
    Nozzle,
    /// Sub-system 3.
    Strand,
}

/// Mohammadi Looey et al. 2026, table 1.
pub const TABLE: [TableCase; 10] = [
    case(1, SubSystem::Nozzle, 0.0025, 4.87, 7.97),
    case(2, SubSystem::Nozzle, -0.0025, 4.77, 8.64),
    case(3, SubSystem::Nozzle, -0.005, 5.60, 8.51),
    case(4, SubSystem::Nozzle, -0.0075, 5.51, 8.80),
    case(5, SubSystem::Nozzle, -0.01, 5.67, 8.90),
    case(6, SubSystem::Strand, -20.0, 2.11, 30.97),
    case(7, SubSystem::Strand, -10.0, 1.80, 31.00),
    case(8, SubSystem::Strand, -30.0, 2.34, 27.50),
    case(9, SubSystem::Strand, -40.0, 15.40, 31.00),
    case(10, SubSystem::Strand, 10.0, 2.43, 31.00),
];

const fn case(
    number: u32,
    of: SubSystem,
    size: f64,
    tracking_s: f64,
    estimate_s: f64,
) -> TableCase {
    TableCase { number, of, size, tracking_s, estimate_s }
}

/// Time after the step from which tracking and estimate stay within their tolerances \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    /// `t_cr`; none where it has not converged at the end of the horizon.
    pub tracking_s: Option<f64>,
    /// `t_cp`; `None` likewise.
    pub estimate_s: Option<f64>,
}

impl TableCase {
    /// Runs the case with a controller.
    pub fn run(&self, method: AdaptationMethod) -> Result<Convergence, SubSystemError> {
        let (from_s, to_s) = (STEP_AT_S, f64::INFINITY);
        let none = InputDisturbance::None;
        let step = |size| InputDisturbance::Step { size, from_s, to_s };
        let (feed, plate, part, input_gain) = match self.of {
            SubSystem::Nozzle => (step(self.size), none, 0, MODEL.nozzle.input_gain),
            SubSystem::Strand => {
                let size = 0.01 * self.size * operating_point().plate_m_per_s;
                (none, step(size), 1, MODEL.strand.input_gain)
            }
        };
        let length_s = STEP_AT_S + WATCHED_S;
        let parameters = StrandParameters::Constant;
        let experiment = StrandExperiment { method, parameters, feed, plate, length_s };
        let mut outside = [0.0; 2];
        experiment.run(|moment| {
            let action = &moment.actions[part];
            let sizes =
                [(action.error / input_gain).abs(), (moment.unknown[part] - action.estimate).abs()];
            for which in 0..2 {
                if moment.t_s >= STEP_AT_S && sizes[which] > TOLERANCES[which] {
                    outside[which] = moment.t_s - STEP_AT_S + HOLD_S;
                }
            }
        })?;
        let [tracking_s, estimate_s] =
            outside.map(|last| (last < WATCHED_S - HOLD_S).then_some(last));
        Ok(Convergence { tracking_s, estimate_s })
    }
}
