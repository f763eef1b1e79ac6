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

mod course;
mod data;
mod error;
mod estimate;
mod observation;
mod offset_profile;
mod whiten;

#[cfg(test)]
mod tests;

use course::Course;
use data::Data;
pub use error::{FEWEST, FEWEST_PIECES, OffsetError};
pub use estimate::{EXPONENTS, Found, Seen, SpeedRange, Study};
use observation::Look;
use offset_profile::{NearlyAsGood, Profile};
use whiten::Noise;

use crate::core::robot::RobotState;
use crate::core::time::Stamp;
use crate::core::units::Mm;

/// Change of the speed below which no width shows it.
const LEAST_CHANGE: f64 = 0.01;
/// Part of a bead's speeds, at either end, that does not count as their range.
const TAIL: f64 = 0.02;
/// Squares, in units of the noise, by which a speed that tells must lessen what is left:
/// five standard deviations, because many offsets are tried.
const LEAST_GAIN: f64 = 25.0;
/// Another offset is as good if it is worse by no more than four standard deviations, or
/// explains nine tenths of what the best one does.
const NEARLY_AS_GOOD: NearlyAsGood = NearlyAsGood { worse: 16.0, explained: 0.9 };
/// Those that explain this part of it are held against the best.
const CANDIDATE: f64 = 0.4;
/// Times that offset, exponent, noise and the widths that count are found anew.
const MOST_ROUNDS: usize = 8;
/// Change of the offset below which they are settled \[mm\].
const SETTLED_MM: f64 = 0.01;

/// A width that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
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
pub struct Search {
    /// Length of the gauge along the bead.
    pub gauge: Mm,
    /// Largest offset that is tried.
    pub farthest: Mm,
}

/// Finds the offset from what the robot reported, in order, and the widths that were
/// measured meanwhile.
pub fn find(
    states: &[(Stamp, RobotState)],
    widths: &[Width],
    search: Search,
) -> Result<Found, OffsetError> {
    study(states, widths, search).map(|study| study.found)
}

/// The same with all that is known of the bead.
pub fn study(
    states: &[(Stamp, RobotState)],
    widths: &[Width],
    search: Search,
) -> Result<Study, OffsetError> {
    let course = Course::of(states).ok_or(OffsetError::NoPath)?;
    let looks: Vec<Look> = widths.iter().filter_map(|width| look(&course, width)).collect();
    if looks.len() < FEWEST {
        return Err(OffsetError::TooFew { found: looks.len() });
    }
    let speeds = course.range(TAIL);
    let SpeedRange { min: from, max: to } = speeds;
    if to.get() < from.get() * (1.0 + LEAST_CHANGE) {
        return Err(OffsetError::Steady { from, to });
    }
    let settled = settle(&course, &looks, search, speeds)?;
    settled.judge(&course, &looks, search)?;
    let Settled { profile, best, .. } = &settled;
    let found = Found {
        offset: mm(best.offset_mm),
        sigma: mm(profile.sigma_mm(best).hypot(course.lag_mm())),
        exponent: best.exponent,
        at_bound: best.exponent <= EXPONENTS.0 || best.exponent >= EXPONENTS.1,
        speeds,
        used: settled.used.len(),
        left_out: widths.len() - settled.used.len(),
        scatter: profile.scatter(best),
    };
    if found.sigma >= found.offset {
        return Err(OffsetError::Loose { offset: found.offset, sigma: found.sigma });
    }
    let covariance = profile.covariance(best, found.sigma.get());
    let (ln_level, mean_ln_speed) = profile.level(best);
    let (seen, pieces) = profile.seen(best);
    Ok(Study {
        found,
        exponent_sigma: covariance[1].sqrt(),
        level_mm: ln_level.exp(),
        mean_speed_mm_per_s: mean_ln_speed.exp(),
        covariance,
        seen,
        pieces,
    })
}

fn look(course: &Course, width: &Width) -> Option<Look> {
    let (bead, path_mm) = course.path_at(width.at)?;
    let (value, sigma) = (width.width.get(), width.sigma.get());
    let sound = value > 0.0 && sigma >= 0.0;
    sound.then(|| Look { bead, path_mm, ln_width: value.ln(), share: sigma / value })
}

/// Offset, exponent, noise and the widths that count, which fit each other.
struct Settled {
    used: Vec<Look>,
    noise: Noise,
    profile: Profile,
    best: offset_profile::Fit,
}

/// Finds them in turn, each with what is known of the others.
fn settle(
    course: &Course,
    looks: &[Look],
    search: Search,
    speeds: SpeedRange,
) -> Result<Settled, OffsetError> {
    let mut noise = Noise::FIRST;
    let mut exponent = 0.5;
    let mut used = looks.to_vec();
    let mut before_mm = f64::NAN;
    let mut round = 0;
    loop {
        let data = Data::of(course, &used, exponent, search.gauge);
        let profile = Profile::new(data, noise);
        if profile.pieces() < FEWEST_PIECES {
            let (gauge, pieces) = (search.gauge, profile.pieces());
            return Err(OffsetError::TooShort { gauge, pieces });
        }
        let best = profile.best(search.farthest.get());
        if profile.gain(&best) < LEAST_GAIN {
            let SpeedRange { min: from, max: to } = speeds;
            return Err(OffsetError::NotFollowing { from, to, farthest: search.farthest });
        }
        let likeliest = profile.likeliest_noise(&best);
        let next = offset_profile::those_that_count(course, looks, search.gauge, &best, likeliest);
        if next.len() < FEWEST {
            return Err(OffsetError::TooFew { found: next.len() });
        }
        let settled = (best.offset_mm - before_mm).abs() < SETTLED_MM
            && likeliest == noise
            && next.len() == used.len();
        round += 1;
        if settled || round == MOST_ROUNDS {
            return Ok(Settled { used, noise, profile, best });
        }
        (noise, exponent, used, before_mm) = (likeliest, best.exponent, next, best.offset_mm);
    }
}

impl Settled {
    /// Whether the best offset is one that the widths tell.
    fn judge(&self, course: &Course, looks: &[Look], search: Search) -> Result<(), OffsetError> {
        let Self { profile, best, .. } = self;
        let farthest = search.farthest;
        let step_mm = profile.step_mm();
        if best.offset_mm < 0.5 * step_mm || best.offset_mm > farthest.get() - 0.5 * step_mm {
            return Err(OffsetError::AtEnd { at: mm(best.offset_mm), farthest });
        }
        let rival = profile.rivals(best, farthest.get(), CANDIDATE).into_iter().find(|&rival| {
            // Held against each other by widths that both can foretell.
            let both = |look: &&Look| {
                [best.offset_mm, rival].iter().all(|&d| course.knows(look, d, search.gauge))
            };
            let shared: Vec<Look> = looks.iter().filter(both).copied().collect();
            if shared.len() < FEWEST {
                return true;
            }
            let data = Data::of(course, &shared, best.exponent, search.gauge);
            let profile = Profile::new(data, self.noise);
            let best = profile.near(best.offset_mm);
            profile.as_good(&profile.near(rival), &best, NEARLY_AS_GOOD)
        });
        rival.map_or(Ok(()), |second| {
            Err(OffsetError::Ambiguous { first: mm(best.offset_mm), second: mm(second) })
        })
    }
}

fn mm(value: f64) -> Mm {
    Mm::new(value).unwrap_or(Mm::ZERO)
}
