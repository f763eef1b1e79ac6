//! A blurred edge in the pixels of a row, tabulated for positions between two pixels, and the
//! comparison of a row with it.

use std::ops::Range;

use nalgebra::Matrix3;

use super::overlay::StepShape;
use super::phase::{offset, split};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{to_count, to_f64};

pub mod textured;

/// Pixels that are taken together. Derived: 16 floats fill a vector of 512 bits.
const LANES: usize = 16;
/// Positions between two pixels for which the edge is tabulated.
const SUBPIXEL_PHASES: usize = 8;
/// Chunks of the core at most: a blur of 13 px and more is cut short. By definition all.
const MAX_CORE_CHUNKS: usize = MAX_CHUNKS;
/// Chunks of the surroundings on either side at most.
const MAX_PLAIN_CHUNKS: usize = 2;
/// Chunks at most. Derived: 96/16, what an overlay reaches.
const MAX_CHUNKS: usize = 6;
/// Half the core, in blurs. Derived: beyond 3.5 blurs 2·10⁻⁴ of a step is left, 1 − Φ(3.5).
const CORE_BLURS: f64 = 3.5;
/// Margin beyond that \[px\], for an edge between two pixels.
const CORE_MARGIN_PX: f64 = 1.0;
/// Fewest chunks of the core in textured surroundings, of which nothing is plain.
const TEXTURED_CORE_CHUNKS: usize = 4;

type Chunk = [f32; LANES];

/// One chunk of pixels of the template.
#[derive(Debug, Clone, Copy, Default)]
struct TemplateChunk {
    /// Fraction of the step that is reached, with shading.
    step: Chunk,
    /// 1 where the pixel counts.
    mask: Chunk,
    /// The pure step's fraction, where the pixel counts.
    after: Chunk,
    /// Slope of the step \[1/px\], where the pixel counts.
    slope: Chunk,
}

/// Sums of products of the core's columns, mean over the phases.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Products {
    /// slope · slope.
    pub slope_slope: f64,
    /// slope · before, slope · after, before · before, before · after, after · after.
    pub others: [f64; 5],
    /// Pixels that count.
    pub pixels: f64,
}

/// An edge of known blur and surroundings.
#[derive(Debug, Clone)]
pub struct StepTemplate {
    parts: Vec<TemplateChunk>,
    chunks: usize,
    core: Range<usize>,
    /// Sums over the core.
    pub products: Products,
}

/// Sums of a row's residuals from the levels and the position that were expected.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RowSums {
    /// Residual times the slope of the step.
    pub slope: f32,
    /// Sum of the squared residuals.
    pub sum_of_squares: f32,
    /// Residual times the fraction before the edge.
    pub before: f32,
    /// Residual times the fraction after it.
    pub after: f32,
    /// Pixels that lie too far off to be noise; their residual counts as 0.
    pub wild: f32,
}

impl RowSums {
    /// Sums of a row whose edge lies outside the pixels that were read.
    pub const OUT_OF_SIGHT: Self =
        Self { slope: 0.0, sum_of_squares: 0.0, before: 0.0, after: 0.0, wild: f32::INFINITY };
}

/// Plain pixels that count and their residuals, over several rows, lane by
/// lane.
#[derive(Debug, Clone, Copy, Default)]
pub struct PlainSums {
    before: [Chunk; 2],
    after: [Chunk; 2],
}

impl PlainSums {
    /// Number of pixels and sum of their residuals, before the edge and after it.
    pub fn totals(&self) -> [[f64; 2]; 2] {
        [&self.before, &self.after].map(|sums| sums.map(|lanes| total(&lanes).into()))
    }
}

/// Position and levels that a row is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedStep {
    /// Position of the edge, rounded to a pixel and a phase: within a sixteenth of a pixel of the
    /// one that was requested \[px\].
    pub at: f32,
    position: isize,
    phase: usize,
    /// Level before it \[grey levels\].
    pub before: f32,
    /// Step to the level after it \[grey levels\].
    pub step: f32,
    /// Residual from which on a plain pixel shows a grain or a spark \[grey levels\].
    pub tolerance: f32,
    /// That residual for pixels of the step, where the position may be off a little \[grey
    /// levels\].
    pub tolerance_at_step: f32,
}

