//! Rows about an edge, turned so that the bead lies at higher positions and is
//! the brighter side, and smoothed.

use super::kernel;
use super::rough_input::RoughInput;
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::vision::coarse::StepLine;
use crate::vision::edge_windows::{EdgeWindows, Grouping, WINDOW_PX};
use crate::vision::row_range::RowRange;
use crate::vision::strip::GreyPixel;

/// Pixels of a row.
pub type WindowRow = [f32; WINDOW_PX];

/// Standard deviation of the smoothing across \[px\]: a third of a usual blur, so
/// that it hardly widens the flank.
const ACROSS_PX: f64 = 0.7;
/// Standard deviation of the smoothing along the bead \[px\]: what is shorter is texture, and the
/// mean over the rows keeps its position.
pub const ALONG_PX: f64 = 2.5;
/// Rows over which a course is straight: the smoothing along the bead leaves nothing finer.
pub const STRAIGHT_ROWS: usize = 2;
/// Rows of the gauge in a block.
pub const BLOCK_ROWS: usize = 4;
/// Rows of the gauge over which the smoothing along the bead follows no changes. Derived: 2 · 2.5,
/// two of its standard deviations.
const FINE_ROWS: usize = 5;
/// Rows of a gauge from which on two are taken together: there are plenty.
const MIN_PAIRED_ROWS: usize = 400;

/// The rows of one edge.
#[derive(Debug, Clone, Default)]
pub struct RowWindows {
    sheet: EdgeWindows,
    /// Caliper line of each row.
    pub lines: Vec<usize>,
    /// The smoothed pixels of all rows \[grey levels\], dark beads negated.
    pub rows: Vec<WindowRow>,
    across: Vec<WindowRow>,
    bead_after: bool,
    /// Columns of the gauge.
    width: f32,
    kernels: [Vec<f32>; 2],
    together: usize,
}

impl RowWindows {
    /// Rows of a block along the bead.
    pub fn block(&self) -> usize {
        BLOCK_ROWS / self.together
    }

    /// Rows over which an edge's profile changes by what is too fine to be followed.
    pub fn fine(&self) -> usize {
        FINE_ROWS / self.together
    }

    /// Rows of the gauge that a row is the mean of.
    pub fn rows_of(&self, number: usize) -> f64 {
        self.sheet.windows[number].rows.into()
    }

