//! Proposed settings.

use serde::Serialize;

use super::noise::Drift;
use super::plant::IdentifiedCell;
use super::stability::{LoopMargins, LoopPlant};
use crate::cell::file::RunPart;
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::WidthStrategy;
use crate::width_control::strategy::distance::DistanceStrategy;

/// Random walk of the flow per root metre if its estimate is not significant; the default of the
/// distance controller.
const DEFAULT_DRIFT: f64 = 0.0055;
/// Random walks that are accepted as an estimate.
const DRIFT_RANGE: (f64, f64) = (1e-4, 0.2);
/// Smallest standard deviation of the camera's distance \[mm\]: nozzles drip, and paths round
/// their corners. A choice.
const MIN_OFFSET_SIGMA_MM: f64 = 0.5;

/// Proposed settings of both controllers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proposal {
    /// Settings of the distance controller.
    pub distance: DistanceProposal,
    /// Settings of the PI controller.
    pub pi: PiProposal,
}

/// Settings of the distance controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceProposal {
    /// Exponent b.
    pub exponent: f64,
    /// Distance from the nozzle to the middle of the gauge \[mm\].
    pub offset_mm: f64,
    /// Standard deviation of that distance \[mm\].
    pub offset_sigma_mm: f64,
    /// Random walk of the flow per root metre, relative.
    pub drift_per_root_m: f64,
    /// Whether b is estimated online: as in the cell; `true` if the cell has another strategy.
    pub learns: bool,
}

/// Gains of the PI controller for the error in mm, and the loop for which they are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiProposal {
    /// Gains.
    pub gains: PiGains,
    /// The loop at the worst speed of the limits.
    pub at: LoopPlant,
    /// Stability margins of that loop; `None` if both gains are 0.
    pub margins: Option<LoopMargins>,
}

/// Settings for a cell's target width and limits.
pub fn propose(plant: &IdentifiedCell, run: &RunPart) -> Proposal {
    let at = slowest_loop(plant, run.control.target.nominal().get(), &run.limits);
    let gains = gains(&at);
    Proposal {
        distance: by_distance(plant, &*run.control.strategy),
        pi: PiProposal { gains, at, margins: at.margins(gains) },
    }
}

/// The loop at the slowest speed, where the gain and the dead time are largest.
pub fn slowest_loop(plant: &IdentifiedCell, target_mm: f64, limits: &SpeedLimits) -> LoopPlant {
    LoopPlant::at(plant, target_mm, limits.min_speed.get().max(1.0))
}

fn by_distance(plant: &IdentifiedCell, now: &dyn WidthStrategy) -> DistanceProposal {
    let drift_per_root_m = match plant.width_noise.drift {
        Drift::Estimated { per_root_m, .. } => per_root_m,
        Drift::AtMost(max) => DEFAULT_DRIFT.min(max),
    };
    DistanceProposal {
        exponent: plant.exponent.value,
        offset_mm: plant.offset_mm.value,
        offset_sigma_mm: plant.offset_mm.sigma.max(MIN_OFFSET_SIGMA_MM),
        drift_per_root_m: drift_per_root_m.clamp(DRIFT_RANGE.0, DRIFT_RANGE.1),
        learns: now.as_kind::<DistanceStrategy>().is_none_or(|now| now.learns_exponent),
    }
}

/// The AMIGO rule for a first-order lag with dead time, for Ms = 1.4 (Åström and Hägglund 2006,
/// *Advanced PID control*, section 7.3).
pub fn gains(plant: &LoopPlant) -> PiGains {
    let LoopPlant { gain_s: gain, dead_time_s: dead, lag_s: lag, .. } = *plant;
    let dead = dead.max(1e-3);
    let normalised_lag = lag / (lag + dead);
    let kp = (0.15 + 0.35 * lag / dead - normalised_lag * normalised_lag) / gain;
    let all = lag * lag + 12.0 * lag * dead + 7.0 * dead * dead;
    let reset_s = 0.35 * dead + 13.0 * dead * lag * lag / all;
    PiGains { kp_per_s: kp, ki_per_s2: kp / reset_s }
}
