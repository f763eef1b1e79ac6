//! Grey levels on either side of an edge, along its course, and where each row
//! passes half way between them.

use super::crossing::{self, Flank};
use super::kernel;
use super::route::BLOCK;
use super::whole;
use super::window::Windows;
use crate::vision::number::{float, single};
use crate::vision::sheet::SPAN;

/// Pixels outside that are searched for what the bead stands against: a groove's
/// darkest place or the ground.
pub const OUTSIDE: usize = 20;
/// First and last pixel inside whose mean is the bead's level: beyond the flank,
/// and near enough to have the light of the edge.
const INSIDE: (f32, f32) = (6.0, 30.0);
/// Fraction of the width within which these lie.
const INSIDE_FRACTION: (f32, f32) = (0.14, 0.42);
/// Pixels of a course's profile.
pub const LENGTH: usize = OUTSIDE + 30;
/// Rows over which levels are averaged, as the standard deviation of a Gaussian:
/// more than texture is long, less than the light changes within.
const ALONG_ROWS: f64 = 24.0;
/// Fraction of the step within which a place outside is as dark as the darkest.
const SAME: f32 = 0.1;
/// How far inside its course an edge may be torn \[px\].
const DEEPEST_PX: f32 = 25.0;
/// As many such places in a row are ground; fewer are a groove.
const GROUND_PX: usize = 8;

/// The mean profile across an edge, from [`OUTSIDE`] pixels before it on.
pub type Profile = [f32; LENGTH];

/// Levels along an edge; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Levels {
    blocks: Vec<Profile>,
    smooth: Vec<Profile>,
    beside: Vec<BlockLevels>,
    mean: Option<MeanProfile>,
    kernel: Vec<f32>,
}

/// What the rows show of an edge, one value a row.
#[derive(Debug, Clone, Default)]
pub struct Crossings {
    /// Position in the row's window \[px\]; not a number where there is none.
    pub at: Vec<f32>,
    /// Length of the flank \[px\], likewise.
    pub flank: Vec<f32>,
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
    pub grey: [f32; LENGTH],
    /// Places whose mean is the level inside.
    pub inside: (usize, usize),
    /// Places whose mean is the level outside.
    pub outside: (usize, usize),
    /// Whether what lies outside is as wide as ground.
    pub on_ground: bool,
}

impl Levels {
    /// Step from outside to the bead in the mean \[grey levels\].
    pub fn contrast(&self) -> f64 {
        let sum: f32 = self.beside.iter().map(|levels| levels.inside - levels.outside).sum();
        f64::from(sum) / float(self.beside.len().max(1))
    }

    /// The profile of the whole edge.
    pub fn mean(&self) -> Option<&MeanProfile> {
        self.mean.as_ref()
    }

