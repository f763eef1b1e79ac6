//! Settings that follow from what was found.

use serde::Serialize;

use super::noise::Drift;
use super::plant::Plant;
use super::stability::{LoopMargins, LoopPlant};
use crate::cell::file::RunPart;
use crate::width_control::limiter::Limits;
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::Strategy;
use crate::width_control::strategy::distance::DistanceStrategy;

/// How far the flow is said to wander along a metre unless less is known; that of the
/// law by distance.
const USUAL_DRIFT: f64 = 0.0055;
/// Range of what may be said.
const DRIFTS: (f64, f64) = (1e-4, 0.2);
/// Least that is claimed of the camera's distance \[mm\]: nozzles drip and paths round
/// their corners.
const LEAST_OFFSET_SIGMA_MM: f64 = 0.5;

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
pub fn propose(plant: &Plant, run: &RunPart) -> Proposal {
    let at = worst(plant, run.control.target.nominal().get(), &run.limits);
    let gains = gains(&at);
    Proposal {
        distance: by_distance(plant, &*run.control.strategy),
        pi: PiProposal { gains, at, margins: at.margins(gains) },
    }
}

/// The slowest speed: there a change of it makes most of a width, and is seen last.
pub fn worst(plant: &Plant, target_mm: f64, limits: &Limits) -> LoopPlant {
    LoopPlant::at(plant, target_mm, limits.min_speed.get().max(1.0))
}

fn by_distance(plant: &Plant, now: &dyn Strategy) -> DistanceProposal {
    let drift_per_root_m = match plant.scatter.drift {
        Drift::Found { per_root_m, .. } => per_root_m,
        Drift::AtMost(most) => USUAL_DRIFT.min(most),
    };
    DistanceProposal {
        exponent: plant.exponent.value,
        offset_mm: plant.offset_mm.value,
        offset_sigma_mm: plant.offset_mm.sigma.max(LEAST_OFFSET_SIGMA_MM),
        drift_per_root_m: drift_per_root_m.clamp(DRIFTS.0, DRIFTS.1),
        learns: now.as_kind::<DistanceStrategy>().is_none_or(|now| now.learns_exponent),
    }
}

/// The rule AMIGO for a lag behind a dead time, which leaves Ms = 1.4 (Åström and
/// Hägglund 2006, *Advanced PID control*, section 7.3).
pub fn gains(plant: &LoopPlant) -> PiGains {
    let LoopPlant { gain_s: gain, dead_s: dead, lag_s: lag, .. } = *plant;
    let dead = dead.max(1e-3);
    let share = lag / (lag + dead);
    let kp = (0.15 + 0.35 * lag / dead - share * share) / gain;
    let all = lag * lag + 12.0 * lag * dead + 7.0 * dead * dead;
    let reset_s = 0.35 * dead + 13.0 * dead * lag * lag / all;
    PiGains { kp_per_s: kp, ki_per_s2: kp / reset_s }
}
