//! Grey levels on either side of an edge, along its course, and where each row
//! passes from one to the other.

use super::crossing::{self, Crossing, RowLevels};
use super::kernel;
use super::mean_profile::{
    BlockProfile, MIN_GROUND_PX, MeanProfile, OUTSIDE_PX, PROFILE_PX, darkest_of, mean_profile,
};
use super::rough_input::RoughInput;
use super::window::{BLOCK_ROWS, RowWindows, STRAIGHT_ROWS};
use crate::numeric::number::{round_to_count, to_f32, to_f64};
use crate::numeric::rank;
use crate::vision::buffer::reset;
use crate::vision::edge_windows::WINDOW_PX;
use crate::vision::gauge::EdgeKind;

/// How much darker than the bead a hole in it is, in median deviations of the bead's positions.
/// Derived: 4 · 1.4826, four standard deviations of a Gaussian.
const MIN_HOLE_DEVIATIONS: f32 = 6.0;
/// Smallest depth of a hole as a fraction of the contrast: a plain bead has hardly any deviation.
const MIN_HOLE_DEPTH: f32 = 0.2;
/// Rows over which the bead's level is averaged, as the standard deviation of a
/// Gaussian: more than texture is long, less than the light changes within.
const INSIDE_ROWS: f64 = 48.0;
/// Rows over which the level outside is averaged, likewise: a groove changes more quickly.
const OUTSIDE_ROWS: f64 = 6.0;
/// Depth of a groove as a fraction of the bead's level: hardly any light comes out of it. A narrow
/// one seems less deep, because blur fills it. Derived: 1 less the groove's grey, 0.13.
const GROOVE_DEPTH: f32 = 0.87;
/// Standard deviation of that, as a fraction of the depth. Derived: 0.25/√12/0.87, for grooves of
/// none to a quarter of the bead's level.
pub const DEPTH_SIGMA: f64 = 0.08;

/// Pixels of a profile that may lie outside, in whole vectors of the processor.
const AROUND_PX: usize = (OUTSIDE_PX + 1).next_multiple_of(8);

/// Levels along an edge; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct EdgeLevels {
    /// Profiles of the blocks, aligned along the course.
    pub blocks: Vec<BlockProfile>,
    /// Rows of a block.
    block: usize,
    smooth: Vec<[f32; AROUND_PX]>,
    beside: Vec<BlockLevels>,
    /// The profile of the whole edge.
    pub mean: Option<MeanProfile>,
    /// Kernels of the smoothing for the levels inside and outside.
    kernels: [Vec<f32>; 2],
}

/// What the rows show of an edge.
#[derive(Debug, Clone, Default)]
pub struct Crossings {
    /// Position in each row's window \[px\]; NaN where there is none.
    pub at: Vec<f32>,
    /// Length of the flank of every [`STRAIGHT_ROWS`]th row \[px\], likewise.
    pub flank: Vec<f32>,
    /// Distance of the edge from where what lies outside ends, likewise.
    pub gap: Vec<f32>,
    /// Fraction of odd pixels about the edge, likewise.
    pub odd: Vec<f32>,
    /// Fraction of odd pixels in the bead farther inside, likewise.
    pub odd_within: Vec<f32>,
    /// Mean distance of the edge from the course, rounded to pixels \[px\].
    pub off_course: f64,
    /// Crossing of each row.
    found: Vec<Option<Crossing>>,
}

/// Levels about one block of rows.
#[derive(Debug, Clone, Copy, Default)]
struct BlockLevels {
    outside: f32,
    inside: f32,
    /// Darkest position, as an index of a profile.
    darkest: usize,
}

impl EdgeLevels {
    /// Step from outside to the bead in the mean \[grey levels\].
    pub fn contrast(&self) -> f64 {
        let sum: f32 = self.beside.iter().map(|levels| levels.inside - levels.outside).sum();
        f64::from(sum) / to_f64(self.beside.len().max(1))
    }

    /// Level inside at a block \[grey levels\].
    pub fn inside(&self, block: usize) -> f32 {
        self.beside[block].inside
    }

    /// Level outside at a block \[grey levels\].
    pub fn outside(&self, block: usize) -> f32 {
        self.beside[block].outside
    }

    /// Reads the levels along a course; `None` where there is no step.
    #[inline(always)]
    pub fn read<T>(
        &mut self,
        windows: &RowWindows,
        course: &[f32],
        scene: &RoughInput<'_, T>,
    ) -> Option<()> {
        if self.kernels[0].is_empty() {
            self.kernels =
                [INSIDE_ROWS, OUTSIDE_ROWS].map(|rows| kernel::gaussian(rows / to_f64(BLOCK_ROWS)));
        }
        self.block = windows.block();
        self.align(windows, course);
        let mut mean = mean_profile(&self.blocks, scene.width_px)?;
        if scene.edge == EdgeKind::Step {
            mean.filled = 0.0;
        }
        let [inside, outside] = &self.kernels;
        self.beside.clear();
        let bead = smooth_levels(&bead_levels(&self.blocks, &mean), inside);
        self.beside.resize(bead.len(), BlockLevels::default());
        for (levels, inside) in self.beside.iter_mut().zip(bead) {
            levels.inside = inside;
        }
        smooth(&self.blocks, outside, &mut self.smooth);
        for (levels, profile) in self.beside.iter_mut().zip(&self.smooth) {
            levels.read_outside(profile, &mean);
        }
        self.mean = Some(mean);
        (self.contrast() > 0.0).then_some(())
    }

