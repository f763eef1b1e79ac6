//! Where a row passes from what lies outside to the bead.

use super::window::WindowRow;
use crate::numeric::number::{round_to_count, to_f32};
use crate::vision::edge_windows::WINDOW_PX;

/// How far inside the edge's course a row is summed \[px\]: beyond a usual flank. Measured:
/// reference/accuracy.md, What the parts bring: with 4 px instead of 5 real concrete repeats to
/// within 0.03 px of the same.
pub const SUMMED_INSIDE_PX: f32 = 5.0;
/// How far inside its course an edge may be torn \[px\].
const MAX_TEAR_PX: f32 = 25.0;
/// Range of the bead's fraction in a pixel: a spark or a shadow beyond it counts for no more. Wide,
/// so that noise is clipped on neither side.
const FRACTION_RANGE: (f32, f32) = (-1.0, 2.0);
/// Range of fractions beyond which a pixel shows neither bead nor what lies outside.
const NORMAL_FRACTIONS: (f32, f32) = (-0.2, 1.2);
/// How much farther inside a grain on the edge may reach \[px\].
const GRAIN_PX: usize = 8;
/// Fraction of the bead that a pixel inside the edge must show. By definition of an edge at half
/// height.
const MIN_BEAD_FRACTION: f32 = 0.5;
/// Length of a Gaussian flank from a fifth to four fifths of its height, over the sum of f·(1 − f)
/// along it. Derived: 2Φ⁻¹(0.8)·s = 1.683 s, over s/√π.
const FLANK_LENGTH_FACTOR: f32 = 2.983;

/// Where a row passes the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Position of the edge \[px\].
    pub at: f32,
    /// Pixels that were summed: the first and the last.
    summed: (usize, usize),
}

/// Further features of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowFeatures {
    /// Length of the flank \[px\], from a fifth to four fifths of its height.
    pub flank: f32,
    /// Fraction of the pixels about the edge that are clearly darker than what lies outside
    /// or brighter than the bead.
    pub odd: f32,
    /// That fraction in the bead farther inside.
    pub odd_within: f32,
}

/// Levels about a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowLevels {
    /// Innermost position of what lies outside \[px\].
    pub start: f32,
    /// Level outside \[grey levels\].
    pub outside: f32,
    /// Level of the bead \[grey levels\].
    pub inside: f32,
    /// Course of the edge \[px\].
    pub course: f32,
    /// Distance inside the course up to which the bead's texture is read \[px\].
    pub within_px: f32,
}

/// The edge by the area of the bead: the position from which on a row of bead alone has the same
/// area. Blur does not move it, and a tear moves it by the tear's area. `None` where no bead is
/// within reach of the course.
#[inline(always)]
pub fn find(row: &WindowRow, flank: &RowLevels) -> Option<Crossing> {
    let first = round_to_count(flank.start).clamp(1, WINDOW_PX - 2);
    let scale = 1.0 / (flank.inside - flank.outside);
    let bead = |k: usize| (row[k] - flank.outside) * scale;
    let mut last = round_to_count(flank.course + SUMMED_INSIDE_PX).clamp(first, WINDOW_PX - 1);
    let end = round_to_count(flank.course + MAX_TEAR_PX).min(WINDOW_PX - 1);
    while bead(last) < MIN_BEAD_FRACTION {
        last += 1;
        if last > end {
            return None;
        }
    }
    let share =
        |pixel: f32| ((pixel - flank.outside) * scale).clamp(FRACTION_RANGE.0, FRACTION_RANGE.1);
    let at = to_f32(last) + 0.5 - sum_of(&row[first..=last], share);
    Some(Crossing { at, summed: (first, last) })
}

