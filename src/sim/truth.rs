//! The true values of a rendered frame.

use super::outline::{BeadOutline, OutlineSample};
use super::view::{AxisPoint, BeadView, gauge_middle};
use crate::core::ImagePoint;
use crate::numeric::number::to_f64;
use crate::vision::{BeadAxis, Gauge};

/// The result of a perfect measurement of a rendered frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Mean distance of the edges on the surface, normal to the bead's axis \[mm\]. Each edge is
    /// averaged over its part within the gauge.
    pub width_mm: f64,
    /// Crossing of the left edge (upper edge of a horizontal bead) with the middle of the gauge,
    /// in raw image pixels.
    pub left: ImagePoint,
    /// The same crossing of the right (or lower) edge.
    pub right: ImagePoint,
    /// Standard deviation of the width about its mean, along the part of the bead whose two edges
    /// are within the gauge \[mm\].
    pub roughness_mm: f64,
}

/// `None` unless the bead runs through the whole gauge.
pub(super) fn of(outline: &BeadOutline, view: &BeadView, gauge: &Gauge) -> Option<Truth> {
    let middle = gauge_middle(&gauge.roi);
    let (run, count) = match gauge.axis {
        BeadAxis::Vertical => (middle.y, gauge.roi.height),
        BeadAxis::Horizontal => (middle.x, gauge.roi.width),
    };
    let half = to_f64(count) / 2.0;
    let segment = |side: usize| {
        let a = outline.along_at(side, run - half)?;
        let b = outline.along_at(side, run + half)?;
        Some((a.min(b), a.max(b)))
    };
    let (left, right) = (segment(0)?, segment(1)?);
    if !outline.is_whole(left.0.min(right.0), left.1.max(right.1)) {
        return None;
    }
    let offset = |side: usize, segment| mean(outline, segment, |s| s.offset_mm[side]);
    let both = (left.0.max(right.0), left.1.min(right.1));
    let width = |s: &OutlineSample| s.offset_mm[1] - s.offset_mm[0];
    let centre = mean(outline, both, width);
    let variance = mean(outline, both, |s| (width(s) - centre).powi(2));
    let point = |side: usize| {
        let cross = outline.crossing(side, run)?;
        Some(view.image_point(AxisPoint { run, cross }))
    };
    Some(Truth {
        width_mm: offset(1, right) - offset(0, left),
        left: point(0)?,
        right: point(1)?,
        roughness_mm: variance.max(0.0).sqrt(),
    })
}

/// Mean of a quantity along a segment of bead, linear between the samples.
fn mean(
    outline: &BeadOutline,
    (from_mm, to_mm): (f64, f64),
    of: impl Fn(&OutlineSample) -> f64,
) -> f64 {
    let mut sum = 0.0;
    let mut length = 0.0;
    for pair in outline.samples.windows(2) {
        let (mut a, mut b) = (&pair[0], &pair[1]);
        if a.along_mm > b.along_mm {
            (a, b) = (b, a);
        }
        let from = from_mm.max(a.along_mm);
        let to = to_mm.min(b.along_mm);
        if to > from {
            let middle = (0.5 * (from + to) - a.along_mm) / (b.along_mm - a.along_mm);
            let (at_a, at_b) = (of(a), of(b));
            sum += (to - from) * (at_a + (at_b - at_a) * middle);
            length += to - from;
        }
    }
    if length > 0.0 { sum / length } else { 0.0 }
}