    /// Means of the blocks' rows, aligned on the course to the nearest pixel.
    #[inline(always)]
    fn align(&mut self, windows: &RowWindows, course: &[f32]) {
        self.blocks.clear();
        for (rows, course) in windows.rows.chunks(self.block).zip(course.chunks(self.block)) {
            let mut sums = [0.0; PROFILE_PX];
            for (row, &at) in rows.iter().zip(course) {
                let start = round_to_count(at.max(0.0)).cast_signed() - OUTSIDE_PX.cast_signed();
                let within = usize::try_from(start).ok().and_then(|start| row.get(start..));
                if let Some(pixels) = within.and_then(<[f32]>::first_chunk::<PROFILE_PX>) {
                    for (sum, pixel) in sums.iter_mut().zip(pixels) {
                        *sum += pixel;
                    }
                    continue;
                }
                for (k, sum) in (start..).zip(&mut sums) {
                    *sum += row[k.clamp(0, WINDOW_PX.cast_signed() - 1).unsigned_abs()];
                }
            }
            let scale = 1.0 / to_f32(rows.len());
            for sum in &mut sums {
                *sum *= scale;
            }
            self.blocks.push(sums);
        }
    }

    /// Crossings from outside to the bead in every `every`-th row; NaN where there is none, and
    /// between these rows.
    #[inline(always)]
    pub fn cross(&self, windows: &RowWindows, course: &[f32], every: usize, out: &mut Crossings) {
        let rows = &windows.rows;
        reset(&mut out.found, rows.len(), None);
        reset(&mut out.at, rows.len(), f32::NAN);
        for row in (0..rows.len()).step_by(every) {
            let found = crossing::find(&rows[row], &self.flank(row, course[row]));
            out.found[row] = found;
            out.at[row] = found.map_or(f32::NAN, |found| found.at);
        }
    }

    /// Further features of the rows whose crossings were found along the same course.
    #[inline(always)]
    pub fn describe(&self, windows: &RowWindows, course: &[f32], out: &mut Crossings) {
        let Crossings { at: _, flank, gap, odd, odd_within, off_course, found } = out;
        let looks = found.len().div_ceil(STRAIGHT_ROWS);
        for values in [&mut *flank, gap, odd, odd_within] {
            reset(values, looks, f32::NAN);
        }
        for (look, row) in (0..found.len()).step_by(STRAIGHT_ROWS).enumerate() {
            let Some(found) = found[row] else { continue };
            let levels = self.flank(row, course[row]);
            let shown = crossing::features(&windows.rows[row], &levels, found);
            flank[look] = shown.flank;
            gap[look] = found.at - levels.start;
            odd[look] = shown.odd;
            odd_within[look] = shown.odd_within;
        }
        let (mut sum, mut seen) = (0.0, 0.0);
        for (found, at) in found.iter().zip(course) {
            let Some(found) = found else { continue };
            sum += f64::from(found.at - at.max(0.0).round());
            seen += 1.0;
        }
        *off_course = sum / f64::max(seen, 1.0);
    }

    /// Levels about a row; `course` is the position of the edge's course there \[px\].
    #[inline(always)]
    fn flank(&self, row: usize, course: f32) -> RowLevels {
        let levels = self.between(row);
        let ground = self.mean.filter(|mean| mean.on_ground);
        let start = ground.map_or(levels.darkest, |mean| mean.outside.1 - MIN_GROUND_PX / 2);
        RowLevels {
            start: course + to_f32(start) - to_f32(OUTSIDE_PX),
            outside: levels.outside - self.hidden_depth(&levels),
            inside: levels.inside,
            course,
            within_px: self.mean.map_or(0.0, |mean| to_f32(mean.inside.1 - OUTSIDE_PX)),
        }
    }

    /// Depth of a groove that blur hides \[grey levels\].
    #[inline(always)]
    fn hidden_depth(&self, levels: &BlockLevels) -> f32 {
        let filled = self.mean.map_or(0.0, |mean| mean.filled);
        let depth = levels.inside - levels.outside;
        filled * (GROOVE_DEPTH * levels.inside - depth).max(0.0)
    }

