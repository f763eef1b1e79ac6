//! Where a row passes from what lies outside to the bead.

use super::window::Row;
use crate::numeric::number::single;
use crate::numeric::number::whole;
use crate::vision::edge_windows::SPAN;

/// How far inside the edge's course a row is summed \[px\]: beyond a usual flank.
pub const INSIDE_PX: f32 = 5.0;
/// How far inside its course an edge may be torn \[px\].
const DEEPEST_PX: f32 = 25.0;
/// Bead in a pixel, as a fraction, beyond which it is a spark or a shadow and counts
/// for no more. Wide, so that noise is cut off on neither side.
const FRACTIONS: (f32, f32) = (-1.0, 2.0);
/// Fractions beyond which a pixel shows something else than the two.
const ODD: (f32, f32) = (-0.2, 1.2);
/// How much farther inside a grain on the edge may reach \[px\].
const GRAIN_PX: usize = 8;
/// Fraction of the bead that a pixel inside the edge must show.
const BEAD: f32 = 0.5;
/// The length of a Gaussian flank from a fifth to four fifths of its height,
/// 1.683 s, over the sum of f·(1 − f) along it, s/√π.
const FLANK: f32 = 2.983;

/// Where a row passes the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Position of the edge \[px\].
    pub at: f32,
    /// Pixels that were summed: the first and the last.
    summed: (usize, usize),
}

/// What a row shows besides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Length of the flank \[px\], from a fifth to four fifths of its height.
    pub flank: f32,
    /// Share of the pixels about the edge that are clearly darker than what lies outside
    /// or brighter than the bead.
    pub odd: f32,
    /// The same of the bead farther inside.
    pub odd_within: f32,
}

/// Levels about a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flank {
    /// Where what lies outside ends at the latest \[px\].
    pub start: f32,
    /// Level outside \[grey levels\].
    pub outside: f32,
    /// Level of the bead \[grey levels\].
    pub inside: f32,
    /// Course of the edge \[px\].
    pub course: f32,
    /// Bead beyond the course that shows what its texture is \[px\].
    pub within_px: f32,
}

/// The edge by the area of the bead: the place from which on the row would hold as
/// much bead as it does, were it all bead. A blur moves it nowhere, and of what is
/// torn open as much is missing as there is of it. `None` where no bead is within
/// reach of the course.
#[inline(always)]
pub fn of(row: &Row, flank: &Flank) -> Option<Crossing> {
    let first = whole(flank.start).clamp(1, SPAN - 2);
    let scale = 1.0 / (flank.inside - flank.outside);
    let bead = |k: usize| (row[k] - flank.outside) * scale;
    let mut last = whole(flank.course + INSIDE_PX).clamp(first, SPAN - 1);
    let end = whole(flank.course + DEEPEST_PX).min(SPAN - 1);
    while bead(last) < BEAD {
        last += 1;
        if last > end {
            return None;
        }
    }
    let share = |pixel: f32| ((pixel - flank.outside) * scale).clamp(FRACTIONS.0, FRACTIONS.1);
    let at = single(last) + 0.5 - sum_of(&row[first..=last], share);
    Some(Crossing { at, summed: (first, last) })
}

/// What else a row shows whose crossing was found with the same levels.
#[inline(always)]
pub fn shown(row: &Row, flank: &Flank, Crossing { summed: (first, last), .. }: Crossing) -> Shown {
    let scale = 1.0 / (flank.inside - flank.outside);
    let fraction = |pixel: f32| (pixel - flank.outside) * scale;
    let mixed = |pixel: f32| {
        let shown = fraction(pixel).clamp(0.0, 1.0);
        shown * (1.0 - shown)
    };
    let is_odd = |pixel: f32| {
        let fraction = fraction(pixel);
        if fraction < ODD.0 || fraction > ODD.1 { 1.0 } else { 0.0 }
    };
    let odd_share = |pixels: &[f32]| sum_of(pixels, is_odd) / single(pixels.len().max(1));
    let end = whole(flank.course + flank.within_px).min(SPAN);
    let about = &row[first..=last];
    Shown {
        flank: FLANK * sum_of(about, mixed),
        odd: odd_share(about),
        odd_within: odd_share(&row[(last + GRAIN_PX).min(end)..end]),
    }
}

/// Sum of what is made of each pixel, in as many sums as fit the processor's vectors.
#[inline(always)]
fn sum_of(pixels: &[f32], of: impl Fn(f32) -> f32) -> f32 {
    let mut sums = [0.0; 8];
    let chunks = pixels.chunks_exact(sums.len());
    let rest = chunks.remainder();
    for chunk in chunks {
        for (sum, pixel) in sums.iter_mut().zip(chunk) {
            *sum += of(*pixel);
        }
    }
    for (sum, pixel) in sums.iter_mut().zip(rest) {
        *sum += of(*pixel);
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(of: impl Fn(f32) -> f32) -> Row {
        std::array::from_fn(|k| of(single(k)))
    }

    const FLANK: Flank =
        Flank { start: 40.0, outside: 20.0, inside: 120.0, course: 58.0, within_px: 30.0 };

    #[test]
    fn a_ramp_is_passed_in_its_middle() {
        let ramp = row(|u| (20.0 + 10.0 * (u - 50.3)).clamp(20.0, 120.0));
        let found = of(&ramp, &FLANK).unwrap();
        assert!((found.at - 55.3).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_blurred_flank_is_as_long_as_from_a_fifth_to_four_fifths() {
        let sigma = 2.0;
        let height = |u: f32| 0.5 * (1.0 + libm::erff((u - 53.2) / (sigma * 2.0f32.sqrt())));
        let row = row(|u| 20.0 + 100.0 * height(u));
        let found = of(&row, &FLANK).unwrap();
        assert!((found.at - 53.2).abs() < 0.01, "{found:?}");
        let shown = shown(&row, &FLANK, found);
        assert!((shown.flank - 1.683 * sigma).abs() < 0.02, "{shown:?}");
    }

    #[test]
    fn an_edge_that_is_torn_deep_lies_at_the_end_of_the_tear() {
        let torn = row(|u| if u < 70.0 { 20.0 } else { 120.0 });
        let found = of(&torn, &FLANK).unwrap();
        assert!((found.at - 69.5).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_spark_at_the_edge_is_odd_and_texture_all_over_the_bead_is_not() {
        let step = |u: f32| if u < 58.0 { 20.0 } else { 120.0 };
        let texture = |u: f32| if whole(u).is_multiple_of(3) { 40.0 } else { 0.0 };
        let odd = |of: &dyn Fn(f32) -> f32| {
            let row = row(of);
            let shown = shown(&row, &FLANK, super::of(&row, &FLANK).unwrap());
            shown.odd - shown.odd_within
        };
        assert!(odd(&step).abs() < 1e-6);
        assert!(odd(&|u| if (50.0..54.0).contains(&u) { -60.0 } else { step(u) }) > 0.1);
        assert!(odd(&|u| step(u) + texture(u)) < 0.1);
    }

    #[test]
    fn a_row_that_stays_dark_shows_no_edge() {
        assert_eq!(of(&row(|_| 20.0), &FLANK), None);
        assert_eq!(of(&row(|u| if u < 85.0 { 20.0 } else { 120.0 }), &FLANK), None);
    }
}
