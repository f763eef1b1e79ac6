//! Which contours belong together: the two edges of the bead. Their polarity
//! and distance are those of the cell, and no gap as deep as the bead itself
//! lies between them.

use super::contour::{Contour, Contours};
use super::rank;

/// Depth of a gap between two edges, as a share of their step, that shows them
/// to belong to two beads.
const GAP_SHARE: f32 = 0.5;
/// Share of the bands in which a gap is seen, in that of the bead's edges.
const WHOLE: f64 = 0.85;

/// What pairs are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Narrowest and widest pair \[px\].
    pub width_px: (f32, f32),
}

/// The two edges of the bead among the contours, by their numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Number of the left contour.
    pub left: usize,
    /// Number of the right one.
    pub right: usize,
    /// Geometric mean of the two steps \[grey levels\].
    pub step: f32,
    /// Smaller of the shares of bands in which they are seen.
    pub share: f64,
    /// How good the pair is, comparable between searches on the same frame.
    pub score: f32,
}

/// The best pair of contours, or none.
pub fn find(
    lefts: &Contours,
    rights: &Contours,
    search: Search,
    memory: &mut Vec<f32>,
) -> Option<Pair> {
    let mut best: Option<Pair> = None;
    for (left, edge) in lefts.all().iter().enumerate() {
        for (right, other) in rights.all().iter().enumerate() {
            let Some(width) = distance(edge, other, memory) else { continue };
            if width < search.width_px.0 || width > search.width_px.1 {
                continue;
            }
            let step = (edge.step * other.step).sqrt();
            let share = edge.share.min(other.share);
            #[expect(clippy::cast_possible_truncation, reason = "a share")]
            let shares = (edge.share * other.share) as f32;
            let score = step * shares / ((1.0 + edge.wobble) * (1.0 + other.wobble)).sqrt();
            if best.is_some_and(|best| best.score >= score)
                || gap(lefts, rights, (edge, other)) > GAP_SHARE * step
            {
                continue;
            }
            best = Some(Pair { left, right, step, share, score });
        }
    }
    best
}

/// Median distance from one contour to another to its right \[px\]; `None`
/// where they do not run side by side or cross.
fn distance(left: &Contour, right: &Contour, memory: &mut Vec<f32>) -> Option<f32> {
    memory.clear();
    let both = left.at.iter().zip(&right.at);
    memory.extend(both.filter_map(|(left, right)| Some((*right)? - (*left)?)));
    if memory.len() * 5 < left.at.len() {
        return None;
    }
    rank::median(memory).filter(|&median| median > 0.0)
}

/// Depth of the deepest gap between two edges: a contour out of the bead,
/// followed by one back in, both about as whole as the edges are.
fn gap(lefts: &Contours, rights: &Contours, (left, right): (&Contour, &Contour)) -> f32 {
    let whole = WHOLE * left.share.min(right.share);
    let mut deepest: f32 = 0.0;
    for out in rights.all().iter().filter(|out| out.share >= whole) {
        if !in_order(left, out) || !in_order(out, right) {
            continue;
        }
        for back in lefts.all().iter().filter(|back| back.share >= whole) {
            if in_order(out, back) && in_order(back, right) {
                deepest = deepest.max(out.step.min(back.step));
            }
        }
    }
    deepest
}

/// Whether one contour runs to the left of another wherever both are seen,
/// which must be in most bands.
fn in_order(left: &Contour, right: &Contour) -> bool {
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
    use crate::vision::edge::{Candidates, respond};

    /// Contours up and down of bright bars on dark ground.
    fn bars(bars: &[(usize, usize, u16)]) -> (Contours, Contours) {
        let mut profile = vec![160; 200];
        for &(from, to, height) in bars {
            for value in &mut profile[from..to] {
                *value += 4 * height;
            }
        }
        let mut response = vec![0; 200];
        respond(&profile, &mut response);
        let mut steps = Candidates::default();
        steps.find(&response, 5.0, 0.0625);
        let bands = vec![steps; 20];
        let (mut up, mut down) = (Contours::default(), Contours::default());
        up.search(&bands, true, 4.0, 0.4);
        down.search(&bands, false, 4.0, 0.4);
        (up, down)
    }

    fn width(bars: &(Contours, Contours), search: Search) -> Option<f32> {
        let mut memory = Vec::new();
        let pair = find(&bars.0, &bars.1, search, &mut memory)?;
        distance(&bars.0.all()[pair.left], &bars.1.all()[pair.right], &mut memory)
    }

    const WIDE: Search = Search { width_px: (10.0, 80.0) };

    #[test]
    fn the_gap_between_two_beads_is_not_bridged() {
        let found = width(&bars(&[(50, 75, 80), (85, 110, 80)]), WIDE).unwrap();
        assert!((found - 25.0).abs() < 0.5);
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
        assert_eq!(width(&bars, Search { width_px: (50.0, 90.0) }), None);
    }
}
