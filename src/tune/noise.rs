//! What the widths scatter by: independent from width to width, and what drifts along
//! the path.

use serde::Serialize;

use super::Estimated;
use crate::identify::camera_offset::{OffsetStudy, WidthAtSpeed};
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Relative standard deviation of such an estimate times the root of the count, for
/// differences of neighbours, each of which is in two.
const MEDIAN_ERROR_FACTOR: f64 = 1.5;
/// Times its noise by which a piece must differ from the next to count as rough.
const MIN_ROUGHNESS_RATIO: f64 = 1.3;
/// Variances of the walk for each millimetre that are tried, over that of a piece:
/// from the first by this factor.
const MIN_VARIANCE_RATIO: f64 = 1e-7;
const VARIANCE_RATIO_STEP: f64 = 1.25;
const VARIANCE_RATIOS: u32 = 100;
/// What is nothing in such units: the course before the first width.
const UNKNOWN_VARIANCE: f64 = 1e9;
/// Half the difference of logarithms of likelihood within which one and two standard
/// deviations lie.
const LN_LIKELIHOOD_DROP_1_SIGMA: f64 = 0.5;
const LN_LIKELIHOOD_DROP_95: f64 = 1.92;

/// How the scatter divides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlantNoise {
    /// From width to width, as a fraction of the width.
    pub per_width: Estimated,
    /// What means over a gauge's length scatter by beyond that, from one to the next, as
    /// a fraction: the bead is rough, and widths whose gauges overlap share it.
    pub roughness: f64,
    /// What drifts along the path.
    pub drift: Drift,
}

/// How far the flow drifts along a metre, as a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drift {
    /// The likeliest, and what one standard deviation to either side is.
    Estimated {
        /// The likeliest.
        per_root_m: f64,
        /// One standard deviation below.
        low: f64,
        /// One above.
        high: f64,
    },
    /// None was seen; with 95 % it is no more than this.
    AtMost(f64),
}

/// Divides the residuals of the widths.
pub fn width_noise(study: &OffsetStudy) -> PlantNoise {
    let each = neighbour_noise(study, &study.widths);
    let pieces = neighbour_noise(study, &study.pieces).value;
    let widths: usize = study.pieces.iter().map(|piece| piece.count).sum();
    let per_piece = to_f64(widths) / to_f64(study.pieces.len()).max(1.0);
    let rough = (pieces.powi(2) - each.value.powi(2) / per_piece.max(1.0)).max(0.0).sqrt();
    // Neighbours that share nothing of a gauge are no more apart than their noise.
    let rough = if pieces > each.value / per_piece.max(1.0).sqrt() * MIN_ROUGHNESS_RATIO {
        rough
    } else {
        0.0
    };
    PlantNoise { per_width: each, roughness: rough, drift: drift(&study.pieces) }
}

/// From the differences of neighbours, which share what drifts.
fn neighbour_noise(study: &OffsetStudy, samples: &[WidthAtSpeed]) -> Estimated {
    let pairs = samples.iter().zip(samples.iter().skip(1));
    let same = pairs.filter(|(before, after)| before.bead == after.bead);
    let mut sizes: Vec<f64> = same
        .map(|(before, after)| (study.residual(after) - study.residual(before)).abs())
        .collect();
    let count = to_f64(sizes.len()).max(1.0);
    let value =
        rank::SIGMA_PER_MEDIAN * rank::median(&mut sizes).unwrap_or(0.0) / std::f64::consts::SQRT_2;
    Estimated { value, sigma: value * MEDIAN_ERROR_FACTOR / count.sqrt() }
}