    /// Position across the gauge of a position in a row's window \[px\]; `None` where it is NaN or
    /// beyond the gauge.
    pub fn position(&self, number: usize, at: f32) -> Option<f64> {
        if !at.is_finite() {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
        let first = self.sheet.windows[number].first as f32;
        let last = narrow_to_f32(to_f64(WINDOW_PX - 1));
        let at = if self.bead_after { first + at } else { first + last - at };
        (0.0..=self.width - 1.0).contains(&at).then(|| at.into())
    }

    /// Sum of the squares of the smoothing's weights across.
    pub fn noise_gain(&self) -> f64 {
        let kernel = &self.kernels[0];
        let square = |weight: &f32| f64::from(*weight).powi(2);
        2.0 * kernel.iter().map(square).sum::<f64>() - square(&kernel[0])
    }

    /// Reads the rows along a line.
    #[inline(always)]
    pub fn read<T: GreyPixel>(&mut self, scene: &RoughInput<'_, T>, line: &StepLine) {
        let strip = scene.strip;
        let middle = narrow_to_f32(to_f64(strip.along) - 1.0) / 2.0;
        let together = if strip.along > MIN_PAIRED_ROWS { 2 } else { 1 };
        if self.together != together {
            self.together = together;
            self.kernels =
                [kernel::gaussian(ACROSS_PX), kernel::gaussian(ALONG_PX / to_f64(together))];
        }
        let at = |v: f32| [line.at + line.slope * (v - middle), 0.0, 1.0];
        // Not by caliper lines: those with an odd number of rows would leave single rows.
        let grouping = Grouping { steepest: 0.3, max_rows: self.together };
        self.sheet.read(strip, &[RowRange::new(0, strip.along)], grouping, at);
        self.lines.clear();
        let mut line = 0;
        for window in &self.sheet.windows {
            let is_beyond = |end: usize| narrow_to_f32(to_f64(end)) <= window.middle + 0.5;
            while scene.lines.get(line).is_some_and(|line| is_beyond(line.end)) {
                line += 1;
            }
            self.lines.push(line);
        }
        self.bead_after = scene.bead_after;
        self.width = narrow_to_f32(to_f64(strip.across));
        let sign = if scene.bright { 1.0 } else { -1.0 };
        let count = self.sheet.windows.len();
        self.across.resize(count, [0.0; WINDOW_PX]);
        self.rows.resize(count, [0.0; WINDOW_PX]);
        for (number, row) in self.across.iter_mut().enumerate() {
            smooth_row(self.sheet.pixels(number), (sign, scene.bead_after), &self.kernels[0], row);
        }
        let mut along = [0.0; MAX_KERNEL_HALF + 1];
        for (weight, of_kernel) in along.iter_mut().zip(&self.kernels[1]) {
            *weight = *of_kernel;
        }
        smooth_along(&self.across, &along, &mut self.rows);
    }
}

/// Convolves a row, multiplied by a sign and in reverse where its bead lies before, with a
/// symmetric kernel; beyond the ends the last pixel goes on.
#[inline(always)]
fn smooth_row(row: &WindowRow, (sign, after): (f32, bool), kernel: &[f32], out: &mut WindowRow) {
    /// Pixels beyond either end of a row: more than the kernel reaches.
    const PAD: usize = 4;
    let mut padded = [0.0; WINDOW_PX + 2 * PAD];
    for k in 0..WINDOW_PX {
        padded[PAD + k] = sign * row[k];
    }
    if !after {
        padded[PAD..PAD + WINDOW_PX].reverse();
    }
    let (first, last) = (padded[PAD], padded[PAD + WINDOW_PX - 1]);
    padded[..PAD].fill(first);
    padded[PAD + WINDOW_PX..].fill(last);
    for k in 0..WINDOW_PX {
        out[k] = kernel[0] * padded[PAD + k];
    }
    for (offset, weight) in kernel.iter().enumerate().skip(1).take(PAD) {
        for k in 0..WINDOW_PX {
            out[k] += weight * (padded[PAD + k - offset] + padded[PAD + k + offset]);
        }
    }
}

/// Pixels that are convolved together. Derived: 16 floats fill a vector of 512 bits.
const VECTOR_PIXELS: usize = 16;
/// Samples of a kernel beside its middle at most. Derived: 3 · 2.5 px, three standard deviations of
/// the smoothing along the bead, rounded up.
const MAX_KERNEL_HALF: usize = 8;

/// Convolves along the bead. Beyond the ends the rows are mirrored, so that each row has the same
/// weight in the mean of all.
#[inline(always)]
fn smooth_along(rows: &[WindowRow], kernel: &[f32; MAX_KERNEL_HALF + 1], out: &mut [WindowRow]) {
    let count = rows.len().cast_signed();
    let mirrored = |v: isize| {
        let v = if v < 0 { -1 - v } else { v };
        let v = if v >= count { 2 * count - 1 - v } else { v };
        v.clamp(0, count - 1).unsigned_abs()
    };
    for (number, out) in (0..).zip(out.iter_mut()) {
        let middle = &rows[mirrored(number)];
        let mut near = [[middle; 2]; MAX_KERNEL_HALF];
        for (offset, near) in (1..).zip(&mut near) {
            *near = [&rows[mirrored(number - offset)], &rows[mirrored(number + offset)]];
        }
        for (part, out) in out.as_chunks_mut::<VECTOR_PIXELS>().0.iter_mut().enumerate() {
            let pixels = &middle.as_chunks::<VECTOR_PIXELS>().0[part];
            let mut sums = [0.0; VECTOR_PIXELS];
            for k in 0..VECTOR_PIXELS {
                sums[k] = kernel[0] * pixels[k];
            }
            for offset in 0..MAX_KERNEL_HALF {
                let before = &near[offset][0].as_chunks::<VECTOR_PIXELS>().0[part];
                let after = &near[offset][1].as_chunks::<VECTOR_PIXELS>().0[part];
                for k in 0..VECTOR_PIXELS {
                    sums[k] += kernel[offset + 1] * (before[k] + after[k]);
                }
            }
            *out = sums;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_fits_and_fine_rows_are_two_of_its_deviations() {
        assert_eq!(kernel::gaussian(ALONG_PX).len(), MAX_KERNEL_HALF + 1);
        assert_eq!(to_f64(FINE_ROWS), 2.0 * ALONG_PX);
    }
}
