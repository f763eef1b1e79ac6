//! One edge of a bead as a function of the place along the gauge's axis.

use super::outline::OutlineSample;
use crate::numeric::number::to_f64;

/// An edge, row by row of a vertical bead; all in pixels.
#[derive(Debug, Clone)]
pub struct Contour {
    /// Place along the axis of the first crossing.
    first: f64,
    cross: Vec<f64>,
    /// Growth of the crossing along the axis, and the length of the edge, both
    /// for one pixel along the axis.
    slope: Vec<f64>,
    long: Vec<f64>,
}

/// The edge's tangent where a point is nearest to it.
#[derive(Debug, Clone, Copy)]
pub struct Tangent {
    /// How far the point lies beyond the tangent, on the side of growing place
    /// across the axis \[px\].
    pub beyond: f64,
    /// Unit normal to that side: across the axis, along it.
    pub normal: [f64; 2],
}

impl Contour {
    /// Where the polyline through the samples crosses each whole place along
    /// the axis, from `margin` before the picture to `margin` after it; NaN
    /// where it does not.
    pub fn new(samples: &[OutlineSample], side: usize, run: usize, margin: usize) -> Self {
        let first = -to_f64(margin);
        let mut cross = vec![f64::NAN; run + 2 * margin];
        for pair in samples.windows(2) {
            let (a, b) = (pair[0].projected[side], pair[1].projected[side]);
            let from = clamp_index((a.run - first).ceil(), cross.len());
            let past = clamp_index((b.run - first).floor() + 1.0, cross.len());
            for (number, crossing) in cross.iter_mut().enumerate().take(past).skip(from) {
                let share = (to_f64(number) + first - a.run) / (b.run - a.run);
                if share.is_finite() {
                    *crossing = a.cross + (b.cross - a.cross) * share;
                }
            }
        }
        let slope: Vec<f64> = (0..cross.len())
            .map(|i| {
                let (a, b) = (i.saturating_sub(1), (i + 1).min(cross.len() - 1));
                (cross[b] - cross[a]) / to_f64(b - a)
            })
            .collect();
        let long = slope.iter().map(|slope| f64::hypot(1.0, *slope)).collect();
        Self { first, cross, slope, long }
    }

    fn index(&self, at: f64) -> usize {
        clamp_index(at - self.first + 0.5, self.cross.len() - 1)
    }

    /// Place across the axis at a place along it; NaN where it is not seen.
    pub fn crossing(&self, at: f64) -> f64 {
        let near = self.index(at);
        self.cross[near] + self.slope[near] * (at - self.first - to_f64(near))
    }

    /// First and last place across the axis within a distance of the edge.
    pub fn span(&self, at: f64, distance: f64) -> Option<(f64, f64)> {
        let near = self.index(at);
        let reach = distance * self.long[near];
        let crossing = self.crossing(at);
        let (from, to) = (crossing - reach, crossing + reach);
        (from.is_finite() && to.is_finite()).then_some((from, to))
    }

    /// The tangent at the edge's nearest point, for a point along and across
    /// the axis.
    pub fn tangent(&self, at: f64, place: f64) -> Tangent {
        let here = self.index(at);
        let slope = self.slope[here];
        let long = self.long[here];
        let foot = (place - self.cross[here]) * slope / (long * long);
        let near = self.index(at + foot);
        let near = if self.slope[near].is_finite() { near } else { here };
        let (cross, slope) = (self.cross[near], self.slope[near]);
        let past = at - self.first - to_f64(near);
        let long = self.long[near];
        Tangent {
            beyond: (place - cross - slope * past) / long,
            normal: [1.0 / long, -slope / long],
        }
    }
}

/// The whole number at or below a place, from 0 to `count`.
pub fn clamp_index(place: f64, count: usize) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates at 0, and at the picture's side right after"
    )]
    let number = place as usize;
    number.min(count)
}
