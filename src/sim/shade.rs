//! How much of each pixel is bead: the outline, blurred by the lens and
//! integrated over the pixels.

use super::edge::coverage;
use super::outline::{Outline, Sample, Stretch};
use super::view::View;

/// A Gaussian ends here, in standard deviations: 3·10⁻⁷ of a step is left.
const REACH: f64 = 5.0;
/// Half the diagonal of a pixel, and a little for the bend of an edge \[px\].
const AROUND_PX: f64 = 1.5;

/// One edge as a function of the place along the gauge's axis.
struct Edge {
    /// Place along the axis of the first crossing.
    first: f64,
    cross: Vec<f64>,
    /// Growth of the crossing along the axis, and the length of the edge, both
    /// for one pixel along the axis.
    slope: Vec<f64>,
    long: Vec<f64>,
}

/// A straight line across the bead, at one of its ends.
#[derive(Clone, Copy)]
struct End {
    run: f64,
    cross: f64,
    /// Unit normal that points into the bead: along the axis, across it.
    normal: [f64; 2],
}

/// Share of bead in every pixel of a picture with `run` by `cross` pixels
/// along and across the gauge's axis. `put` is told each stretch of pixels of
/// one line (its place along the axis), with the first place across and the
/// shares from there; pixels that it is not told hold no bead. Near an edge a
/// pixel sees the tangent at the nearest point of the edge.
pub fn shade(
    outline: &Outline,
    view: &View,
    (run, cross): (usize, usize),
    blur_px: f64,
    mut put: impl FnMut(usize, usize, &[f32]),
) {
    let edges = [0, 1].map(|side| Edge::new(&outline.samples, side, run, margin_px(blur_px)));
    let ends: Vec<(Option<End>, Option<End>)> =
        outline.stretches.iter().map(|stretch| ends_of(stretch, outline, view)).collect();
    let open = ends.iter().any(|ends| matches!(ends, (None, None)));
    let mut line = Vec::with_capacity(cross);
    for at in 0..run {
        let Some(first) = shade_line(&edges, whole(at), cross, blur_px, &mut line) else {
            continue;
        };
        if !open {
            for (share, across) in line.iter_mut().zip(first..) {
                *share *= share_of_ends(&ends, at, across, blur_px);
            }
        }
        put(at, first, &line);
    }
}

/// How far beyond the picture the outline is needed \[px\].
pub fn margin_px(blur_px: f64) -> usize {
    clamp((REACH * blur_px).ceil(), 1000) + 8
}

/// Fills one line of pixels; returns the first pixel that may hold bead.
fn shade_line(
    [left, right]: &[Edge; 2],
    at: f64,
    cross: usize,
    blur_px: f64,
    line: &mut Vec<f32>,
) -> Option<usize> {
    let (from, solid_from) = left.span(at, blur_px)?;
    let (solid_to, to) = right.span(at, blur_px)?;
    let first = clamp(from, cross);
    let last = clamp(to + 1.0, cross);
    line.clear();
    for number in first..last {
        let place = whole(number);
        let from_left = if place > solid_from { 1.0 } else { left.share(at, place, 1.0, blur_px) };
        let from_right = if place < solid_to { 1.0 } else { right.share(at, place, -1.0, blur_px) };
        #[expect(clippy::cast_possible_truncation, reason = "a share of one pixel")]
        line.push((from_left + from_right - 1.0).max(0.0) as f32);
    }
    (first < last).then_some(first)
}

fn clamp(place: f64, count: usize) -> usize {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates at 0, and at the picture's side right after"
    )]
    let number = place as usize;
    number.min(count)
}

impl Edge {
    /// Where the polyline through the samples crosses each whole place along
    /// the axis, from `margin` before the picture to `margin` after it; NaN
    /// where it does not.
    fn new(samples: &[Sample], side: usize, run: usize, margin: usize) -> Self {
        let first = -whole(margin);
        let mut cross = vec![f64::NAN; run + 2 * margin];
        for pair in samples.windows(2) {
            let (a, b) = (pair[0].seen[side], pair[1].seen[side]);
            let from = clamp((a.run - first).ceil(), cross.len());
            let past = clamp((b.run - first).floor() + 1.0, cross.len());
            for (number, crossing) in cross.iter_mut().enumerate().take(past).skip(from) {
                let share = (whole(number) + first - a.run) / (b.run - a.run);
                if share.is_finite() {
                    *crossing = a.cross + (b.cross - a.cross) * share;
                }
            }
        }
        let slope: Vec<f64> = (0..cross.len())
            .map(|i| {
                let (a, b) = (i.saturating_sub(1), (i + 1).min(cross.len() - 1));
                (cross[b] - cross[a]) / whole(b - a)
            })
            .collect();
        let long = slope.iter().map(|slope| f64::hypot(1.0, *slope)).collect();
        Self { first, cross, slope, long }
    }

    fn index(&self, at: f64) -> usize {
        clamp(at - self.first + 0.5, self.cross.len() - 1)
    }

    /// First and last place across the axis that the blurred edge touches on
    /// one line.
    fn span(&self, at: f64, blur_px: f64) -> Option<(f64, f64)> {
        let i = self.index(at);
        let reach = (REACH * blur_px + AROUND_PX) * self.long[i];
        let (from, to) = (self.cross[i] - reach, self.cross[i] + reach);
        (from.is_finite() && to.is_finite()).then_some((from, to))
    }

    /// Share of a pixel on the side of growing (`sign` 1) or falling (−1)
    /// place across the axis.
    fn share(&self, at: f64, place: f64, sign: f64, blur_px: f64) -> f64 {
        let here = self.index(at);
        let slope = self.slope[here];
        let long = self.long[here];
        let foot = (place - self.cross[here]) * slope / (long * long);
        let near = self.index(at + foot);
        let near = if self.slope[near].is_finite() { near } else { here };
        let (cross, slope) = (self.cross[near], self.slope[near]);
        let past = at - self.first - whole(near);
        let long = self.long[near];
        let inside = sign * (place - cross - slope * past) / long;
        coverage(inside, [sign / long, -sign * slope / long], blur_px)
    }
}

/// The ends of a stretch that are in sight.
fn ends_of(stretch: &Stretch, outline: &Outline, view: &View) -> (Option<End>, Option<End>) {
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
        // Across the bead is to the growing side, so this normal points along
        // growing `run`; travel may go the other way.
        let sign = sign * view.run_sign();
        let normal = [sign * cross / long, -sign * run / long];
        normal[0].is_finite().then_some(End { run: left.run, cross: left.cross, normal })
    };
    (end(stretch.from_mm, 1.0), end(stretch.to_mm, -1.0))
}

/// Share of a pixel that lies between the ends of any stretch.
fn share_of_ends(
    ends: &[(Option<End>, Option<End>)],
    at: usize,
    across: usize,
    blur_px: f64,
) -> f32 {
    let inside = |end: &Option<End>| {
        end.map_or(1.0, |end| {
            let (run, cross) = (whole(at) - end.run, whole(across) - end.cross);
            coverage(run * end.normal[0] + cross * end.normal[1], end.normal, blur_px)
        })
    };
    let sum: f64 = ends.iter().map(|(from, to)| (inside(from) + inside(to) - 1.0).max(0.0)).sum();
    #[expect(clippy::cast_possible_truncation, reason = "a share of one pixel")]
    let share = sum.min(1.0) as f32;
    share
}

/// A number of pixels as a length in pixels.
#[expect(clippy::cast_precision_loss, reason = "pixel numbers stay far below 2^53")]
fn whole(number: usize) -> f64 {
    number as f64
}
