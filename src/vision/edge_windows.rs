//! The gauge straightened along an edge: the pixels around it, one window a few
//! rows, read once and held against the edge as often as it takes.

use super::path::Correction;
use super::row_range::RowRange;
use super::strip::{Grey, Strip};
use crate::numeric::number::{floor, single};

/// Pixels of a window.
pub const SPAN: usize = 112;
/// Pixel of a window at which the edge is expected.
pub const MIDDLE: usize = SPAN / 2;

/// A gauge of more rows has plenty: those of a caliper line are taken together.
pub const PLENTY: usize = 160;
/// How far an edge may run aside within rows that are taken together \[px\].
const STRAIGHT_PX: f32 = 0.6;

/// A window: the mean of a few neighbouring rows \[grey levels of 256\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Caliper line that the rows belong to.
    pub line: usize,
    /// Number of rows.
    pub rows: f32,
    /// Their middle along the bead \[px\].
    pub middle: f32,
    /// Place across the bead of the first pixel \[px\].
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

/// Windows along an edge; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Sheet {
    windows: Vec<Window>,
    pixels: Vec<[f32; SPAN]>,
}

impl Sheet {
    /// What the windows are of.
    pub fn windows(&self) -> &[Window] {
        &self.windows
    }

    /// The pixels of a window \[grey levels of 256\].
    #[inline(always)]
    pub fn pixels(&self, window: usize) -> &[f32; SPAN] {
        &self.pixels[window]
    }

    /// Expects the edge a little aside, and other levels.
    pub fn adopt(&mut self, Correction { aside, before, after }: Correction) {
        for window in &mut self.windows {
            let [at, level, step] = window.expected;
            window.expected = [at + aside, level + before * step, (after - before) * step];
        }
    }

    /// Reads the windows about an edge of which `expected` is told for a place
    /// along it. Rows are taken together within caliper lines: one where there are
    /// few, more where a tall gauge has plenty.
    #[inline(always)]
    pub fn read<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
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
                let middle = single(2 * v + rows - 1) / 2.0;
                let expected = expected(middle);
                let first = floor(expected[0].into()) - MIDDLE.cast_signed();
                self.windows.push(Window { line, rows: single(rows), middle, first, expected });
                v += rows;
            }
        }
        self.pixels.resize(self.windows.len(), [0.0; SPAN]);
        let mut v = 0;
        for (window, pixels) in self.windows.iter().zip(&mut self.pixels) {
            let end = v + count(window.rows);
            average(strip, v..end, window.first, pixels);
            v = end;
        }
    }
}

/// Rows that are taken together.
fn rows_together(along: usize, lines: usize, steepest: f32) -> usize {
    if along <= PLENTY {
        return 1;
    }
    let straight = count(STRAIGHT_PX / steepest.max(1e-3));
    along.div_ceil(lines.max(1)).min(straight).max(1)
}

/// Mean of some rows from a place on.
#[inline(always)]
fn average<T: Grey>(
    strip: &Strip<'_, T>,
    rows: std::ops::Range<usize>,
    first: isize,
    out: &mut [f32; SPAN],
) {
    let scale = strip.scale / single(rows.len());
    let mut sums = [T::Sum::default(); SPAN];
    let mut v = rows.start;
    let mut memory = [[T::default(); SPAN]; 2];
    while v + 1 < rows.end {
        let [one, two] = &mut memory;
        add([pixels(strip, v, first, one), pixels(strip, v + 1, first, two)], &mut sums);
        v += 2;
    }
    if v < rows.end {
        add([pixels(strip, v, first, &mut memory[0])], &mut sums);
    }
    for (out, sum) in out.iter_mut().zip(sums) {
        *out = scale * T::float(sum);
    }
}

/// The pixels of a row from a place on; `memory` is for those beyond its ends.
#[inline(always)]
fn pixels<'a, T: Grey>(
    strip: &Strip<'a, T>,
    v: usize,
    first: isize,
    memory: &'a mut [T; SPAN],
) -> &'a [T; SPAN] {
    let row = strip.row(v);
    let within = usize::try_from(first).ok().and_then(|from| row.get(from..from + SPAN));
    if let Some(pixels) = within.and_then(<[T]>::first_chunk) {
        return pixels;
    }
    strip.fetch(v, first, memory);
    memory
}

#[inline(always)]
fn add<T: Grey, const N: usize>(rows: [&[T; SPAN]; N], sums: &mut [T::Sum; SPAN]) {
    for k in 0..SPAN {
        for row in rows {
            sums[k] = row[k].add_to(sums[k]);
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "positive; what is large is cut to a few"
)]
fn count(number: f32) -> usize {
    number as usize
}
