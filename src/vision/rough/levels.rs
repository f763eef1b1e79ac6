//! Grey levels on either side of an edge, along its course, and where each row
//! passes from one to the other.

use super::crossing::{self, Crossing, RowLevels};
use super::kernel;
use super::rough_input::RoughInput;
use super::window::{BLOCK_ROWS, RowWindows, STRAIGHT_ROWS};
use crate::numeric::number::round_to_count;
use crate::numeric::number::{to_f32, to_f64};
use crate::numeric::rank;
use crate::vision::edge_windows::WINDOW_PX;
use crate::vision::gauge::EdgeKind;

/// Pixels outside that are searched for what the bead stands against: a groove's
/// darkest place or the ground.
pub const OUTSIDE_PX: usize = 20;
/// First and last pixel inside whose mean is the bead's level: beyond the flank,
/// and near enough to have the light of the edge.
const INSIDE_PX: (f32, f32) = (6.0, 30.0);
/// Fraction of the width within which these lie.
const INSIDE_FRACTION: (f32, f32) = (0.14, 0.42);
/// Pixels of a course's profile.
pub const PROFILE_PX: usize = OUTSIDE_PX + 30;
/// How much darker than the bead a hole in it is at least: in median deviations of the
/// bead's places, four standard deviations of a Gaussian, and as a fraction of the contrast.
const MIN_HOLE_DEVIATIONS: f32 = 6.0;
const MIN_HOLE_DEPTH: f32 = 0.2;
/// Rows over which the bead's level is averaged, as the standard deviation of a
/// Gaussian: more than texture is long, less than the light changes within.
const INSIDE_ROWS: f64 = 48.0;
/// The same for what lies outside: a groove changes more quickly.
const OUTSIDE_ROWS: f64 = 6.0;
/// Fraction of the step within which a place outside is as dark as the darkest.
const SAME_LEVEL_FRACTION: f32 = 0.1;
/// As many such places in a row are ground; fewer are a groove.
const MIN_GROUND_PX: usize = 8;
/// Blocks whose mean is one look at how much darker a groove is than what lies beyond
/// it, and how many standard errors darker it must be where it is shallow and where it
/// is deep: a pattern of the ground has some ten places, one of which is three darker by
/// chance.
const SAMPLE_BLOCKS: usize = 4;
const DARKER_SIGMAS: (f32, f32) = (4.0, 2.5);
/// Difference that makes it deep, as a fraction of the step to the bead.
const MIN_DEEP_FRACTION: f32 = 0.4;
/// Distance from the darkest place from which on what lies beyond is told \[px\].
const BEYOND_GROOVE_PX: usize = 6;
/// Ground beside the edge whose mean is its level, where it has a pattern \[px\].
const NEAR_GROUND_PX: usize = 16;
/// Places of the ground that the flank may reach into.
const FLANK_FOOT_PX: usize = 3;
/// Height of a groove's far side, as a fraction of the near one.
const MIN_FAR_SIDE: f32 = 0.3;
/// Depth of a groove as a fraction of the bead's level: hardly any light comes out
/// of it. A narrow one seems less deep than it is, for the camera's blur fills it.
const GROOVE_DEPTH: f32 = 0.87;
/// Standard deviation of that, as a fraction of the depth: grooves with grey levels
/// of none to a quarter of the bead's.
pub const DEPTH_SIGMA: f64 = 0.08;
/// Length of a groove's floor, in distances from its darkest place to the bead, at
/// which it certainly is filled by blur, and from which on it certainly is not: a
/// box of four and five times the blur's standard deviation (0.87 and 1.01).
const FILLED_FLOOR_RATIO: (f32, f32) = (0.87, 1.0);
/// Height of a groove's far side, as a fraction of the near one, from which on its depth
/// may be hidden, and at which it certainly may: beside plain ground a darker line is
/// shade, or a lens's or a compression's.
const ENCLOSED_FAR_SIDE: (f32, f32) = (0.4, 0.6);