/// Further features of a row whose crossing was found with the same levels.
#[inline(always)]
pub fn features(
    row: &WindowRow,
    flank: &RowLevels,
    Crossing { summed: (first, last), .. }: Crossing,
) -> RowFeatures {
    let scale = 1.0 / (flank.inside - flank.outside);
    let fraction = |pixel: f32| (pixel - flank.outside) * scale;
    let mixed = |pixel: f32| {
        let covered = fraction(pixel).clamp(0.0, 1.0);
        covered * (1.0 - covered)
    };
    let is_odd = |pixel: f32| {
        let fraction = fraction(pixel);
        if fraction < NORMAL_FRACTIONS.0 || fraction > NORMAL_FRACTIONS.1 { 1.0 } else { 0.0 }
    };
    let odd_share = |pixels: &[f32]| sum_of(pixels, is_odd) / to_f32(pixels.len().max(1));
    let end = round_to_count(flank.course + flank.within_px).min(WINDOW_PX);
    let about = &row[first..=last];
    RowFeatures {
        flank: FLANK_LENGTH_FACTOR * sum_of(about, mixed),
        odd: odd_share(about),
        odd_within: odd_share(&row[(last + GRAIN_PX).min(end)..end]),
    }
}

/// Sum of a term over the pixels, in as many partial sums as fit the processor's vectors.
#[inline(always)]
fn sum_of(pixels: &[f32], term: impl Fn(f32) -> f32) -> f32 {
    let mut sums = [0.0; 8];
    let chunks = pixels.chunks_exact(sums.len());
    let rest = chunks.remainder();
    for chunk in chunks {
        for (sum, pixel) in sums.iter_mut().zip(chunk) {
            *sum += term(*pixel);
        }
    }
    for (sum, pixel) in sums.iter_mut().zip(rest) {
        *sum += term(*pixel);
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(level: impl Fn(f32) -> f32) -> WindowRow {
        std::array::from_fn(|k| level(to_f32(k)))
    }

    const FLANK: RowLevels =
        RowLevels { start: 40.0, outside: 20.0, inside: 120.0, course: 58.0, within_px: 30.0 };

    #[test]
    fn a_ramp_is_passed_in_its_middle() {
        let ramp = row(|u| (20.0 + 10.0 * (u - 50.3)).clamp(20.0, 120.0));
        let found = find(&ramp, &FLANK).unwrap();
        assert!((found.at - 55.3).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_blurred_flank_is_as_long_as_from_a_fifth_to_four_fifths() {
        let sigma = 2.0;
        let height = |u: f32| 0.5 * (1.0 + libm::erff((u - 53.2) / (sigma * 2.0f32.sqrt())));
        let row = row(|u| 20.0 + 100.0 * height(u));
        let found = find(&row, &FLANK).unwrap();
        assert!((found.at - 53.2).abs() < 0.01, "{found:?}");
        let found = features(&row, &FLANK, found);
        assert!((found.flank - 1.683 * sigma).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn an_edge_that_is_torn_deep_lies_at_the_end_of_the_tear() {
        let torn = row(|u| if u < 70.0 { 20.0 } else { 120.0 });
        let found = find(&torn, &FLANK).unwrap();
        assert!((found.at - 69.5).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_spark_at_the_edge_is_odd_and_texture_all_over_the_bead_is_not() {
        let step = |u: f32| if u < 58.0 { 20.0 } else { 120.0 };
        let texture = |u: f32| if round_to_count(u).is_multiple_of(3) { 40.0 } else { 0.0 };
        let odd = |level: &dyn Fn(f32) -> f32| {
            let row = row(level);
            let found = features(&row, &FLANK, find(&row, &FLANK).unwrap());
            found.odd - found.odd_within
        };
        assert!(odd(&step).abs() < 1e-6);
        assert!(odd(&|u| if (50.0..54.0).contains(&u) { -60.0 } else { step(u) }) > 0.1);
        assert!(odd(&|u| step(u) + texture(u)) < 0.1);
    }

    #[test]
    fn a_row_that_stays_dark_shows_no_edge() {
        assert_eq!(find(&row(|_| 20.0), &FLANK), None);
        assert_eq!(find(&row(|u| if u < 85.0 { 20.0 } else { 120.0 }), &FLANK), None);
    }

    #[test]
    fn the_flanks_length_is_that_of_a_gaussian() {
        let z = 0.5 * f64::from(FLANK_LENGTH_FACTOR) / std::f64::consts::PI.sqrt();
        let height = 0.5 * (1.0 + libm::erf(z / 2f64.sqrt()));
        assert!((height - 0.8).abs() < 1e-4, "{height}");
    }
}
