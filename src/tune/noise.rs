//! Noise of the widths: independent from width to width, and a random walk along the path.

use serde::Serialize;

use super::Estimated;
use crate::identify::camera_offset::{OffsetStudy, WidthAtSpeed};
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Relative standard error of the noise times the square root of the number of differences: 1.17
/// for independent ones (the median deviation), more for differences with common widths. A choice.
const MEDIAN_ERROR_FACTOR: f64 = 1.5;
/// Ratio of the standard deviation of averaged widths to that expected from their noise; above it
/// the bead is rough. A choice.
const MIN_ROUGHNESS_RATIO: f64 = 1.3;
/// Tried variances of the random walk per millimetre, over that of an averaged width: a geometric
/// sequence.
const MIN_VARIANCE_RATIO: f64 = 1e-7;
const VARIANCE_RATIO_STEP: f64 = 1.25;
const VARIANCE_RATIOS: u32 = 100;
/// A practically infinite variance in these units: that of the state before the first width.
const UNKNOWN_VARIANCE: f64 = 1e9;
/// Derived: half the χ² quantile of one degree of freedom at 68.3 %, 1.00/2 (Wilks 1938).
const LN_LIKELIHOOD_DROP_1_SIGMA: f64 = 0.5;
/// Derived: half the χ² quantile of one degree of freedom at 95 %, 3.84/2 (Wilks 1938).
const LN_LIKELIHOOD_DROP_95: f64 = 1.92;

/// Components of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PlantNoise {
    /// Standard deviation of a single width, relative; independent from width to width.
    pub per_width: Estimated,
    /// Standard deviation of widths averaged over a gauge in excess of `per_width`, relative: the
    /// bead's roughness, which is common to widths with overlapping gauges.
    pub roughness: f64,
    /// Random walk along the path.
    pub drift: Drift,
}

/// Random walk of the flow per root metre, relative.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drift {
    /// Estimate of maximum likelihood with its interval of one standard deviation.
    Estimated {
        /// The estimate.
        per_root_m: f64,
        /// Lower end of the interval.
        low: f64,
        /// Upper end of the interval.
        high: f64,
    },
    /// No significant random walk; the upper limit at 95 %.
    AtMost(f64),
}

/// Components of the noise, from the residuals of the widths.
pub fn width_noise(study: &OffsetStudy) -> PlantNoise {
    let each = neighbour_noise(study, &study.widths);
    let pieces = neighbour_noise(study, &study.pieces).value;
    let widths: usize = study.pieces.iter().map(|piece| piece.count).sum();
    let per_piece = to_f64(widths) / to_f64(study.pieces.len()).max(1.0);
    let rough = (pieces.powi(2) - each.value.powi(2) / per_piece.max(1.0)).max(0.0).sqrt();
    // Widths whose gauges do not overlap differ only by their noise.
    let is_rough = pieces > each.value / per_piece.max(1.0).sqrt() * MIN_ROUGHNESS_RATIO;
    let roughness = if is_rough { rough } else { 0.0 };
    PlantNoise { per_width: each, roughness, drift: drift(&study.pieces) }
}

/// Noise of a width from the differences of successive widths, in which a drift cancels.
fn neighbour_noise(study: &OffsetStudy, samples: &[WidthAtSpeed]) -> Estimated {
    let pairs = samples.iter().zip(samples.iter().skip(1));
    let same = pairs.filter(|(before, after)| before.bead == after.bead);
    let change = |(before, after)| study.residual(after) - study.residual(before);
    let mut sizes: Vec<f64> = same.map(|pair| f64::abs(change(pair))).collect();
    let count = to_f64(sizes.len()).max(1.0);
    let value =
        rank::SIGMA_PER_MEDIAN * rank::median(&mut sizes).unwrap_or(0.0) / std::f64::consts::SQRT_2;
    Estimated { value, sigma: value * MEDIAN_ERROR_FACTOR / count.sqrt() }
}

/// Maximum-likelihood random walk in addition to independent noise, with level and exponent
/// eliminated (restricted likelihood, Patterson and Thompson 1971). The averaged widths are a
/// gauge apart, so that roughness within a gauge counts as noise.
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

/// Interval in which the log-likelihood exceeds a limit, by linear interpolation.
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

/// A random walk and its log-likelihood.
#[derive(Debug, Clone, Copy)]
struct WalkLikelihood {
    per_root_m: f64,
    ln: f64,
}

impl WalkLikelihood {
    /// Log-likelihood for a ratio of the walk's variance per millimetre to that of an averaged
    /// width. A Kalman filter (1960) gives the innovations, to which the exponent is fitted.
    fn of(pieces: &[WidthAtSpeed], ratio: f64) -> Self {
        let mut before: Option<&WidthAtSpeed> = None;
        let (mut variance, mut width, mut speed) = (UNKNOWN_VARIANCE, 0.0, 0.0);
        let [mut n, mut xx, mut xy, mut yy, mut logs] = [0.0; 5];
        for piece in pieces {
            match before.filter(|before| before.bead == piece.bead) {
                Some(before) => variance += ratio * (piece.path_mm - before.path_mm).abs(),
                None => variance = UNKNOWN_VARIANCE,
            }
            let total = variance + 1.0;
            let (y, x) = (piece.ln_width - width, piece.ln_speed - speed);
            // The first width of a bead determines only its level.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drops_of_the_likelihood_hold_one_sigma_and_95_percent() {
        for (drop, within) in
            [(LN_LIKELIHOOD_DROP_1_SIGMA, 0.682_689), (LN_LIKELIHOOD_DROP_95, 0.95)]
        {
            let phi = crate::numeric::normal_distribution::cumulative((2.0_f64 * drop).sqrt());
            assert!((2.0 * phi - 1.0 - within).abs() < 1e-4);
        }
    }
}
