//! How steeply the overlay runs, position by position: where the edge is steepest,
//! and whether another step lies beside it.

use std::ops::Range;

use super::step::{BlurredStep, Clearance, NeighbourStep};
use super::{HALF_SPAN, Overlay, PHASES, SPAN};

/// Distance from the path within which the edge lies \[px\].
const MAX_EDGE_OFFSET_PX: f64 = 8.0;

/// Limits from which on a slope shows a step beside the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeLimits {
    /// Standard deviation of a slope by noise \[1/px\].
    pub noise: f64,
    /// Smallest slope of such a step, times the edge's blur.
    pub notable: f64,
}

/// Slopes over two pixels \[1/px\], weighted so that the sum over the phases is their mean.
pub struct ProfileSlopes([[f32; SPAN]; PHASES]);

impl ProfileSlopes {
    /// Those of an overlay.
    #[inline(always)]
    pub fn of(overlay: &Overlay) -> Self {
        let mut slopes = [[0.0; SPAN]; PHASES];
        let all = overlay.phases.iter().map(|phase| phase.rows).sum::<f32>().max(1.0);
        for (slopes, phase) in slopes.iter_mut().zip(&overlay.phases) {
            let (mean, fraction) = (&phase.samples, 0.5 * phase.rows / all);
            for k in 1..SPAN - 1 {
                slopes[k] = fraction * (mean[k + 1] - mean[k - 1]);
            }
            (slopes[0], slopes[SPAN - 1]) = (slopes[1], slopes[SPAN - 2]);
        }
        Self(slopes)
    }

    /// Mean slope at a distance in half pixels.
    #[inline(always)]
    fn at(&self, half: i16) -> f32 {
        let middle = i16::try_from(HALF_SPAN).unwrap_or(0);
        let mut sum = 0.0;
        for (phase, slopes) in (0i16..).zip(&self.0) {
            // The nearest sample, of two as near the one farther out.
            let twice = half + phase;
            let k = i16::midpoint(twice, twice.signum()) + middle;
            sum += slopes[usize::try_from(k).unwrap_or(0).min(SPAN - 1)];
        }
        sum
    }

    /// Steepest slope of the overlay near the path \[1/px\], and where.
    #[inline(always)]
    pub fn steepest(&self, room: Clearance) -> Option<(f64, f64)> {
        let most = MAX_EDGE_OFFSET_PX;
        let (from, to) = (halves(-room.before.min(most)), halves(room.after.min(most)));
        let mut best = (0.0, 0);
        for half in from..=to {
            let slope = self.at(half);
            if slope > best.0 {
                best = (slope, half);
            }
        }
        (best.0 > 0.01).then_some((f64::from(best.0), f64::from(best.1) / 2.0))
    }

    /// Room on one side up to half-way to a neighbouring step, and that step.
    #[expect(clippy::cast_possible_truncation, reason = "a slope needs no more")]
    #[inline(always)]
    pub fn up_to_neighbour(
        &self,
        start: BlurredStep,
        limits: SlopeLimits,
        sign: i16,
        room: f64,
    ) -> (f64, Option<NeighbourStep>) {
        let notable = (5.0 * limits.noise).max(limits.notable / start.blur.max(1.0)) as f32;
        let first = (0.5 * start.blur).clamp(0.5, 3.0);
        let mut lowest = (f32::INFINITY, room);
        let from = halves(start.at + f64::from(sign) * first);
        let last = halves(room - 1.0 - first);
        for step in 0..last {
            let slope = self.at(from + sign * step).abs();
            if slope < lowest.0 {
                lowest = (slope, first + f64::from(step) / 2.0);
            }
            if slope > lowest.0 + notable {
                return (lowest.1, self.flank(start.blur, from, sign, step..last));
            }
        }
        (room, None)
    }

    /// Steepest step from a position on, in half pixels; `None` where there is none.
    #[cold]
    fn flank(&self, blur: f64, from: i16, sign: i16, steps: Range<i16>) -> Option<NeighbourStep> {
        let mut best = (0.0f32, 0, 0.0f32);
        for step in steps {
            let half = from + sign * step;
            let slope = self.at(half);
            if slope.abs() < 0.7 * best.0 {
                break;
            }
            if slope.abs() > best.0 {
                best = (slope.abs(), half, slope);
            }
        }
        let (_, half, slope) = best;
        let height = f64::from(sign) * f64::from(slope) * blur * std::f64::consts::TAU.sqrt();
        (half != 0).then_some(NeighbourStep { at: f64::from(half) / 2.0, height, blur })
    }
}

/// A distance in half pixels.
#[expect(clippy::cast_possible_truncation, reason = "the window is short")]
fn halves(distance: f64) -> i16 {
    (2.0 * distance).round() as i16
}
