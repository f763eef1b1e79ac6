//! Distance from the nozzle to the camera's gauge, from a bead whose speed changed while it was
//! laid.
//!
//! A width that is measured while the nozzle is at path position p belongs to bead laid at p −
//! d. The bead is w = A·(v/v₀)^−b, with the reported speed v averaged over the gauge. For each
//! d, the level and b are fitted to ln w by least squares. The sum of squares is smallest at
//! the offset, and its curvature gives the standard error.
//!
//! Widths are not independent: gauges overlap, the bead is rough, the flow drifts, and a
//! controller changes the very speed that is used here. Widths are therefore averaged over a
//! gauge length, and their residuals are modelled as independent noise plus a first-order
//! autoregressive process along the path, both with maximum likelihood. The sum of squares is
//! that of the normalised innovations (`whiten`): a drift counts neither as many observations
//! nor, where the controller follows it, as a response of the bead to the speed (Ljung 1999,
//! *System identification*, section 13.4, the direct approach). A block bootstrap is not used
//! because a bead with a few speed steps has too few blocks, and an effective sample size is
//! not used because it would leave the estimate itself biased.

mod data;
mod error;
mod estimate;
pub mod laid_speeds;
mod latency;
mod observation;
mod offset_profile;
mod whiten;

#[cfg(test)]
mod tests;

use data::PooledWidths;
pub use error::{CameraOffsetError, MIN_PIECES, MIN_WIDTHS};
pub use estimate::{EXPONENT_RANGE, OffsetEstimate, OffsetStudy, SpeedRange, WidthAtSpeed};
use laid_speeds::LaidSpeeds;
pub use latency::{LatencyEstimate, find_with_latency};
use observation::BeadObservation;
use offset_profile::{NearlyAsGood, OffsetProfile};
use whiten::WidthNoise;

use crate::core::{Mm, RobotState, Stamp};

/// Relative change of the speed below which no width responds measurably. A choice.
const MIN_SPEED_CHANGE: f64 = 0.01;
/// Fraction of a bead's speeds at either end that is excluded from their range.
const TAIL_FRACTION: f64 = 0.02;
/// Decrease of the sum of squares by the speed, in units of the noise variance, below which the
/// speed has no effect. Derived: five standard deviations squared, for the many offsets that
/// are tried.
const MIN_GAIN: f64 = 25.0;
/// Another offset is as good if its sum of squares is larger by at most four standard
/// deviations squared, or if it explains nine tenths of what the best one does.
const NEARLY_AS_GOOD: NearlyAsGood = NearlyAsGood { worse: 16.0, explained: 0.9 };
/// Offsets that explain this fraction of what the best one does are compared with it.
const MIN_RIVAL_FRACTION: f64 = 0.4;
/// Limit of the iterations of offset, exponent, noise and outliers.
const MAX_ITERATIONS: usize = 8;
/// Change of the offset below which the iteration has converged \[mm\].
const SETTLED_MM: f64 = 0.01;

/// A measured width with its time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedWidth {
    /// When its frame was captured.
    pub at: Stamp,
    /// The width.
    pub width: Mm,
    /// Its standard deviation according to the measurement; only ratios matter.
    pub sigma: Mm,
}

/// Range of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetSearch {
    /// Length of the gauge along the bead.
    pub gauge: Mm,
    /// Largest offset that is tried.
    pub max_offset: Mm,
}

/// The offset from the robot's reports, in order, and the measured widths.
pub fn find(
    states: &[(Stamp, RobotState)],
    widths: &[TimedWidth],
    search: OffsetSearch,
) -> Result<OffsetEstimate, CameraOffsetError> {
    study(states, widths, search).map(|study| study.estimate)
}

/// Estimates the offset, and returns the fitted model of the bead with it.
pub fn study(
    states: &[(Stamp, RobotState)],
    widths: &[TimedWidth],
    search: OffsetSearch,
) -> Result<OffsetStudy, CameraOffsetError> {
    let course = LaidSpeeds::of(states).ok_or(CameraOffsetError::NoPath)?;
    let count = widths.len();
    let observations: Vec<BeadObservation> =
        widths.iter().filter_map(|width| observed(&course, width)).collect();
    let speeds = changed_speeds(&course, observations.len())?;
    let settled = iterate(&course, &observations, search, speeds)?;
    settled.check(&course, &observations, search)?;
    let Converged { profile, best, .. } = &settled;
    let found = settled.estimate(&course, speeds, count);
    if found.sigma >= found.offset {
        return Err(CameraOffsetError::Uncertain { offset: found.offset, sigma: found.sigma });
    }
    let covariance = profile.covariance(best, found.sigma.get());
    let (ln_level, mean_ln_speed) = profile.level(best);
    let (widths, pieces) = profile.widths_at_speed(best);
    Ok(OffsetStudy {
        estimate: found,
        exponent_sigma: covariance[1].sqrt(),
        level_mm: ln_level.exp(),
        mean_speed_mm_per_s: mean_ln_speed.exp(),
        covariance,
        widths,
        pieces,
    })
}

