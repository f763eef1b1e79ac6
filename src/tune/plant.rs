//! The cell as a recording shows it.

use serde::Serialize;

use super::noise::{Drift, Scatter, scatter};
use super::robot::{RobotAnswer, RobotError, answer};
use super::timing::{Timing, timing};
use super::{Known, Log, TuneError};
use crate::core::readback::ROBOT_LAG;
use crate::core::units::{Mm, MmPerS};
use crate::identify::camera_offset::{Search, Study, study};

/// Part of the exponent as which its standard deviation says nothing any more.
const LOOSE: f64 = 1.0 / 3.0;

/// What has to be known beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facts {
    /// Length of the gauge along the bead.
    pub gauge: Mm,
    /// Largest distance of the camera that is tried.
    pub farthest: Mm,
    /// Speed at which the level of the bead is told.
    pub start_speed: MmPerS,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Distance from the nozzle to the middle of the gauge \[mm\].
    pub offset_mm: Known,
    /// Exponent b in w = A·(v/v₀)^−b.
    pub exponent: Known,
    /// Width A at the start speed \[mm\].
    pub width_mm: Known,
    /// The start speed v₀ \[mm/s\].
    pub at_speed_mm_per_s: f64,
    /// How the widths scatter.
    pub scatter: Scatter,
    /// How the robot answers its setpoints.
    pub robot: Result<RobotAnswer, RobotError>,
    /// Rates and delays.
    pub timing: Timing,
    /// Length of the gauge \[mm\].
    pub gauge_mm: f64,
    /// Widths beside the speeds that laid them.
    pub study: Study,
}

/// Dead time and lag of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Answers {
    /// Dead time \[s\].
    pub dead_s: f64,
    /// Time constant \[s\].
    pub lag_s: f64,
}

impl Plant {
    /// From a log.
    pub fn of(log: &Log, facts: &Facts) -> Result<Self, TuneError> {
        let search = Search { gauge: facts.gauge, farthest: facts.farthest };
        let study = study(&log.states, &log.widths, search)?;
        let found = study.found;
        let exponent = Known { value: found.exponent, sigma: study.exponent_sigma };
        if found.at_bound {
            return Err(TuneError::ExponentAtEnd { exponent: exponent.value });
        }
        if exponent.sigma > LOOSE * exponent.value {
            let Known { value, sigma } = exponent;
            return Err(TuneError::LooseExponent { exponent: value, sigma });
        }
        let (width, sigma) = study.width_at(facts.start_speed);
        Ok(Self {
            offset_mm: Known { value: found.offset.get(), sigma: found.sigma.get() },
            exponent,
            width_mm: Known { value: width, sigma },
            at_speed_mm_per_s: facts.start_speed.get(),
            scatter: scatter(&study),
            robot: answer(log),
            timing: timing(log),
            gauge_mm: facts.gauge.get(),
            study,
        })
    }

    /// Width of bead that is laid at a speed \[mm\].
    pub fn width_at(&self, speed_mm_per_s: f64) -> f64 {
        let ratio = speed_mm_per_s / self.at_speed_mm_per_s;
        self.width_mm.value * libm::pow(ratio, -self.exponent.value)
    }

    /// Speed at which bead of a width is laid \[mm/s\].
    pub fn speed_for(&self, width_mm: f64) -> f64 {
        let ratio = self.width_mm.value / width_mm;
        self.at_speed_mm_per_s * libm::pow(ratio, 1.0 / self.exponent.value)
    }

    /// The robot's answer; that of a usual robot where it was not told.
    pub fn answers(&self) -> Answers {
        let usual = Answers { dead_s: 0.0, lag_s: ROBOT_LAG.secs() };
        self.robot.map_or(usual, |robot| Answers {
            dead_s: robot.dead_time_s.value,
            lag_s: robot.lag_s.value,
        })
    }

    /// Standard deviation of a width that is measured \[mm\].
    pub fn noise_mm(&self) -> f64 {
        self.scatter.each.value * self.width_mm.value
    }

    /// How far the flow is taken to wander along a metre where a bead is simulated:
    /// what was found, nothing where nothing was seen.
    pub fn drift_per_root_m(&self) -> f64 {
        match self.scatter.drift {
            Drift::Found { per_root_m, .. } => per_root_m,
            Drift::AtMost(_) => 0.0,
        }
    }
}
