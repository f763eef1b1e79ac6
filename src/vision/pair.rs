//! Which contours belong together: the two edges of the bead. Their polarity
//! and distance are those of the cell, and no gap as deep as the bead itself
//! lies between them. A seam or a rib within the bead is no edge while it is clearly
//! weaker than the edges; where it is not, two pairs fit.

use super::contour::{EdgeContour, EdgeContours};
use super::gauge::WidthRangePx;
use crate::numeric::number::narrow_to_f32;
use crate::numeric::rank;

/// Depth of a gap between two edges, as a fraction of the weaker one, that shows them
/// to belong to two beads: it is deeper than the bead is high over the ground.
const MIN_GAP_RATIO: f32 = 1.1;
/// Depth of a gap up to which it is a seam within one bead. Measured: reference/accuracy.md, Drawn
/// frames: lines of up to 60 % of the contrast (`ribs-weak`) are no edges; a little is left to
/// noise.
pub const MAX_SEAM_RATIO: f32 = 0.64;
/// Strength of a pair within another one, as a fraction of the other's, from which on it
/// fits as well: a rib of 81 % of the edges.
pub const MIN_RIVAL_RATIO: f32 = 0.9;
/// Smallest difference in width of two pairs: as a fraction of the width, or in pixels if less.
const SAME_WIDTH_FRACTION: f32 = 0.03;
const SAME_WIDTH_PX: f32 = 5.0;
/// Smallest fraction of the bands in which a gap is seen, relative to that of the bead's edges.
const MIN_GAP_BAND_RATIO: f64 = 0.85;

/// The two edges of the bead among the contours, by their numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EdgePair {
    /// Number of the left contour.
    pub left: usize,
    /// Number of the right one.
    pub right: usize,
    /// Geometric mean of the two steps \[grey levels\].
    pub step: f32,
    /// Smaller of the fractions of bands in which they are seen.
    pub band_fraction: f64,
    /// Step of the weaker edge, less where it is not seen all along \[grey levels\].
    pub strength: f32,
    /// How good the pair is, comparable between searches on the same frame.
    pub score: f32,
    /// Its width \[px\].
    pub width_px: f32,
    /// Depth of the deepest gap between its edges, as a fraction of the weaker one.
    pub gap: f32,
    /// Width of another pair within this one that fits as well \[px\].
    pub rival_px: Option<f32>,
}

/// Contours of left and right edges.
#[derive(Debug, Clone, Copy)]
pub struct Sides<'a> {
    /// Contours that may be left edges.
    pub lefts: &'a EdgeContours,
    /// Contours that may be right edges.
    pub rights: &'a EdgeContours,
}

impl<'a> Sides<'a> {
    /// The left and the right edge of a pair.
    pub fn of(self, pair: &EdgePair) -> [&'a EdgeContour; 2] {
        [&self.lefts.all()[pair.left], &self.rights.all()[pair.right]]
    }
}

/// The best pair of contours, or none.
pub fn find(sides: Sides<'_>, range: WidthRangePx, scratch: &mut Vec<f32>) -> Option<EdgePair> {
    let mut best: Option<EdgePair> = None;
    each(sides, range, scratch, |pair| {
        if best.is_none_or(|best| best.score < pair.score) {
            let gap = gap(sides, &pair) / weaker(sides.of(&pair));
            if gap < MIN_GAP_RATIO {
                best = Some(EdgePair { gap, ..pair });
            }
        }
    });
    let best = best?;
    let mut rival: Option<EdgePair> = None;
    each(sides, range, scratch, |pair| {
        let (inner, outer) =
            if pair.width_px < best.width_px { (pair, best) } else { (best, pair) };
        let fits = pair.strength >= MIN_RIVAL_RATIO * best.strength
            || outer == best && best.gap > MAX_SEAM_RATIO;
        let better = rival.is_none_or(|rival| rival.score < pair.score);
        if fits
            && better
            && is_within(sides, &inner, &outer)
            && (outer == best || gap(sides, &outer) < MIN_GAP_RATIO * weaker(sides.of(&outer)))
        {
            rival = Some(pair);
        }
    });
    Some(EdgePair { rival_px: rival.map(|rival| rival.width_px), ..best })
}

