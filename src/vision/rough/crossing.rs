//! Where a row passes from what lies outside to the bead.

use super::whole;
use super::window::Row;
use crate::vision::number::single;
use crate::vision::sheet::SPAN;

/// Pixels about a start among which the darkest is begun from.
const NEAR: usize = 3;
/// Heights of the flank at which a row is cut, from outside to the bead. Their
/// mean is half height; several of them tell an edge that lies in dark pits from a
/// clean one, and the mean of their positions moves less than any of them.
const HEIGHTS: [f32; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];
/// Fewest heights that must be reached.
const MIN_HEIGHTS: usize = 3;

/// What a row shows of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Mean position of the heights \[px\].
    pub at: f32,
    /// Distance from the first height to the last \[px\].
    pub flank: f32,
}

/// Levels about a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flank {
    /// Where to begin, outside \[px\].
    pub start: f32,
    /// Level outside \[grey levels\].
    pub outside: f32,
    /// Level of the bead \[grey levels\].
    pub inside: f32,
    /// Where the bead must have begun \[px\].
    pub end: f32,
}

/// The first crossing of each height, seen from outside: what is torn open to the
/// outside is not bead. `None` where a row does not rise to the bead's level before
/// `end`.
#[inline(always)]
pub fn of(row: &Row, flank: &Flank) -> Option<Crossing> {
    let height = |fraction: f32| flank.outside + fraction * (flank.inside - flank.outside);
    let mut at = begin(row, flank.start, height(HEIGHTS[0]))?;
    let last = whole(flank.end).min(SPAN - 2);
    let (mut sum, mut count) = (0.0, 0);
    let mut ends = [0.0; 2];
    for fraction in HEIGHTS {
        let level = height(fraction);
        while row[at] < level && at <= last {
            at += 1;
        }
        if at > last {
            break;
        }
        let step = row[at] - row[at - 1];
        let position =
            if step > 0.0 { single(at) - ((row[at] - level) / step).min(1.0) } else { single(at) };
        ends[1] = position;
        if count == 0 {
            ends[0] = position;
        }
        sum += position;
        count += 1;
    }
    let flank = ends[1] - ends[0];
    (count >= MIN_HEIGHTS).then(|| Crossing { at: sum / single(count), flank })
}

/// A pixel below a level to begin from: the darkest near the start, or, where that
/// is brighter, the first farther outside.
#[inline(always)]
fn begin(row: &Row, start: f32, level: f32) -> Option<usize> {
    let start = whole(start).min(SPAN - 1);
    let near = start.saturating_sub(NEAR).max(1)..(start + NEAR + 1).min(SPAN);
    let mut at = near.min_by(|&a, &b| row[a].total_cmp(&row[b]))?;
    while row[at] >= level {
        if at <= 1 {
            return None;
        }
        at -= 1;
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(of: impl Fn(f32) -> f32) -> Row {
        std::array::from_fn(|k| of(single(k)))
    }

    const FLANK: Flank = Flank { start: 40.0, outside: 20.0, inside: 120.0, end: 90.0 };

    #[test]
    fn a_ramp_is_passed_in_its_middle() {
        let ramp = row(|u| (20.0 + 10.0 * (u - 50.3)).clamp(20.0, 120.0));
        let found = of(&ramp, &FLANK).unwrap();
        assert!((found.at - 55.3).abs() < 1e-3, "{found:?}");
        assert!((found.flank - 6.0).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_start_within_the_bead_goes_outwards_and_a_hole_within_it_is_passed_by() {
        let hole = |u: f32| if (66.0..69.0).contains(&u) { 20.0 } else { 120.0 };
        let bead = row(|u| if u < 30.0 { 20.0 } else { hole(u) });
        let found = of(&bead, &FLANK).unwrap();
        assert!((found.at - 29.5).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn a_row_that_stays_dark_shows_no_edge() {
        assert_eq!(of(&row(|_| 20.0), &FLANK), None);
        assert_eq!(of(&row(|u| if u < 95.0 { 20.0 } else { 120.0 }), &FLANK), None);
    }
}