impl ExpectedStep {
    /// A position, the level before it and the step to the level after it, and how
    /// far pixels may be off beside the step and on it.
    #[inline(always)]
    pub fn new([at, before, step]: [f32; 3], tolerances: [f32; 2]) -> Self {
        let (position, phase) = split(at, SUBPIXEL_PHASES);
        #[expect(clippy::cast_precision_loss, reason = "a position near the gauge, few phases")]
        let at = position as f32 + phase as f32 / SUBPIXEL_PHASES as f32;
        let [tolerance, tolerance_at_step] = tolerances;
        Self { at, position, phase, before, step, tolerance, tolerance_at_step }
    }
}

impl Default for StepTemplate {
    fn default() -> Self {
        Self {
            parts: vec![TemplateChunk::default(); SUBPIXEL_PHASES * MAX_CHUNKS],
            chunks: 0,
            core: 0..0,
            products: Products::default(),
        }
    }
}

impl StepTemplate {
    /// How far the core reaches to either side for a blur \[px\].
    pub fn core_half(blur: f64) -> f64 {
        let half = CORE_BLURS * blur + CORE_MARGIN_PX;
        to_f64(chunks(2.0 * half).clamp(1, MAX_CORE_CHUNKS) * LANES / 2)
    }

    /// Tabulates an edge.
    #[inline(always)]
    pub fn tabulate(&mut self, table: &StepTable, shape: &StepShape, textured: bool) {
        let half = CORE_BLURS * shape.step.blur + CORE_MARGIN_PX;
        let core = chunks(2.0 * half)
            .clamp(if textured { TEXTURED_CORE_CHUNKS } else { 1 }, MAX_CORE_CHUNKS);
        // A step that goes on beyond the core leaves nothing plain.
        let too_long = 2.0 * half > to_f64(MAX_CORE_CHUNKS * LANES);
        let room = MAX_CHUNKS.saturating_sub(core) / 2;
        let plain = if textured || too_long { 0 } else { room.min(MAX_PLAIN_CHUNKS) };
        let half = to_f64(core * LANES / 2);
        let before = chunks(shape.extent.before - half).min(plain);
        let after = chunks(shape.extent.after - half).min(plain);
        self.chunks = before + core + after;
        self.core = before..before + core;
        let mut products = Products::default();
        for phase in 0..SUBPIXEL_PHASES {
            for chunk in 0..self.chunks {
                let part = &mut self.parts[phase * MAX_CHUNKS + chunk];
                let first = to_f64(chunk * LANES) - to_f64(before * LANES) - half;
                let first = first - offset(phase, SUBPIXEL_PHASES);
                if self.core.contains(&chunk) {
                    fill_core(part, table, shape, first);
                    products.add(part);
                } else {
                    fill_plain(part, shape, first);
                }
                if shape.is_bent() {
                    add_bends(part, table, shape, first);
                }
            }
        }
        self.products = products.mean();
    }

    /// Number of plain pixels of a row before the edge and after it; 0.5 where there are none.
    pub fn plain_pixels(&self) -> [f64; 2] {
        let parts = &self.parts[..self.chunks];
        let count = |parts: &[TemplateChunk]| -> f64 {
            parts.iter().flat_map(|part| part.mask).map(f64::from).sum::<f64>().max(0.5)
        };
        [count(&parts[..self.core.start]), count(&parts[self.core.end..])]
    }