/// Pixels of a profile that may lie outside, in whole vectors of the processor.
const AROUND_PX: usize = (OUTSIDE_PX + 1).next_multiple_of(8);

/// The mean profile across an edge, from [`OUTSIDE`] pixels before it on.
pub type BlockProfile = [f32; PROFILE_PX];

/// Levels along an edge; keeps its memory from frame to frame.
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
    /// Position in each row's window \[px\]; not a number where there is none.
    pub at: Vec<f32>,
    /// Length of the flank of every [`STRAIGHT_ROWS`]th row \[px\], likewise.
    pub flank: Vec<f32>,
    /// Distance of the edge from where what lies outside ends, likewise.
    pub gap: Vec<f32>,
    /// Share of odd pixels, likewise, and the same of the bead farther inside.
    pub odd: Vec<f32>,
    /// See `odd`.
    pub odd_within: Vec<f32>,
    /// Mean distance of the edge from the course, rounded to pixels \[px\].
    pub off_course: f64,
    /// What was found of a row.
    found: Vec<Option<Crossing>>,
}

/// Levels about one block of rows.
#[derive(Debug, Clone, Copy, Default)]
struct BlockLevels {
    outside: f32,
    inside: f32,
    /// Darkest place, as an index of a profile.
    darkest: usize,
}

/// The profile of the whole edge and what is read from it.
#[derive(Debug, Clone, Copy)]
pub struct MeanProfile {
    /// Grey levels.
    pub grey: [f32; PROFILE_PX],
    /// Places whose mean is the level inside.
    pub inside: (usize, usize),
    /// Places whose mean is the level outside.
    pub outside: (usize, usize),
    /// Whether what lies outside is as wide as ground.
    pub on_ground: bool,
    /// How far it looks like a groove that is too narrow to show its depth: 0 to 1.
    pub filled: f32,
}

impl MeanProfile {
    /// Whether what lies outside becomes clearly brighter again farther out.
    pub fn is_groove(&self) -> bool {
        let bead = mean_of(&self.grey, self.inside);
        let darkest = self.grey[darkest_of(&self.grey, 0)];
        let beyond = self.grey[..self.outside.0].iter().fold(darkest, |most: f32, &v| most.max(v));
        beyond - darkest > MIN_FAR_SIDE * (bead - darkest)
    }

    /// The darkest place outside.
    pub fn darkest(&self) -> usize {
        darkest_of(&self.grey, self.outside.0)
    }

    /// Level of the bead beside the edge \[grey levels\].
    pub fn bead(&self) -> f64 {
        f64::from(mean_of(&self.grey, self.inside))
    }

    /// Standard deviation of the ground's level from place to place \[grey levels\].
    pub fn ground_spread(&self) -> f64 {
        let (from, to) = self.ground();
        let places = &self.grey[from..to.max(from + 1)];
        let mean = mean_of(&self.grey, (from, to.max(from + 1)));
        let squares: f32 = places.iter().map(|grey| (grey - mean).powi(2)).sum();
        f64::from(squares / to_f32(places.len())).sqrt()
    }

    /// Places whose mean is the level of the ground: without those where the flank
    /// begins.
    pub fn ground(&self) -> (usize, usize) {
        (self.outside.0, self.outside.1 - FLANK_FOOT_PX)
    }
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

    /// Where every so many rows pass from outside to the bead; not a number where they do
    /// not, and between them.
    #[inline(always)]
    pub fn cross(&self, windows: &RowWindows, course: &[f32], every: usize, out: &mut Crossings) {
        let rows = &windows.rows;
        out.found.clear();
        out.found.resize(rows.len(), None);
        out.at.clear();
        out.at.resize(rows.len(), f32::NAN);
        for row in (0..rows.len()).step_by(every) {
            let found = crossing::find(&rows[row], &self.flank(row, course[row]));
            out.found[row] = found;
            out.at[row] = found.map_or(f32::NAN, |found| found.at);
        }
    }

