//! Fraction of bead in each pixel: the outline, blurred by the lens and integrated over the
//! pixels.

use super::contour::{Contour, clamp_index};
use super::edge::coverage;
use super::outline::{BeadOutline, LaidSegment};
use super::view::{BeadView, GaugeExtent};
use crate::numeric::number::{narrow_to_f32, to_f64};

/// Distance at which a Gaussian ends, in standard deviations. Derived: Φ(−5) = 3·10⁻⁷ of a step
/// is left.
pub const GAUSSIAN_REACH_SIGMAS: f64 = 5.0;
/// Margin about an edge \[px\]. Derived: half the diagonal of a pixel, √2/2, and 0.8 px for the
/// curvature of an edge.
const EDGE_MARGIN_PX: f64 = 1.5;

/// A straight end of the bead, across it.
#[derive(Debug, Clone, Copy)]
struct End {
    run: f64,
    cross: f64,
    /// Unit normal into the bead: component along the axis, component across it.
    normal: [f64; 2],
}

/// The shape of a bead in the image; all in pixels along and across the gauge's axis.
#[derive(Debug, Clone)]
pub struct BeadShape {
    /// The left and the right edge.
    pub edges: [Contour; 2],
    /// Pixels along and across the axis.
    pub extent: GaugeExtent,
    /// Standard deviation of the lens' blur \[px\].
    pub blur_px: f64,
    /// Ends of each segment; empty if the bead runs through the whole image.
    ends: Vec<(Option<End>, Option<End>)>,
}

impl BeadShape {
    /// The shape of an outline in an image with `extent` pixels along and across the gauge's axis.
    pub fn new(outline: &BeadOutline, view: &BeadView, extent: GaugeExtent, blur_px: f64) -> Self {
        let margin = margin_px(blur_px);
        let edges = [0, 1].map(|side| Contour::new(&outline.samples, side, extent.run, margin));
        let mut ends: Vec<(Option<End>, Option<End>)> =
            outline.segments.iter().map(|segment| ends_of(segment, outline, view)).collect();
        if ends.iter().any(|ends| matches!(ends, (None, None))) {
            ends.clear();
        }
        Self { edges, extent, blur_px, ends }
    }

    /// Fills `line` with the fractions of bead in the pixels of one line across the bead, and
    /// returns the index of the first of them; all other pixels have no bead. The image is shifted
    /// by `shift` \[px\] along and across the axis. Near an edge a pixel uses the tangent at the
    /// edge's nearest point. `None` if no pixel has bead.
    pub fn line(&self, at: usize, shift: [f64; 2], line: &mut Vec<f32>) -> Option<usize> {
        let [left, right] = &self.edges;
        let (at, reach) =
            (to_f64(at) + shift[0], GAUSSIAN_REACH_SIGMAS * self.blur_px + EDGE_MARGIN_PX);
        let (from, solid_from) = left.span(at, reach)?;
        let (solid_to, to) = right.span(at, reach)?;
        let first = clamp_index(from - shift[1], self.extent.cross);
        let last = clamp_index(to - shift[1] + 1.0, self.extent.cross);
        line.clear();
        for number in first..last {
            let position = to_f64(number) + shift[1];
            let from_left =
                if position > solid_from { 1.0 } else { self.edge_fraction(0, at, position) };
            let from_right =
                if position < solid_to { 1.0 } else { self.edge_fraction(1, at, position) };
            line.push(narrow_to_f32((from_left + from_right - 1.0).max(0.0)));
        }
        if !self.ends.is_empty() {
            for (fraction, number) in line.iter_mut().zip(first..) {
                *fraction *= self.laid_fraction(at, to_f64(number) + shift[1]);
            }
        }
        (first < last).then_some(first)
    }

    /// Whether a point is within the bead.
    pub fn holds(&self, at: f64, position: f64) -> bool {
        let [left, right] = &self.edges;
        let between = left.crossing(at) <= position && position <= right.crossing(at);
        between && self.laid(at, position, 0.0) > 0.5
    }

    /// Fraction of a pixel on the inner side of an edge, 0 to 1.
    fn edge_fraction(&self, side: usize, at: f64, position: f64) -> f64 {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let tangent = self.edges[side].tangent(at, position);
        coverage(sign * tangent.beyond, tangent.normal, self.blur_px)
    }

    /// Fraction of a pixel between the two ends of any segment, with the blur of the edges.
    pub fn laid_fraction(&self, at: f64, position: f64) -> f32 {
        narrow_to_f32(self.laid(at, position, self.blur_px))
    }

    /// Fraction of a pixel between the two ends of any segment, with this blur.
    fn laid(&self, at: f64, position: f64, blur_px: f64) -> f64 {
        if self.ends.is_empty() {
            return 1.0;
        }
        let inside = |end: &Option<End>| {
            end.map_or(1.0, |end| {
                let (run, cross) = (at - end.run, position - end.cross);
                coverage(run * end.normal[0] + cross * end.normal[1], end.normal, blur_px)
            })
        };
        let both = |(from, to): &(_, _)| (inside(from) + inside(to) - 1.0).max(0.0);
        self.ends.iter().map(both).sum::<f64>().min(1.0)
    }
}

/// Distance beyond the image for which the outline is needed \[px\].
pub fn margin_px(blur_px: f64) -> usize {
    clamp_index((GAUSSIAN_REACH_SIGMAS * blur_px).ceil(), 1000) + 8
}

/// The ends of a segment that are in view.
fn ends_of(
    segment: &LaidSegment,
    outline: &BeadOutline,
    view: &BeadView,
) -> (Option<End>, Option<End>) {
    let end = |along_mm: f64, sign: f64| {
        if !along_mm.is_finite() {
            return None;
        }
        let near = outline.samples.iter().min_by(|a, b| {
            (a.along_mm - along_mm).abs().total_cmp(&(b.along_mm - along_mm).abs())
        })?;
        let left = view.px(along_mm, near.offset_mm[0])?;
        let right = view.px(along_mm, near.offset_mm[1])?;
        let (run, cross) = (right.run - left.run, right.cross - left.cross);
        let long = f64::hypot(run, cross);
        // The direction across the bead is that of growing `cross`, so this normal points to
        // growing `run`; the direction of travel may be opposite.
        let sign = sign * view.run_sign();
        let normal = [sign * cross / long, -sign * run / long];
        normal[0].is_finite().then_some(End { run: left.run, cross: left.cross, normal })
    };
    (end(segment.from_mm, 1.0), end(segment.to_mm, -1.0))
}