/// Whether a pair is so much narrower than another that it is not the same.
pub fn is_narrower(inner_px: f32, outer_px: f32) -> bool {
    inner_px < outer_px - (SAME_WIDTH_FRACTION * outer_px).min(SAME_WIDTH_PX)
}

/// Step of the weaker one of two edges \[grey levels\].
fn weaker([left, right]: [&EdgeContour; 2]) -> f32 {
    left.step.min(right.step)
}

/// Whether a pair has one edge in common with another pair, and ends within it at a
/// seam or a rib, which has two lines of its own.
fn is_within(sides: Sides<'_>, inner: &EdgePair, outer: &EdgePair) -> bool {
    let ([left, right], [inner_left, inner_right]) = (sides.of(outer), sides.of(inner));
    let least = MAX_SEAM_RATIO * outer.step;
    let within =
        |line: &&EdgeContour| line.step >= least && in_order(left, line) && in_order(line, right);
    let narrower = is_narrower(inner.width_px, outer.width_px);
    let ends_within = inner.left == outer.left
        && within(&inner_right)
        && sides.lefts.all().iter().any(|line| within(&line));
    let begins_within = inner.right == outer.right
        && within(&inner_left)
        && sides.rights.all().iter().any(|line| within(&line));
    narrower && (ends_within || begins_within)
}

/// All pairs whose width is within the range.
fn each(
    sides: Sides<'_>,
    range: WidthRangePx,
    scratch: &mut Vec<f32>,
    mut visit: impl FnMut(EdgePair),
) {
    for (left, edge) in sides.lefts.all().iter().enumerate() {
        for (right, other) in sides.rights.all().iter().enumerate() {
            let Some(width_px) = distance(edge, other, scratch) else { continue };
            if width_px < range.min || width_px > range.max {
                continue;
            }
            let step = (edge.step * other.step).sqrt();
            let band_fraction = edge.band_fraction.min(other.band_fraction);
            let strength =
                edge.step.min(other.step) * narrow_to_f32(edge.band_fraction * other.band_fraction);
            let score = strength / ((1.0 + edge.waviness_px) * (1.0 + other.waviness_px)).sqrt();
            let pair = EdgePair { left, right, width_px, ..EdgePair::default() };
            visit(EdgePair { step, band_fraction, strength, score, ..pair });
        }
    }
}

/// Median distance from one contour to another to its right \[px\]; `None`
/// where they do not run side by side or cross.
fn distance(left: &EdgeContour, right: &EdgeContour, scratch: &mut Vec<f32>) -> Option<f32> {
    scratch.clear();
    let both = left.at.iter().zip(&right.at);
    scratch.extend(both.filter_map(|(left, right)| Some((*right)? - (*left)?)));
    if scratch.len() * 5 < left.at.len() {
        return None;
    }
    rank::median(scratch).filter(|&median| median > 0.0)
}

/// Depth of the deepest gap between two edges: a contour out of the bead,
/// followed by one back in, both about as whole as the edges are.
fn gap(sides: Sides<'_>, pair: &EdgePair) -> f32 {
    let [left, right] = sides.of(pair);
    let whole = MIN_GAP_BAND_RATIO * left.band_fraction.min(right.band_fraction);
    let mut deepest: f32 = 0.0;
    for out in sides.rights.all().iter().filter(|out| out.band_fraction >= whole) {
        if !in_order(left, out) || !in_order(out, right) {
            continue;
        }
        for back in sides.lefts.all().iter().filter(|back| back.band_fraction >= whole) {
            if in_order(out, back) && in_order(back, right) {
                deepest = deepest.max(out.step.min(back.step));
            }
        }
    }
    deepest
}