    /// What else the rows show whose crossings were found along the same course.
    #[inline(always)]
    pub fn describe(&self, windows: &RowWindows, course: &[f32], out: &mut Crossings) {
        let Crossings { at: _, flank, gap, odd, odd_within, off_course, found } = out;
        let looks = found.len().div_ceil(STRAIGHT_ROWS);
        for values in [&mut *flank, gap, odd, odd_within] {
            values.clear();
            values.resize(looks, f32::NAN);
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

    /// Levels about a row at which the course passes such a position \[px\].
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

    /// How much deeper than it looks a groove is taken to be \[grey levels\].
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
        let place = ((to_f32(row) + 0.5) / to_f32(self.block) - 0.5).clamp(0.0, to_f32(last));
        let before = round_to_count(place.floor()).min(last);
        let (one, other) = (self.beside[before], self.beside[(before + 1).min(last)]);
        let fraction = place - to_f32(before);
        BlockLevels {
            outside: one.outside + fraction * (other.outside - one.outside),
            inside: one.inside + fraction * (other.inside - one.inside),
            darkest: if fraction < 0.5 { one.darkest } else { other.darkest },
        }
    }
}

/// The profile of the whole edge; `None` where it does not step up.
fn mean_profile(blocks: &[BlockProfile], width_px: f32) -> Option<MeanProfile> {
    let mut grey = [0.0; PROFILE_PX];
    for profile in blocks {
        for k in 0..PROFILE_PX {
            grey[k] += profile[k];
        }
    }
    for value in &mut grey {
        *value /= to_f32(blocks.len());
    }
    let from = round_to_count((INSIDE_FRACTION.0 * width_px).clamp(2.0, INSIDE_PX.0));
    let to = round_to_count((INSIDE_FRACTION.1 * width_px).min(INSIDE_PX.1)).max(from + 1);
    let inside = (OUTSIDE_PX + from, (OUTSIDE_PX + to).min(PROFILE_PX));
    let bead = mean_of(&grey, inside);
    let darkest = darkest_of(&grey, 0);
    let limit = grey[darkest] + SAME_LEVEL_FRACTION * (bead - grey[darkest]);
    let mut outside = (darkest, darkest + 1);
    while outside.0 > 0 && grey[outside.0 - 1] < limit {
        outside.0 -= 1;
    }
    while outside.1 < OUTSIDE_PX && grey[outside.1] < limit {
        outside.1 += 1;
    }
    if !is_darker(blocks, darkest, bead - grey[darkest]) {
        outside = plain(&grey, bead);
    }
    let on_ground = outside.1 - outside.0 >= MIN_GROUND_PX;
    let beyond = grey[..outside.0].iter().fold(grey[darkest], |most: f32, &v| most.max(v));
    let far_side = (beyond - grey[darkest]) / (bead - grey[darkest]);
    let enclosed = ((far_side - ENCLOSED_FAR_SIDE.0) / (ENCLOSED_FAR_SIDE.1 - ENCLOSED_FAR_SIDE.0))
        .clamp(0.0, 1.0);
    let filled = if on_ground { 0.0 } else { enclosed * filled(&grey, outside, bead) };
    (bead > grey[darkest]).then_some(MeanProfile { grey, inside, outside, on_ground, filled })
}

/// Whether a place is darker than what lies beyond it along the whole edge, and not only
/// by the ground's pattern.
fn is_darker(blocks: &[BlockProfile], darkest: usize, step: f32) -> bool {
    if darkest < BEYOND_GROOVE_PX + 3 {
        return false;
    }
    let before = (0, darkest.saturating_sub(BEYOND_GROOVE_PX));
    let after = (darkest + BEYOND_GROOVE_PX, OUTSIDE_PX - FLANK_FOOT_PX);
    let stretches = [before, after].into_iter().filter(|(from, to)| from + 2 < *to);
    let places: Vec<usize> = stretches.flat_map(|(from, to)| from..to).collect();
    let looks = blocks.chunks(SAMPLE_BLOCKS).map(|blocks| {
        let darker = |profile: &BlockProfile| {
            let beyond: f32 = places.iter().map(|&k| profile[k]).sum();
            beyond / to_f32(places.len()) - profile[darkest]
        };
        blocks.iter().map(darker).sum::<f32>() / to_f32(blocks.len())
    });
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for darker in looks {
        count += 1.0;
        sum += darker;
        squares += darker * darker;
    }
    let mean = sum / count;
    let variance = (squares / count - mean * mean).max(0.0) / (count - 1.0_f32).max(1.0);
    let need = if mean > MIN_DEEP_FRACTION * step { DARKER_SIGMAS.1 } else { DARKER_SIGMAS.0 };
    mean > need * variance.sqrt()
}

/// Places of the ground, where it has a pattern.
fn plain(grey: &BlockProfile, bead: f32) -> (usize, usize) {
    let ground = mean_of(grey, (0, OUTSIDE_PX / 2));
    let limit = ground + SAME_LEVEL_FRACTION * (bead - ground);
    let foot = (1..=OUTSIDE_PX).rev().find(|&k| grey[k - 1] < limit).unwrap_or(OUTSIDE_PX);
    (foot.saturating_sub(NEAR_GROUND_PX), foot.max(1))
}

/// How far a groove looks too narrow to show its depth, from the length of its floor
/// against its width.
fn filled(grey: &BlockProfile, floor: (usize, usize), bead: f32) -> f32 {
    let darkest = darkest_of(grey, floor.0);
    let depth = bead - grey[darkest];
    let limit = grey[darkest] + SAME_LEVEL_FRACTION * depth;
    // Where the limit lies between a place of the floor and the next one.
    let part = |within: usize, beyond: usize| {
        ((limit - grey[within]) / (grey[beyond] - grey[within])).clamp(0.0, 1.0)
    };
    let before = if floor.0 > 0 { part(floor.0, floor.0 - 1) } else { 0.0 };
    let length = to_f32(floor.1 - 1 - floor.0) + before + part(floor.1 - 1, floor.1);
    let missing = grey[darkest + 1..].iter().take(OUTSIDE_PX).map(|value| (bead - value) / depth);
    let half = 0.5 + missing.map(|missing| missing.max(0.0)).sum::<f32>();
    ((FILLED_FLOOR_RATIO.1 - length / half) / (FILLED_FLOOR_RATIO.1 - FILLED_FLOOR_RATIO.0))
        .clamp(0.0, 1.0)
}

impl BlockLevels {
    fn read_outside(&mut self, profile: &[f32; AROUND_PX], mean: &MeanProfile) {
        self.darkest = darkest_of(profile, mean.outside.0.saturating_sub(3));
        self.outside =
            if mean.on_ground { mean_of(profile, mean.ground()) } else { profile[self.darkest] };
    }
}

/// Level of the bead in a block of rows, from so many of its places.
#[derive(Debug, Clone, Copy)]
struct BeadLevel {
    grey: f32,
    places: f32,
}

/// Levels of the bead itself: places that show a hole in it are passed over. Every fourth
/// place of every second block tells what a hole is.
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

/// Sums of values about each, by a kernel.
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

/// Darkest place outside, from a place on.
fn darkest_of(profile: &[f32], from: usize) -> usize {
    let mut darkest = from.min(OUTSIDE_PX);
    for place in darkest + 1..=OUTSIDE_PX {
        if profile[place] < profile[darkest] {
            darkest = place;
        }
    }
    darkest
}

fn mean_of(profile: &[f32], (from, to): (usize, usize)) -> f32 {
    profile[from..to].iter().sum::<f32>() / to_f32(to - from)
}
