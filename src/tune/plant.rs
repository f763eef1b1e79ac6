//! An identified cell.

use serde::Serialize;

use super::noise::{Drift, PlantNoise, width_noise};
use super::robot::{RobotResponse, RobotResponseError, fit_response};
use super::timing::{CellTiming, timing};
use super::{Estimated, Log, TuneError};
use crate::core::{Mm, MmPerS, ROBOT_LAG};
use crate::identify::camera_offset::{OffsetSearch, OffsetStudy, study};

/// Relative standard deviation of the exponent above which it cannot be used. A choice.
const MAX_RELATIVE_SIGMA: f64 = 1.0 / 3.0;

/// Facts about the cell that need no identification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TuneFacts {
    /// Length of the gauge along the bead.
    pub gauge: Mm,
    /// Largest distance of the camera in the search.
    pub max_offset: Mm,
    /// Speed v₀ at which the width A is given.
    pub start_speed: MmPerS,
}

/// An identified cell.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifiedCell {
    /// Distance from the nozzle to the middle of the gauge \[mm\].
    pub offset_mm: Estimated,
    /// Exponent b in w = A·(v/v₀)^−b.
    pub exponent: Estimated,
    /// Width A at the start speed \[mm\].
    pub width_mm: Estimated,
    /// The start speed v₀ \[mm/s\].
    pub at_speed_mm_per_s: f64,
    /// Noise of the widths.
    pub width_noise: PlantNoise,
    /// Response of the robot to setpoints.
    pub robot: Result<RobotResponse, RobotResponseError>,
    /// Rates and latencies.
    pub timing: CellTiming,
    /// Length of the gauge \[mm\].
    pub gauge_mm: f64,
    /// Widths and the speeds at which their bead was laid.
    pub study: OffsetStudy,
}

/// Dead time and time constant of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RobotDynamics {
    /// Dead time \[s\].
    pub dead_time_s: f64,
    /// Time constant \[s\].
    pub lag_s: f64,
}

impl IdentifiedCell {
    /// Identifies a cell from a log.
    pub fn of(log: &Log, facts: &TuneFacts) -> Result<Self, TuneError> {
        let search = OffsetSearch { gauge: facts.gauge, max_offset: facts.max_offset };
        let study = study(&log.states, &log.widths, search)?;
        let found = study.estimate;
        let exponent = Estimated { value: found.exponent, sigma: study.exponent_sigma };
        if found.at_bound {
            return Err(TuneError::ExponentAtEnd { exponent: exponent.value });
        }
        if exponent.sigma > MAX_RELATIVE_SIGMA * exponent.value {
            let Estimated { value, sigma } = exponent;
            return Err(TuneError::LooseExponent { exponent: value, sigma });
        }
        let (width, sigma) = study.width_at(facts.start_speed);
        Ok(Self {
            offset_mm: Estimated { value: found.offset.get(), sigma: found.sigma.get() },
            exponent,
            width_mm: Estimated { value: width, sigma },
            at_speed_mm_per_s: facts.start_speed.get(),
            width_noise: width_noise(&study),
            robot: fit_response(log),
            timing: timing(log),
            gauge_mm: facts.gauge.get(),
            study,
        })
    }

    /// Speed at which a bead of this width is laid \[mm/s\].
    pub fn speed_for(&self, width_mm: f64) -> f64 {
        let ratio = self.width_mm.value / width_mm;
        self.at_speed_mm_per_s * libm::pow(ratio, 1.0 / self.exponent.value)
    }

    /// The robot's response; a typical one if it was not identified.
    pub fn robot_dynamics(&self) -> RobotDynamics {
        let usual = RobotDynamics { dead_time_s: 0.0, lag_s: ROBOT_LAG.secs() };
        self.robot.map_or(usual, |robot| RobotDynamics {
            dead_time_s: robot.dead_time_s.value,
            lag_s: robot.lag_s.value,
        })
    }

    /// Standard deviation of a measured width \[mm\].
    pub fn noise_mm(&self) -> f64 {
        self.width_noise.per_width.value * self.width_mm.value
    }

    /// Random walk of the flow per root metre for simulated beads: the estimate, or zero if it is
    /// not significant.
    pub fn drift_per_root_m(&self) -> f64 {
        match self.width_noise.drift {
            Drift::Estimated { per_root_m, .. } => per_root_m,
            Drift::AtMost(_) => 0.0,
        }
    }
}