/// Whether one contour runs to the left of another wherever both are seen,
/// which must be in most bands.
fn in_order(left: &EdgeContour, right: &EdgeContour) -> bool {
    let (mut both, mut ordered) = (0, 0);
    for (left, right) in left.at.iter().zip(&right.at) {
        if let (Some(left), Some(right)) = (left, right) {
            both += 1;
            ordered += usize::from(left < right);
        }
    }
    2 * both >= left.at.len() && 20 * ordered >= 19 * both
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::edge::{StepCandidates, respond};

    /// Contours up and down of bright bars on dark ground.
    fn bars(bars: &[(usize, usize, u16)]) -> (EdgeContours, EdgeContours) {
        let mut profile = vec![160; 200];
        for &(from, to, height) in bars {
            for value in &mut profile[from..to] {
                *value += 4 * height;
            }
        }
        contours(&profile)
    }

    fn contours(profile: &[u16]) -> (EdgeContours, EdgeContours) {
        let mut response = vec![0; 200];
        respond(profile, &mut response);
        let mut steps = StepCandidates::default();
        steps.find(&response, 5.0, 0.0625);
        let bands = vec![steps; 20];
        let (mut up, mut down) = (EdgeContours::default(), EdgeContours::default());
        up.search(&bands, true, 4.0, 0.4);
        down.search(&bands, false, 4.0, 0.4);
        (up, down)
    }

    fn found(
        bars: &(EdgeContours, EdgeContours),
        range: WidthRangePx,
        scratch: &mut Vec<f32>,
    ) -> Option<EdgePair> {
        find(Sides { lefts: &bars.0, rights: &bars.1 }, range, scratch)
    }

    fn width(bars: &(EdgeContours, EdgeContours), range: WidthRangePx) -> Option<f32> {
        let mut scratch = Vec::new();
        let pair = found(bars, range, &mut scratch)?;
        distance(&bars.0.all()[pair.left], &bars.1.all()[pair.right], &mut scratch)
    }

    const WIDE: WidthRangePx = WidthRangePx { min: 10.0, max: 80.0 };

    #[test]
    fn two_beads_with_a_gap_are_as_likely_as_one_with_a_seam() {
        let bars = bars(&[(50, 75, 80), (85, 110, 80)]);
        let mut scratch = Vec::new();
        let both = found(&bars, WIDE, &mut scratch).unwrap();
        assert!(both.rival_px.is_some(), "{both:?}");
        let one = found(&bars, WidthRangePx { min: 10.0, max: 40.0 }, &mut scratch).unwrap();
        assert!((one.width_px - 25.0).abs() < 0.5 && one.rival_px.is_none(), "{one:?}");
    }

    #[test]
    fn a_gap_that_is_deeper_than_the_ground_is_not_bridged() {
        let mut profile = vec![160 + 4 * 40; 200];
        let ground = 160;
        for (from, to, height) in [(40, 70, 120), (70, 90, 0), (90, 130, 120)] {
            profile[from..to].fill(ground + 4 * height);
        }
        let (up, down) = contours(&profile);
        assert!((width(&(up, down), WIDE).unwrap() - 40.0).abs() < 0.5);
    }

    #[test]
    fn a_seam_is_no_edge_while_it_is_weak_and_leaves_two_widths_where_it_is_not() {
        let seamed = |level: u16| bars(&[(50, 70, 80), (70, 78, level), (78, 110, 80)]);
        let mut scratch = Vec::new();
        let mut pair = |level: u16| {
            let bars = seamed(level);
            found(&bars, WIDE, &mut scratch).unwrap()
        };
        let weak = pair(40);
        assert!((weak.width_px - 60.0).abs() < 0.5 && weak.rival_px.is_none(), "{weak:?}");
        let strong = pair(16);
        assert!((strong.width_px - 60.0).abs() < 0.5, "{strong:?}");
        let rival = strong.rival_px.unwrap();
        assert!([20.0, 32.0].iter().any(|one: &f32| (rival - one).abs() < 0.5), "{strong:?}");
        let range = WidthRangePx { min: 45.0, max: 80.0 };
        let bars = seamed(16);
        let alone = found(&bars, range, &mut scratch).unwrap();
        assert!((alone.width_px - 60.0).abs() < 0.5 && alone.rival_px.is_none(), "{alone:?}");
    }

    #[test]
    fn a_fainter_bead_beside_it_is_not_the_bead() {
        let bars = bars(&[(40, 70, 50), (90, 130, 80)]);
        assert!((width(&bars, WIDE).unwrap() - 40.0).abs() < 0.5);
    }

    #[test]
    fn a_width_out_of_range_is_no_pair() {
        let bars = bars(&[(60, 100, 80)]);
        assert!((width(&bars, WIDE).unwrap() - 40.0).abs() < 0.5);
        assert_eq!(width(&bars, WidthRangePx { min: 50.0, max: 90.0 }), None);
    }
}