/// The likeliest walk beside independent noise, whatever level and exponent are
/// (restricted likelihood, Patterson and Thompson 1971). Pieces are a gauge long, so
/// that what is rough within a gauge counts as noise.
fn drift(pieces: &[WidthAtSpeed]) -> Drift {
    let tried = (0..VARIANCE_RATIOS)
        .map(|k| MIN_VARIANCE_RATIO * VARIANCE_RATIO_STEP.powi(i32::try_from(k).unwrap_or(0)));
    let each: Vec<WalkLikelihood> = tried.map(|ratio| WalkLikelihood::of(pieces, ratio)).collect();
    let none = WalkLikelihood::of(pieces, 0.0);
    let best = each.iter().copied().fold(none, |a, b| if b.ln > a.ln { b } else { a });
    if none.ln > best.ln - LN_LIKELIHOOD_DROP_95 {
        return Drift::AtMost(likelihood_interval(&each, best.ln - LN_LIKELIHOOD_DROP_95).1);
    }
    let (low, high) = likelihood_interval(&each, best.ln - LN_LIKELIHOOD_DROP_1_SIGMA);
    let per_root_m = best.per_root_m;
    Drift::Estimated { per_root_m, low: low.min(per_root_m), high: high.max(per_root_m) }
}

/// Sizes of the walk between which it is likelier than a limit, on the line between two
/// that were tried.
fn likelihood_interval(each: &[WalkLikelihood], limit: f64) -> (f64, f64) {
    let is_within = |one: &WalkLikelihood| one.ln > limit;
    let cross = |inside: &WalkLikelihood, outside: Option<&WalkLikelihood>| match outside {
        Some(outside) => {
            let fraction = (inside.ln - limit) / (inside.ln - outside.ln);
            inside.per_root_m + fraction * (outside.per_root_m - inside.per_root_m)
        }
        None => inside.per_root_m,
    };
    let end = |at: Option<usize>, beyond: &dyn Fn(usize) -> Option<usize>| {
        let inside = at.and_then(|at| each.get(at).zip(Some(beyond(at))));
        inside.map(|(one, beyond)| cross(one, beyond.and_then(|at| each.get(at))))
    };
    let low = end(each.iter().position(is_within), &|at| at.checked_sub(1));
    let high = end(each.iter().rposition(is_within), &|at| Some(at + 1));
    (low.unwrap_or(f64::INFINITY), high.unwrap_or(0.0))
}

/// A size of the walk and how likely it is.
#[derive(Debug, Clone, Copy)]
struct WalkLikelihood {
    per_root_m: f64,
    ln: f64,
}

impl WalkLikelihood {
    /// With the variance of a millimetre's walk over that of a piece's noise. The
    /// filter of Kalman (1960) gives what each piece differs from what those before it
    /// predict; the exponent is fitted to these.
    fn of(pieces: &[WidthAtSpeed], ratio: f64) -> Self {
        let mut before: Option<&WidthAtSpeed> = None;
        let (mut variance, mut width, mut speed) = (UNKNOWN_VARIANCE, 0.0, 0.0);
        let (mut n, mut xx, mut xy, mut yy, mut logs) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for piece in pieces {
            match before.filter(|before| before.bead == piece.bead) {
                Some(before) => variance += ratio * (piece.path_mm - before.path_mm).abs(),
                None => variance = UNKNOWN_VARIANCE,
            }
            let total = variance + 1.0;
            let (y, x) = (piece.ln_width - width, piece.ln_speed - speed);
            // The first of a bead tells its level and nothing else.
            if variance < UNKNOWN_VARIANCE {
                n += 1.0;
                xx += x * x / total;
                xy += x * y / total;
                yy += y * y / total;
                logs += total.ln();
            }
            let gain = variance / total;
            width += gain * y;
            speed += gain * x;
            variance *= 1.0 - gain;
            before = Some(piece);
        }
        let slope = if xx > 0.0 { xy / xx } else { 0.0 };
        let free = (n - 1.0_f64).max(1.0);
        let noise = ((yy - slope * xy) / free).max(f64::MIN_POSITIVE);
        let ln = -0.5 * (free * noise.ln() + logs + xx.max(f64::MIN_POSITIVE).ln());
        Self { per_root_m: (1000.0 * ratio * noise).sqrt(), ln }
    }
}
