//! One edge of a bead as a function of the position along the gauge's axis.

use super::outline::OutlineSample;
use crate::numeric::number::{to_count, to_f64};

/// An edge, sampled at each pixel along the gauge's axis; all in pixels.
#[derive(Debug, Clone)]
pub struct Contour {
    /// Position along the axis of the first sample.
    first: f64,
    cross: Vec<f64>,
    /// Slope of the position across the axis, and length of the edge, per pixel along the axis.
    slope: Vec<f64>,
    long: Vec<f64>,
}

/// The edge's tangent at the point of the edge that is nearest to a given point.
#[derive(Debug, Clone, Copy)]
pub struct Tangent {
    /// Distance of the given point from the tangent \[px\], positive towards growing positions
    /// across the axis.
    pub beyond: f64,
    /// Unit normal towards that side: component across the axis, component along it.
    pub normal: [f64; 2],
}

impl Contour {
    /// Positions across the axis of the polyline through the samples, at each whole position along
    /// the axis, from `margin` before the image to `margin` after it; NaN if it does not cross.
    pub fn new(samples: &[OutlineSample], side: usize, run: usize, margin: usize) -> Self {
        let first = -to_f64(margin);
        let mut cross = vec![f64::NAN; run + 2 * margin];
        for pair in samples.windows(2) {
            let (a, b) = (pair[0].projected[side], pair[1].projected[side]);
            let from = clamp_index((a.run - first).ceil(), cross.len());
            let past = clamp_index((b.run - first).floor() + 1.0, cross.len());
            for (number, crossing) in cross.iter_mut().enumerate().take(past).skip(from) {
                let fraction = (to_f64(number) + first - a.run) / (b.run - a.run);
                if fraction.is_finite() {
                    *crossing = a.cross + (b.cross - a.cross) * fraction;
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

    /// Position across the axis at a position along it; NaN if the edge is not seen there.
    pub fn crossing(&self, at: f64) -> f64 {
        let near = self.index(at);
        self.cross[near] + self.slope[near] * (at - self.first - to_f64(near))
    }

    /// First and last position across the axis within a distance of the edge; `None` if the edge
    /// is not seen there.
    pub fn span(&self, at: f64, distance: f64) -> Option<(f64, f64)> {
        let near = self.index(at);
        let reach = distance * self.long[near];
        let crossing = self.crossing(at);
        let (from, to) = (crossing - reach, crossing + reach);
        (from.is_finite() && to.is_finite()).then_some((from, to))
    }

    /// The tangent at the edge's point nearest to a point along and across the axis.
    pub fn tangent(&self, at: f64, position: f64) -> Tangent {
        let here = self.index(at);
        let slope = self.slope[here];
        let long = self.long[here];
        let foot = (position - self.cross[here]) * slope / (long * long);
        let near = self.index(at + foot);
        let near = if self.slope[near].is_finite() { near } else { here };
        let (cross, slope) = (self.cross[near], self.slope[near]);
        let past = at - self.first - to_f64(near);
        let long = self.long[near];
        Tangent {
            beyond: (position - cross - slope * past) / long,
            normal: [1.0 / long, -slope / long],
        }
    }
}

/// The whole number at or below a position, limited to 0..=`count`.
pub fn clamp_index(position: f64, count: usize) -> usize {
    to_count(position).min(count)
}