    /// Compares a window with the edge; `None` where the edge lies too near its
    /// end.
    #[inline(always)]
    pub fn compare(
        &self,
        (pixels, first): (&[f32], isize),
        expected: &ExpectedStep,
        plain: &mut PlainSums,
    ) -> Option<RowSums> {
        let ExpectedStep { position, phase, .. } = *expected;
        let reach = (self.core.start * LANES + self.core.len() * LANES / 2).cast_signed();
        let start = usize::try_from(position - reach - first).ok()?;
        let pixels = pixels.get(start..start + self.chunks * LANES)?;
        let parts = &self.parts[phase * MAX_CHUNKS..][..self.chunks];
        let (before, rest) = parts.split_at(self.core.start);
        let (core, after) = rest.split_at(self.core.len());
        let (pixels_before, rest) = pixels.split_at(before.len() * LANES);
        let (pixels_core, pixels_after) = rest.split_at(core.len() * LANES);
        let mut lanes = [[0.0f32; LANES]; 5];
        for (part, pixels) in core.iter().zip(pixels_core.chunks_exact(LANES)) {
            for k in 0..LANES {
                let miss = residual(part, k, pixels[k], expected) * part.mask[k];
                let off = if miss.abs() > expected.tolerance_at_step { 1.0 } else { 0.0 };
                let miss = miss * (1.0 - off);
                lanes[4][k] += off;
                lanes[0][k] += miss * part.slope[k];
                lanes[1][k] += miss * miss;
                lanes[2][k] += miss;
                lanes[3][k] += miss * part.after[k];
            }
        }
        add_plain(before, pixels_before, expected, &mut plain.before);
        add_plain(after, pixels_after, expected, &mut plain.after);
        let [slope, squares, all, after, wild] = lanes.map(|lanes| total(&lanes));
        Some(RowSums { slope, sum_of_squares: squares, before: all - after, after, wild })
    }
}

#[inline(always)]
fn add_plain(
    parts: &[TemplateChunk],
    pixels: &[f32],
    expected: &ExpectedStep,
    [count, sum]: &mut [Chunk; 2],
) {
    for (part, pixels) in parts.iter().zip(pixels.chunks_exact(LANES)) {
        for k in 0..LANES {
            let miss = residual(part, k, pixels[k], expected);
            let counts = if miss.abs() <= expected.tolerance { part.mask[k] } else { 0.0 };
            count[k] += counts;
            sum[k] += counts * miss;
        }
    }
}

#[inline(always)]
fn residual(part: &TemplateChunk, k: usize, pixel: f32, expected: &ExpectedStep) -> f32 {
    pixel - expected.before - expected.step * part.step[k]
}

