//! Settings that follow from what was found.

use serde::Serialize;

use super::noise::Drift;
use super::plant::IdentifiedCell;
use super::stability::{LoopMargins, LoopPlant};
use crate::cell::file::RunPart;
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::WidthStrategy;
use crate::width_control::strategy::distance::DistanceStrategy;

/// How far the flow is said to wander along a metre unless less is known; that of the
/// law by distance.
const DEFAULT_DRIFT: f64 = 0.0055;
/// Range of what may be said.
const DRIFT_RANGE: (f64, f64) = (1e-4, 0.2);
/// Least that is claimed of the camera's distance \[mm\]: nozzles drip and paths round
/// their corners.
const MIN_OFFSET_SIGMA_MM: f64 = 0.5;

/// Settings of both laws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Proposal {
    /// For the law by distance.
    pub distance: DistanceProposal,
    /// For the PI law.
    pub pi: PiProposal,
}

/// Settings of the law by distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceProposal {
    /// b.
    pub exponent: f64,
    /// From the nozzle to the middle of the gauge \[mm\].
    pub offset_mm: f64,
    /// Its standard deviation \[mm\].
    pub offset_sigma_mm: f64,
    /// How far the flow wanders along a metre, as a share.
    pub drift_per_root_m: f64,
    /// Whether b is learnt from the data: as the cell has it, and yes where its law is
    /// another.
    pub learns: bool,
}

/// Gains of the PI law on the error in mm, and the loop that they were made for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiProposal {
    /// Gains.
    pub gains: PiGains,
    /// The loop at the worst speed of the limits.
    pub at: LoopPlant,
    /// Margins there.
    pub margins: Option<LoopMargins>,
}

/// What follows from a plant for the width and the limits of a cell.
pub fn propose(plant: &IdentifiedCell, run: &RunPart) -> Proposal {
    let at = slowest_loop(plant, run.control.target.nominal().get(), &run.limits);
    let gains = gains(&at);
    Proposal {
        distance: by_distance(plant, &*run.control.strategy),
        pi: PiProposal { gains, at, margins: at.margins(gains) },
    }
}

/// The slowest speed: there a change of it makes most of a width, and is seen last.
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

/// The rule AMIGO for a lag behind a dead time, which leaves Ms = 1.4 (Åström and
/// Hägglund 2006, *Advanced PID control*, section 7.3).
pub fn gains(plant: &LoopPlant) -> PiGains {
    let LoopPlant { gain_s: gain, dead_time_s: dead, lag_s: lag, .. } = *plant;
    let dead = dead.max(1e-3);
    let normalised_lag = lag / (lag + dead);
    let kp = (0.15 + 0.35 * lag / dead - normalised_lag * normalised_lag) / gain;
    let all = lag * lag + 12.0 * lag * dead + 7.0 * dead * dead;
    let reset_s = 0.35 * dead + 13.0 * dead * lag * lag / all;
    PiGains { kp_per_s: kp, ki_per_s2: kp / reset_s }
}
