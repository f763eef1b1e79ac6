//! The gauge straightened along an edge: windows of pixels about it, each the mean of a few rows.
//! They are read once and compared with the edge as often as needed.

use std::ops::Range;

use super::path::EdgeCorrection;
use super::row_range::RowRange;
use super::strip::{GaugeRows, GreyPixel};
use crate::numeric::number::{floor_to_index, to_count, to_f32};

/// Pixels of a window. Derived: the 96 px of an overlay, and 8 px on either side for a path that is
/// off.
pub const WINDOW_PX: usize = 112;
/// Pixel of a window at which the edge is expected.
pub const MIDDLE_PX: usize = WINDOW_PX / 2;

/// Rows of a gauge up to which a window is one row; of a taller gauge it is the mean of several.
pub const MAX_SINGLE_ROWS: usize = 160;
/// How far an edge may run aside within rows that are taken together \[px\].
const MAX_ASIDE_PX: f32 = 0.6;

/// A window: the mean of a few neighbouring rows \[grey levels of 256\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeWindow {
    /// Caliper line that the rows belong to.
    pub line: usize,
    /// Number of rows.
    pub rows: f32,
    /// Their middle along the bead \[px\].
    pub middle: f32,
    /// Position across the bead of the first pixel \[px\].
    pub first: isize,
    /// Position of the edge there \[px\], level before it and step to the level
    /// after it \[grey levels\], as they are expected.
    pub expected: [f32; 3],
}

/// How rows are taken together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grouping {
    /// Steepest slope of the edge \[px across per px along\].
    pub steepest: f32,
    /// Most rows of a window.
    pub max_rows: usize,
}

/// Windows along an edge; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct EdgeWindows {
    /// Position, rows and expected edge of each window.
    pub windows: Vec<EdgeWindow>,
    pixels: Vec<[f32; WINDOW_PX]>,
}

impl EdgeWindows {
    /// The pixels of a window \[grey levels of 256\].
    #[inline(always)]
    pub fn pixels(&self, window: usize) -> &[f32; WINDOW_PX] {
        &self.pixels[window]
    }

    /// Corrects the expected position and levels of the edge.
    pub fn correct(&mut self, EdgeCorrection { aside, before, after }: EdgeCorrection) {
        for window in &mut self.windows {
            let [at, level, step] = window.expected;
            window.expected = [at + aside, level + before * step, (after - before) * step];
        }
    }

    /// Reads the windows about an edge; `expected` gives its position and levels for a position
    /// along the bead \[px\]. A window averages rows of one caliper line: one row of a short gauge,
    /// more of a tall one.
    #[inline(always)]
    pub fn read<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        lines: &[RowRange],
        grouping: Grouping,
        expected: impl Fn(f32) -> [f32; 3],
    ) {
        let together = rows_together(strip.along, lines.len(), grouping.steepest);
        let together = together.min(grouping.max_rows);
        self.windows.clear();
        for (line, bounds) in lines.iter().enumerate() {
            let mut v = bounds.first;
            while v < bounds.end {
                let rows = together.min(bounds.end - v);
                let middle = to_f32(2 * v + rows - 1) / 2.0;
                let expected = expected(middle);
                let first = floor_to_index(expected[0].into()) - MIDDLE_PX.cast_signed();
                self.windows.push(EdgeWindow { line, rows: to_f32(rows), middle, first, expected });
                v += rows;
            }
        }
        self.pixels.resize(self.windows.len(), [0.0; WINDOW_PX]);
        let mut v = 0;
        for (window, pixels) in self.windows.iter().zip(&mut self.pixels) {
            let end = v + to_count(window.rows.into());
            average(strip, v..end, window.first, pixels);
            v = end;
        }
    }
}

/// Number of rows that a window averages.
fn rows_together(along: usize, lines: usize, steepest: f32) -> usize {
    if along <= MAX_SINGLE_ROWS {
        return 1;
    }
    let straight = to_count((MAX_ASIDE_PX / steepest.max(1e-3)).into());
    along.div_ceil(lines.max(1)).min(straight).max(1)
}

/// Mean of some rows from position `first` on \[grey levels of 256\].
#[inline(always)]
fn average<T: GreyPixel>(
    strip: &GaugeRows<'_, T>,
    rows: Range<usize>,
    first: isize,
    out: &mut [f32; WINDOW_PX],
) {
    let scale = strip.scale / to_f32(rows.len());
    let mut sums = [T::Sum::default(); WINDOW_PX];
    let mut v = rows.start;
    let mut scratch = [[T::default(); WINDOW_PX]; 2];
    while v + 1 < rows.end {
        let [one, two] = &mut scratch;
        add([pixels(strip, v, first, one), pixels(strip, v + 1, first, two)], &mut sums);
        v += 2;
    }
    if v < rows.end {
        add([pixels(strip, v, first, &mut scratch[0])], &mut sums);
    }
    for (out, sum) in out.iter_mut().zip(sums) {
        *out = scale * T::sum_to_f32(sum);
    }
}

/// The pixels of a row from a position on; `scratch` is for those beyond its ends.
#[inline(always)]
fn pixels<'a, T: GreyPixel>(
    strip: &GaugeRows<'a, T>,
    v: usize,
    first: isize,
    scratch: &'a mut [T; WINDOW_PX],
) -> &'a [T; WINDOW_PX] {
    let row = strip.row(v);
    let within = usize::try_from(first).ok().and_then(|from| row.get(from..from + WINDOW_PX));
    if let Some(pixels) = within.and_then(<[T]>::first_chunk) {
        return pixels;
    }
    strip.fetch(v, first, scratch);
    scratch
}

#[inline(always)]
fn add<T: GreyPixel, const N: usize>(rows: [&[T; WINDOW_PX]; N], sums: &mut [T::Sum; WINDOW_PX]) {
    for k in 0..WINDOW_PX {
        for row in rows {
            sums[k] = row[k].add_to(sums[k]);
        }
    }
}
