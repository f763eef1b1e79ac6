//! How far behind the nozzle the camera looks, from a bead whose speed changed while it
//! was laid.
//!
//! A width that was measured while the nozzle was at the path p is that of bead laid at
//! p − d. The bead is w = A·(v/v₀)^−b with the speed v that the robot reported there, in
//! the mean over the gauge. For every d the level and b are fitted to ln w by least
//! squares; what is left is least at the offset, and how steeply it grows there says how
//! well the offset is known.
//!
//! Widths are no independent numbers: gauges overlap, the bead is wavy and the flow
//! drifts, and a controller answers to all that with the very speed that is looked at
//! here. So widths are taken together over a gauge's length, and what is left of them is
//! taken for independent noise on a course that wanders along the path, both as large as
//! is likeliest. The squares are those of what each differs from what the ones before it
//! foretell (`whiten`): a drift counts neither as many observations nor, where the
//! controller follows it, as an answer of the bead to the speed (Ljung 1999, *System
//! identification*, section 13.4, the direct approach). That is chosen over a bootstrap
//! of blocks because a bead with a few steps of the speed has too few blocks, and over a
//! number of effective samples because that leaves the answer itself as it is.

mod data;
mod error;
mod estimate;
pub mod laid_speeds;
mod observation;
mod offset_profile;
mod whiten;

#[cfg(test)]
mod tests;

use data::PooledWidths;
pub use error::{CameraOffsetError, MIN_PIECES, MIN_WIDTHS};
pub use estimate::{EXPONENT_RANGE, OffsetEstimate, OffsetStudy, SpeedRange, WidthAtSpeed};
use laid_speeds::LaidSpeeds;
use observation::BeadObservation;
use offset_profile::{NearlyAsGood, OffsetProfile};
use whiten::WidthNoise;

use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::core::units::Mm;

/// Change of the speed below which no width shows it.
const MIN_SPEED_CHANGE: f64 = 0.01;
/// Part of a bead's speeds, at either end, that does not count as their range.
const TAIL_FRACTION: f64 = 0.02;
/// Squares, in units of the noise, by which a speed that tells must lessen what is left:
/// five standard deviations, because many offsets are tried.
const MIN_GAIN: f64 = 25.0;
/// Another offset is as good if it is worse by no more than four standard deviations, or
/// explains nine tenths of what the best one does.
const NEARLY_AS_GOOD: NearlyAsGood = NearlyAsGood { worse: 16.0, explained: 0.9 };
/// Those that explain this part of it are held against the best.
const MIN_RIVAL_FRACTION: f64 = 0.4;
/// Times that offset, exponent, noise and the widths that count are found anew.
const MAX_ITERATIONS: usize = 8;
/// Change of the offset below which they are settled \[mm\].
const SETTLED_MM: f64 = 0.01;

/// A width that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimedWidth {
    /// When its frame was captured.
    pub at: Stamp,
    /// The width.
    pub width: Mm,
    /// Its standard deviation, as the measurement believes it; only how these compare
    /// with each other counts.
    pub sigma: Mm,
}

/// Where an offset is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetSearch {
    /// Length of the gauge along the bead.
    pub gauge: Mm,
    /// Largest offset that is tried.
    pub max_offset: Mm,
}

/// Finds the offset from what the robot reported, in order, and the widths that were
/// measured meanwhile.
pub fn find(
    states: &[(Stamp, RobotState)],
    widths: &[TimedWidth],
    search: OffsetSearch,
) -> Result<OffsetEstimate, CameraOffsetError> {
    study(states, widths, search).map(|study| study.estimate)
}

/// The same with all that is known of the bead.
pub fn study(
    states: &[(Stamp, RobotState)],
    widths: &[TimedWidth],
    search: OffsetSearch,
) -> Result<OffsetStudy, CameraOffsetError> {
    let course = LaidSpeeds::of(states).ok_or(CameraOffsetError::NoPath)?;
    let looks: Vec<BeadObservation> =
        widths.iter().filter_map(|width| observed(&course, width)).collect();
    if looks.len() < MIN_WIDTHS {
        return Err(CameraOffsetError::TooFew { found: looks.len() });
    }
    let speeds = course.range(TAIL_FRACTION);
    let SpeedRange { min: from, max: to } = speeds;
    if to.get() < from.get() * (1.0 + MIN_SPEED_CHANGE) {
        return Err(CameraOffsetError::ConstantSpeed { from, to });
    }
    let settled = iterate(&course, &looks, search, speeds)?;
    settled.check(&course, &looks, search)?;
    let Converged { profile, best, .. } = &settled;
    let found = OffsetEstimate {
        offset: mm(best.offset_mm),
        sigma: mm(profile.sigma_mm(best).hypot(course.position_sigma_mm())),
        exponent: best.exponent,
        at_bound: best.exponent <= EXPONENT_RANGE.0 || best.exponent >= EXPONENT_RANGE.1,
        speeds,
        used: settled.used.len(),
        left_out: widths.len() - settled.used.len(),
        residual_rms: profile.residual_rms(best),
    };
    if found.sigma >= found.offset {
        return Err(CameraOffsetError::Uncertain { offset: found.offset, sigma: found.sigma });
    }
    let covariance = profile.covariance(best, found.sigma.get());
    let (ln_level, mean_ln_speed) = profile.level(best);
    let (seen, pieces) = profile.widths_at_speed(best);
    Ok(OffsetStudy {
        estimate: found,
        exponent_sigma: covariance[1].sqrt(),
        level_mm: ln_level.exp(),
        mean_speed_mm_per_s: mean_ln_speed.exp(),
        covariance,
        widths: seen,
        pieces,
    })
}

fn observed(course: &LaidSpeeds, width: &TimedWidth) -> Option<BeadObservation> {
    let (bead, path_mm) = course.path_at(width.at)?;
    let (value, sigma) = (width.width.get(), width.sigma.get());
    let sound = value > 0.0 && sigma >= 0.0;
    sound.then(|| BeadObservation {
        bead,
        path_mm,
        ln_width: value.ln(),
        relative_sigma: sigma / value,
    })
}

/// Offset, exponent, noise and the widths that count, which fit each other.
struct Converged {
    used: Vec<BeadObservation>,
    noise: WidthNoise,
    profile: OffsetProfile,
    best: offset_profile::OffsetFit,
}

/// Finds them in turn, each with what is known of the others.
fn iterate(
    course: &LaidSpeeds,
    looks: &[BeadObservation],
    search: OffsetSearch,
    speeds: SpeedRange,
) -> Result<Converged, CameraOffsetError> {
    let mut noise = WidthNoise::INITIAL;
    let mut exponent = 0.5;
    let mut used = looks.to_vec();
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
            let SpeedRange { min: from, max: to } = speeds;
            return Err(CameraOffsetError::NoResponse { from, to, max_offset: search.max_offset });
        }
        let likeliest = profile.likeliest_noise(&best);
        let next = offset_profile::without_outliers(course, looks, search.gauge, &best, likeliest);
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
    /// Whether the best offset is one that the widths tell.
    fn check(
        &self,
        course: &LaidSpeeds,
        looks: &[BeadObservation],
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
                // Held against each other by widths that both can foretell.
                let both = |look: &&BeadObservation| {
                    [best.offset_mm, rival].iter().all(|&d| course.covers(look, d, search.gauge))
                };
                let shared: Vec<BeadObservation> = looks.iter().filter(both).copied().collect();
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