    /// Levels at a row, between those of the two blocks beside it.
    #[inline(always)]
    fn between(&self, row: usize) -> BlockLevels {
        let last = self.beside.len() - 1;
        let position = ((to_f32(row) + 0.5) / to_f32(self.block) - 0.5).clamp(0.0, to_f32(last));
        let before = round_to_count(position.floor()).min(last);
        let (one, other) = (self.beside[before], self.beside[(before + 1).min(last)]);
        let fraction = position - to_f32(before);
        BlockLevels {
            outside: one.outside + fraction * (other.outside - one.outside),
            inside: one.inside + fraction * (other.inside - one.inside),
            darkest: if fraction < 0.5 { one.darkest } else { other.darkest },
        }
    }
}

impl BlockLevels {
    fn read_outside(&mut self, profile: &[f32; AROUND_PX], mean: &MeanProfile) {
        self.darkest = darkest_of(profile, mean.outside.0.saturating_sub(3));
        self.outside =
            if mean.on_ground { mean.ground_level(profile) } else { profile[self.darkest] };
    }
}

/// Level of the bead in a block of rows, and the number of positions that it is the mean of.
#[derive(Debug, Clone, Copy)]
struct BeadLevel {
    grey: f32,
    places: f32,
}

/// Levels of the bead itself, without positions in a hole. How deep a hole is follows from every
/// fourth position of every second block.
#[inline(always)]
fn bead_levels(blocks: &[BlockProfile], mean: &MeanProfile) -> Vec<BeadLevel> {
    let (from, to) = mean.inside;
    let mut values = Vec::with_capacity(blocks.len() * (to - from).div_ceil(8));
    for profile in blocks.iter().step_by(2) {
        values.extend(profile[from..to].chunks(4).map(|places| places[0]));
    }
    let median = rank::median(&mut values).unwrap_or(0.0);
    let spread = rank::median_deviation(&mut values, median).unwrap_or(0.0);
    let contrast = median - mean.grey[darkest_of(&mean.grey, 0)];
    let limit = median - (MIN_HOLE_DEVIATIONS * spread).max(MIN_HOLE_DEPTH * contrast);
    let mut levels = Vec::with_capacity(blocks.len());
    for profile in blocks {
        let (mut sum, mut places) = (0.0, 0.0);
        for &value in &profile[from..to] {
            let seen = if value > limit { 1.0 } else { 0.0 };
            sum += seen * value;
            places += seen;
        }
        levels.push(BeadLevel { grey: if places > 0.0 { sum / places } else { median }, places });
    }
    levels
}

/// The bead's level about each block, by a kernel over the blocks on either side.
#[inline(always)]
fn smooth_levels(levels: &[BeadLevel], kernel: &[f32]) -> Vec<f32> {
    let products: Vec<f32> = levels.iter().map(|level| level.places * level.grey).collect();
    let places: Vec<f32> = levels.iter().map(|level| level.places).collect();
    let mut smooth = smooth_values(&products, kernel);
    let totals = smooth_values(&places, kernel);
    for ((sum, total), own) in smooth.iter_mut().zip(totals).zip(levels) {
        *sum = if total > 0.0 { *sum / total } else { own.grey };
    }
    smooth
}

/// Sums of the values about each, weighted by a symmetric kernel.
#[inline(always)]
fn smooth_values(values: &[f32], kernel: &[f32]) -> Vec<f32> {
    let mut sums: Vec<f32> = values.iter().map(|value| kernel[0] * value).collect();
    for (offset, weight) in kernel.iter().enumerate().take(values.len()).skip(1) {
        for (sum, after) in sums.iter_mut().zip(&values[offset..]) {
            *sum += weight * after;
        }
        for (sum, before) in sums[offset..].iter_mut().zip(values) {
            *sum += weight * before;
        }
    }
    sums
}

/// Smooths what lies outside in the blocks' profiles along the bead.
#[inline(always)]
fn smooth(blocks: &[BlockProfile], kernel: &[f32], out: &mut Vec<[f32; AROUND_PX]>) {
    let half = kernel.len() - 1;
    out.resize(blocks.len(), [0.0; AROUND_PX]);
    for (block, out) in out.iter_mut().enumerate() {
        let (mut sums, mut total) = ([0.0; AROUND_PX], 0.0);
        let near = block.saturating_sub(half)..(block + half + 1).min(blocks.len());
        for (other, profile) in near.clone().zip(&blocks[near]) {
            let weight = kernel[other.abs_diff(block)];
            total += weight;
            for k in 0..AROUND_PX {
                sums[k] += weight * profile[k];
            }
        }
        for (out, sum) in out.iter_mut().zip(sums) {
            *out = sum / total;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_groove_is_as_deep_as_its_grey_leaves() {
        assert!((f64::from(GROOVE_DEPTH) - (1.0 - 0.13)).abs() < 1e-6);
        let sigma = 0.25 / 12f64.sqrt() / f64::from(GROOVE_DEPTH);
        assert!((DEPTH_SIGMA - sigma).abs() < 0.005, "{sigma}");
    }
}