/// The speeds of a bead, if there are enough widths and the speed has changed.
fn changed_speeds(course: &LaidSpeeds, widths: usize) -> Result<SpeedRange, CameraOffsetError> {
    if widths < MIN_WIDTHS {
        return Err(CameraOffsetError::TooFew { found: widths });
    }
    let speeds = course.range(TAIL_FRACTION);
    if speeds.max.get() < speeds.min.get() * (1.0 + MIN_SPEED_CHANGE) {
        return Err(CameraOffsetError::ConstantSpeed { speeds });
    }
    Ok(speeds)
}

fn observed(course: &LaidSpeeds, width: &TimedWidth) -> Option<BeadObservation> {
    let at = width.at;
    let (bead, path_mm) = course.path_at(at)?;
    let (value, sigma) = (width.width.get(), width.sigma.get());
    let (ln_width, relative_sigma) = (value.ln(), sigma / value);
    let is_sound = value > 0.0 && sigma >= 0.0;
    let since_capture_mm = 0.0;
    is_sound.then_some(BeadObservation {
        at,
        bead,
        path_mm,
        since_capture_mm,
        ln_width,
        relative_sigma,
    })
}

/// Consistent offset, exponent, noise and set of widths.
struct Converged {
    used: Vec<BeadObservation>,
    noise: WidthNoise,
    profile: OffsetProfile,
    best: offset_profile::OffsetFit,
}

/// Estimates them in turn until they do not change.
fn iterate(
    course: &LaidSpeeds,
    observations: &[BeadObservation],
    search: OffsetSearch,
    speeds: SpeedRange,
) -> Result<Converged, CameraOffsetError> {
    let mut noise = WidthNoise::INITIAL;
    let mut exponent = 0.5;
    let mut used = observations.to_vec();
    let mut before_mm = f64::NAN;
    let mut round = 0;
    loop {
        let data = PooledWidths::of(course, &used, exponent, search.gauge);
        let profile = OffsetProfile::new(data, noise);
        if profile.pieces() < MIN_PIECES {
            let (gauge, pieces) = (search.gauge, profile.pieces());
            return Err(CameraOffsetError::TooShort { gauge, pieces });
        }
        let best = profile.best(search.max_offset.get());
        if profile.gain(&best) < MIN_GAIN {
            return Err(CameraOffsetError::NoResponse { speeds, max_offset: search.max_offset });
        }
        let likeliest = profile.likeliest_noise(&best);
        let next =
            offset_profile::without_outliers(course, observations, search.gauge, &best, likeliest);
        if next.len() < MIN_WIDTHS {
            return Err(CameraOffsetError::TooFew { found: next.len() });
        }
        let settled = (best.offset_mm - before_mm).abs() < SETTLED_MM
            && likeliest == noise
            && next.len() == used.len();
        round += 1;
        if settled || round == MAX_ITERATIONS {
            return Ok(Converged { used, noise, profile, best });
        }
        (noise, exponent, used, before_mm) = (likeliest, best.exponent, next, best.offset_mm);
    }
}

impl Converged {
    /// The estimate, from so many widths in all.
    fn estimate(&self, course: &LaidSpeeds, speeds: SpeedRange, count: usize) -> OffsetEstimate {
        let Self { used, profile, best, .. } = self;
        OffsetEstimate {
            offset: mm(best.offset_mm),
            sigma: mm(profile.sigma_mm(best).hypot(course.position_sigma_mm())),
            exponent: best.exponent,
            at_bound: best.exponent <= EXPONENT_RANGE.0 || best.exponent >= EXPONENT_RANGE.1,
            speeds,
            used: used.len(),
            left_out: count - used.len(),
            residual_rms: profile.residual_rms(best),
        }
    }

    /// Whether the widths determine the best offset.
    fn check(
        &self,
        course: &LaidSpeeds,
        observations: &[BeadObservation],
        search: OffsetSearch,
    ) -> Result<(), CameraOffsetError> {
        let Self { profile, best, .. } = self;
        let farthest = search.max_offset;
        let step_mm = profile.step_mm();
        if best.offset_mm < 0.5 * step_mm || best.offset_mm > farthest.get() - 0.5 * step_mm {
            return Err(CameraOffsetError::AtEnd { at: mm(best.offset_mm), max_offset: farthest });
        }
        let rival =
            profile.rivals(best, farthest.get(), MIN_RIVAL_FRACTION).into_iter().find(|&rival| {
                // Compared on the widths that both can predict.
                let both = |look: &&BeadObservation| {
                    [best.offset_mm, rival].iter().all(|&d| course.covers(look, d, search.gauge))
                };
                let shared: Vec<BeadObservation> =
                    observations.iter().filter(both).copied().collect();
                if shared.len() < MIN_WIDTHS {
                    return true;
                }
                let data = PooledWidths::of(course, &shared, best.exponent, search.gauge);
                let profile = OffsetProfile::new(data, self.noise);
                let best = profile.near(best.offset_mm);
                profile.as_good(&profile.near(rival), &best, NEARLY_AS_GOOD)
            });
        rival.map_or(Ok(()), |second| {
            Err(CameraOffsetError::Ambiguous { first: mm(best.offset_mm), second: mm(second) })
        })
    }
}

fn mm(value: f64) -> Mm {
    Mm::new(value).unwrap_or(Mm::ZERO)
}