    /// Profiles of the blocks, aligned along the course.
    pub fn blocks(&self) -> &[Profile] {
        &self.blocks
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
    pub fn read(&mut self, windows: &Windows, course: &[f32], width_px: f32) -> Option<()> {
        if self.kernel.is_empty() {
            self.kernel = kernel(ALONG_ROWS / float(BLOCK));
        }
        self.align(windows, course);
        self.smooth_blocks();
        let mean = mean_profile(&self.blocks, width_px)?;
        self.beside.clear();
        self.beside.extend(self.smooth.iter().map(|profile| block_levels(profile, &mean)));
        self.mean = Some(mean);
        (self.contrast() > 0.0).then_some(())
    }

    /// Means of the blocks' rows, aligned on the course to the nearest pixel.
    #[inline(always)]
    fn align(&mut self, windows: &Windows, course: &[f32]) {
        self.blocks.clear();
        for (rows, course) in windows.all().chunks(BLOCK).zip(course.chunks(BLOCK)) {
            let mut sums = [0.0; LENGTH];
            for (row, &at) in rows.iter().zip(course) {
                let start = whole(at.max(0.0)).cast_signed() - OUTSIDE.cast_signed();
                for (k, sum) in (start..).zip(&mut sums) {
                    *sum += row[k.clamp(0, SPAN.cast_signed() - 1).unsigned_abs()];
                }
            }
            let scale = 1.0 / single(rows.len());
            for sum in &mut sums {
                *sum *= scale;
            }
            self.blocks.push(sums);
        }
    }

    /// Smooths the blocks' profiles along the bead.
    #[inline(always)]
    fn smooth_blocks(&mut self) {
        let count = self.blocks.len();
        let half = self.kernel.len() - 1;
        self.smooth.resize(count, [0.0; LENGTH]);
        for (block, out) in self.smooth.iter_mut().enumerate() {
            out.fill(0.0);
            let mut total = 0.0;
            let near = block.saturating_sub(half)..(block + half + 1).min(count);
            for (other, profile) in near.clone().zip(&self.blocks[near]) {
                let weight = self.kernel[other.abs_diff(block)];
                total += weight;
                for k in 0..LENGTH {
                    out[k] += weight * profile[k];
                }
            }
            for value in out.iter_mut() {
                *value /= total;
            }
        }
    }

    /// Where each row passes from outside to the bead, and how long its flank is
    /// \[px\]; not numbers where it does not.
    #[inline(always)]
    pub fn cross(&self, windows: &Windows, course: &[f32], out: &mut Crossings) {
        out.at.clear();
        out.flank.clear();
        let ground = self.mean.filter(|mean| mean.on_ground).map(|mean| mean.outside.1 - 1);
        for (number, (row, &at)) in windows.all().iter().zip(course).enumerate() {
            let levels = self.between(number);
            let start = ground.unwrap_or(levels.darkest);
            let flank = Flank {
                start: at + single(start) - single(OUTSIDE),
                outside: levels.outside,
                inside: levels.inside,
                end: at + DEEPEST_PX,
            };
            let found = crossing::of(row, &flank);
            out.at.push(found.map_or(f32::NAN, |found| found.at));
            out.flank.push(found.map_or(f32::NAN, |found| found.flank));
        }
    }

    /// Levels at a row, between those of the two blocks beside it.
    fn between(&self, row: usize) -> BlockLevels {
        let last = self.beside.len() - 1;
        let place = ((single(row) + 0.5) / single(BLOCK) - 0.5).clamp(0.0, single(last));
        let before = whole(place.floor()).min(last);
        let (one, other) = (self.beside[before], self.beside[(before + 1).min(last)]);
        let fraction = place - single(before);
        BlockLevels {
            outside: one.outside + fraction * (other.outside - one.outside),
            inside: one.inside + fraction * (other.inside - one.inside),
            darkest: if fraction < 0.5 { one.darkest } else { other.darkest },
        }
    }
}

/// The profile of the whole edge; `None` where it does not step up.
fn mean_profile(blocks: &[Profile], width_px: f32) -> Option<MeanProfile> {
    let mut grey = [0.0; LENGTH];
    for profile in blocks {
        for k in 0..LENGTH {
            grey[k] += profile[k] / single(blocks.len());
        }
    }
    let from = whole((INSIDE_FRACTION.0 * width_px).clamp(2.0, INSIDE.0));
    let to = whole((INSIDE_FRACTION.1 * width_px).min(INSIDE.1)).max(from + 1);
    let inside = (OUTSIDE + from, (OUTSIDE + to).min(LENGTH));
    let bead = mean_of(&grey, inside);
    let darkest = darkest_of(&grey, 0);
    let limit = grey[darkest] + SAME * (bead - grey[darkest]);
    let mut outside = (darkest, darkest + 1);
    while outside.0 > 0 && grey[outside.0 - 1] < limit {
        outside.0 -= 1;
    }
    while outside.1 < OUTSIDE && grey[outside.1] < limit {
        outside.1 += 1;
    }
    let on_ground = outside.1 - outside.0 >= GROUND_PX;
    (bead > grey[darkest]).then_some(MeanProfile { grey, inside, outside, on_ground })
}

fn block_levels(profile: &Profile, mean: &MeanProfile) -> BlockLevels {
    let darkest = darkest_of(profile, mean.outside.0.saturating_sub(3));
    let outside = if mean.on_ground { mean_of(profile, mean.outside) } else { profile[darkest] };
    BlockLevels { outside, inside: mean_of(profile, mean.inside), darkest }
}

/// Darkest place outside, from a place on.
fn darkest_of(profile: &Profile, from: usize) -> usize {
    let places = from..=OUTSIDE;
    places.min_by(|&a, &b| profile[a].total_cmp(&profile[b])).unwrap_or(OUTSIDE)
}

fn mean_of(profile: &Profile, (from, to): (usize, usize)) -> f32 {
    profile[from..to].iter().sum::<f32>() / single(to - from)
}