#[inline(always)]
fn total(lanes: &Chunk) -> f32 {
    let mut eight = [0.0f32; 8];
    for k in 0..8 {
        eight[k] = lanes[k] + lanes[k + 8];
    }
    let mut four = [0.0f32; 4];
    for k in 0..4 {
        four[k] = eight[k] + eight[k + 4];
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Fills a chunk of the core whose first pixel lies at a distance from the edge.
#[expect(clippy::cast_possible_truncation, reason = "shares and slopes of a step")]
#[inline(always)]
fn fill_core(part: &mut TemplateChunk, table: &StepTable, shape: &StepShape, first: f64) {
    let (blur, per_blur) = (shape.step.blur, 1.0 / shape.step.blur);
    for k in 0..LANES {
        let distance = first + to_f64(k);
        let z = distance * per_blur;
        let (step, density, [falling, rising]) = table.with_slopes(z);
        let shading = blur * (shape.shading[0].slope * falling + shape.shading[1].slope * rising);
        let counts = distance >= -shape.extent.before && distance <= shape.extent.after;
        let mask = f64::from(counts);
        part.step[k] = (step + shading) as f32;
        part.mask[k] = mask as f32;
        part.after[k] = (mask * step) as f32;
        part.slope[k] = (mask * density * per_blur) as f32;
    }
}

/// Fills a chunk of the surroundings, on one side of the edge.
#[expect(clippy::cast_possible_truncation, reason = "distances and slopes")]
#[inline(always)]
fn fill_plain(part: &mut TemplateChunk, shape: &StepShape, first: f64) {
    let (first, after) = (first as f32, first > 0.0);
    let (step, extent, shading) = if after {
        (1.0, shape.extent.after as f32, shape.shading[1].slope as f32)
    } else {
        (0.0, shape.extent.before as f32, shape.shading[0].slope as f32)
    };
    for (k, ahead) in (0u8..).zip(&mut part.step) {
        *ahead = first + f32::from(k);
    }
    for k in 0..LANES {
        let away = part.step[k].abs();
        part.step[k] = step + shading * away;
        part.mask[k] = if away <= extent { 1.0 } else { 0.0 };
    }
}

/// Adds bent shading and the tails of steps beside the edge.
#[cold]
#[expect(clippy::cast_possible_truncation, reason = "shares of a step")]
fn add_bends(part: &mut TemplateChunk, table: &StepTable, shape: &StepShape, first: f64) {
    let blur = shape.step.blur;
    let [bend_before, bend_after] = shape.shading.map(|shading| shading.bend * blur * blur);
    for (k, level) in part.step.iter_mut().enumerate() {
        let away = first + to_f64(k);
        let z = away / blur;
        let (step, density) = table.at(z);
        // Squares of the distances on one side, blurred.
        let square = 1.0 + z * z;
        let before = square * (1.0 - step) - z * density;
        let after = square * step + z * density;
        let bends = bend_before * before + bend_after * after;
        *level += (bends + shape.flanks.at(table, away)) as f32;
    }
}

impl Products {
    #[expect(clippy::needless_range_loop, reason = "one loop over all lanes is vectorised")]
    #[inline(always)]
    fn add(&mut self, part: &TemplateChunk) {
        let mut lanes = [[0.0f32; LANES]; 7];
        for k in 0..LANES {
            let (mask, after, slope) = (part.mask[k], part.after[k], part.slope[k]);
            let before = mask - after;
            (lanes[0][k], lanes[1][k]) = (slope * slope, slope * before);
            (lanes[2][k], lanes[3][k]) = (slope * after, before * before);
            (lanes[4][k], lanes[5][k]) = (before * after, after * after);
            lanes[6][k] = mask;
        }
        let [slope_slope, others @ .., pixels] = lanes.map(|lane| f64::from(total(&lane)));
        self.slope_slope += slope_slope;
        self.pixels += pixels;
        for (sum, other) in self.others.iter_mut().zip::<[f64; 5]>(others) {
            *sum += other;
        }
    }

    /// Normal equations of one row for the step times its shift, the level
    /// before it and the level after it.
    pub fn matrix(&self) -> Matrix3<f64> {
        let [sb, sa, bb, ba, aa] = self.others;
        Matrix3::new(self.slope_slope, -sb, -sa, -sb, bb, ba, -sa, ba, aa)
    }

    fn mean(self) -> Self {
        let fraction = 1.0 / to_f64(SUBPIXEL_PHASES);
        let others = self.others.map(|other| fraction * other);
        Self { slope_slope: fraction * self.slope_slope, others, pixels: fraction * self.pixels }
    }
}

/// Number of chunks that hold a number of pixels.
fn chunks(pixels: f64) -> usize {
    to_count((pixels.max(0.0) / to_f64(LANES)).ceil())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::overlay::{BlurredStep, Clearance, NeighbourSteps, SideShading};

    /// A parabola that begins at the edge is, blurred, (x² + s²)Φ(x/s) + xsφ(x/s).
    #[test]
    fn the_table_is_the_blurred_step_with_its_shading_and_bend() {
        let (blur, slope, bend) = (1.6f64, 0.01, -0.0004);
        let shape = StepShape {
            step: BlurredStep { at: 0.0, blur, before: 0.0, after: 1.0 },
            extent: Clearance { before: 20.0, after: 20.0 },
            shading: [SideShading::default(), SideShading { slope, bend }],
            flanks: NeighbourSteps::default(),
            variance: 0.0,
        };
        let mut template = StepTemplate::default();
        template.tabulate(&StepTable::default(), &shape, false);
        let middle =
            to_f64(template.core.start * LANES) + to_f64(template.core.len() * LANES) / 2.0;
        for phase in [0, 3] {
            for k in template.core.start * LANES..template.core.end * LANES {
                let x = to_f64(k) - middle - offset(phase, SUBPIXEL_PHASES);
                let z = x / blur;
                let step = 0.5 * libm::erfc(-z / 2f64.sqrt());
                let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
                let line = x * step + blur * density;
                let parabola = (x * x + blur * blur) * step + x * blur * density;
                let expected = step + slope * line + bend * parabola;
                let part = &template.parts[phase * MAX_CHUNKS + k / LANES];
                let found = f64::from(part.step[k % LANES]);
                assert!((found - expected).abs() < 1e-3, "{x}: {found} {expected}");
            }
        }
    }
}
