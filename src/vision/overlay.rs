//! The mean profile of an edge, from superimposed rows all along it: its blur, how far the
//! surroundings on either side are plain, and their shading. Rows that differ from most, because a
//! grain or a spark lies on them, are left out.

use crate::vision::buffer::{refill, reset};
use std::ops::Range;

use super::edge_windows::EdgeWindows;
use super::phase::split;
use crate::numeric::number::{narrow_to_f32, to_count, to_f32, to_f64};
use crate::numeric::rank;

mod curved;
mod fitter;
mod flank;
mod flank_skew;
mod groove_check;
mod linear;
mod look;
mod shape;
mod slopes;
mod step;
mod step_fit;

pub use fitter::StepFitter;
pub use flank_skew::EdgeSkew;
pub use look::{SideRange, StepFit};
pub use shape::{SideShading, StepShape};
#[cfg(test)]
pub use step::NeighbourSteps;
pub use step::{BlurredStep, Clearance};

/// Rows that are superimposed at most.
const MAX_ROWS: usize = 100;
/// Farthest sample from the edge on either side \[px\].
pub const HALF_SPAN: usize = 48;
const SPAN: usize = 2 * HALF_SPAN;
/// Positions between pixels to which rows are rounded.
const PHASES: usize = 2;
/// Samples this near the edge show whether a row is like the others \[px\].
const CORE_HALF: usize = 12;
const JUDGED_SAMPLES: Range<usize> = HALF_SPAN - CORE_HALF..HALF_SPAN + CORE_HALF;
/// Squared difference of a row from the mean, relative to the rows' median, above which it is left
/// out: at first, and in the second pass, when the mean is a better one.
const MAX_ROW_MISFIT: [f32; 2] = [2.0, 1.7];
/// Fraction of the rows that are most alike, from which a mean is made where many may be occluded.
const BEST_FRACTION: f32 = 0.3;
/// Rounds in which that mean is updated: more cost time, fewer leave occluded rows in it.
const MAX_SETTLE_ROUNDS: usize = 5;
/// Squared difference, relative to the median, above which a row that is clipped at the end of the
/// scale is left out.
const MAX_CLIPPED_MISFIT: f32 = 3.5;
/// Variance that rounding to phases adds to the blur \[px²\]. Derived: (1/PHASES)²/12, the variance
/// of a uniform error of half a pixel.
const ROUNDING_VARIANCE_PX2: f64 = 1.0 / 48.0;

/// How a window was placed: at which phase, how far the path lies ahead of
/// its pixel \[px\], of how many rows it is, and the level before the edge and
/// the step that were expected \[grey levels\].
#[derive(Debug, Clone, Copy)]
struct PlacedRow {
    number: usize,
    phase: usize,
    ahead: f32,
    rows: f32,
    before: f32,
    step: f32,
}

/// Superimposes rows; keeps its buffers from frame to frame.
#[derive(Debug, Clone)]
pub struct Overlay {
    rows: Vec<[f32; SPAN]>,
    placed: Vec<PlacedRow>,
    row_misfits: Vec<f32>,
    sorted: Vec<f32>,
    phases: [PhaseMean; PHASES],
    /// How unlike the mean a row is in the median.
    median_misfit: f32,
}

/// Mean of rows of one part along the bead, all at nearly the same position
/// between pixels.
#[derive(Debug, Clone)]
pub struct MeanProfilePart {
    /// Samples \[grey levels\].
    pub mean: [f32; SPAN],
    /// Number of rows.
    pub rows: f64,
    /// Mean distance of the path from the middle sample \[px\].
    pub shift: f64,
    /// Variance of that distance \[px²\].
    pub spread: f64,
    /// Mean of the levels that were expected before the edge and after it
    /// \[grey levels\].
    pub levels: [f64; 2],
}

impl MeanProfilePart {
    const EMPTY: Self =
        Self { mean: [0.0; SPAN], rows: 0.0, shift: 0.0, spread: 0.0, levels: [0.0; 2] };

    fn add(&mut self, row: &[f32; SPAN], placed: &PlacedRow) {
        let PlacedRow { ahead, rows, before, step, .. } = *placed;
        for (sum, sample) in self.mean.iter_mut().zip(row) {
            *sum += rows * (before + step * sample);
        }
        let (ahead, rows) = (f64::from(ahead), f64::from(rows));
        self.rows += rows;
        self.shift += rows * ahead;
        self.spread += rows * ahead * ahead;
        self.levels[0] += rows * f64::from(before);
        self.levels[1] += rows * f64::from(before + step);
    }

    /// Sums become means.
    fn finish(&mut self) {
        let fraction = 1.0 / self.rows;
        self.mean.iter_mut().for_each(|value| *value *= narrow_to_f32(fraction));
        self.shift *= fraction;
        self.spread = (fraction * self.spread - self.shift * self.shift).max(0.0);
        self.levels = self.levels.map(|level| fraction * level);
    }

    /// Each sample's distance from the path and its value, from a distance to
    /// another \[px\].
    pub fn samples(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        samples(&self.mean, self.shift, (from, to))
    }
}

impl Default for Overlay {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            placed: Vec::new(),
            row_misfits: Vec::new(),
            sorted: Vec::new(),
            phases: [PhaseMean::EMPTY; PHASES],
            median_misfit: f32::INFINITY,
        }
    }
}

impl Overlay {
    /// Superimposes windows at the expected edge, without rows that differ from the mean.
    #[inline(always)]
    pub fn lay(&mut self, sheet: &EdgeWindows) {
        self.lay_down(sheet);
        self.average(f32::INFINITY, JUDGED_SAMPLES);
        let [first, last] = MAX_ROW_MISFIT;
        self.median_misfit = self.compute_row_misfits(0.5);
        let limit = first * self.median_misfit;
        if self.row_misfits.iter().any(|&unlike| unlike > limit) {
            self.average(limit, JUDGED_SAMPLES);
            self.median_misfit = self.compute_row_misfits(0.5);
        }
        self.average(last * self.median_misfit, 0..SPAN);
    }

    /// Superimposes windows of which many may be occluded: starts from those that are clear and
    /// repeats with those most like the mean.
    #[inline(always)]
    pub fn lay_robustly(&mut self, sheet: &EdgeWindows, clear: impl Fn(usize) -> bool) {
        self.lay_clear(sheet, clear);
        for _ in 0..MAX_SETTLE_ROUNDS {
            let limit = self.compute_row_misfits(BEST_FRACTION);
            self.average(limit, 0..SPAN);
        }
    }

    /// Places the windows that are clear, and no others.
    #[inline(always)]
    pub fn lay_clear(&mut self, sheet: &EdgeWindows, clear: impl Fn(usize) -> bool) {
        self.lay_down(sheet);
        for (placed, unlike) in self.placed.iter().zip(&mut self.row_misfits) {
            *unlike = if clear(placed.number) { 0.0 } else { f32::INFINITY };
        }
        self.average(f32::MAX, 0..SPAN);
    }

    #[inline(always)]
    fn lay_down(&mut self, sheet: &EdgeWindows) {
        let windows = &sheet.windows;
        let count = windows.len().min(MAX_ROWS);
        self.rows.clear();
        self.placed.clear();
        for k in 0..count {
            let number = (2 * k + 1) * windows.len() / (2 * count);
            let window = &windows[number];
            let [at, before, step] = window.expected;
            let (place, phase) = split(at, PHASES);
            let start = place - window.first - HALF_SPAN.cast_signed();
            let pixels = usize::try_from(start).ok().and_then(|start| {
                sheet.pixels(number).get(start..start + SPAN)?.first_chunk::<SPAN>()
            });
            let Some(pixels) = pixels else { continue };
            #[expect(clippy::cast_precision_loss, reason = "a position near the gauge")]
            let ahead = at - place as f32;
            let (scale, shift) = (1.0 / step, before / step);
            let mut row = [0.0; SPAN];
            for (sample, pixel) in row.iter_mut().zip(pixels) {
                *sample = pixel * scale - shift;
            }
            self.rows.push(row);
            self.placed.push(PlacedRow { number, phase, ahead, rows: window.rows, before, step });
        }
        reset(&mut self.row_misfits, self.rows.len(), 0.0);
    }

    /// Means of the rows whose misfit is at most `limit`, in some columns.
    #[inline(always)]
    fn average(&mut self, limit: f32, columns: Range<usize>) {
        self.phases = [PhaseMean::EMPTY; PHASES];
        for ((row, placed), &unlike) in self.rows.iter().zip(&self.placed).zip(&self.row_misfits) {
            if unlike > limit {
                continue;
            }
            let PlacedRow { phase, ahead, rows, .. } = *placed;
            let phase = &mut self.phases[phase];
            phase.rows += rows;
            phase.shift += rows * ahead;
            let sums = phase.samples[columns.clone()].iter_mut();
            for (sum, sample) in sums.zip(&row[columns.clone()]) {
                *sum += rows * sample;
            }
        }
        for PhaseMean { samples, shift, rows } in &mut self.phases {
            let scale = 1.0 / f32::max(*rows, 1.0);
            *shift *= scale;
            for value in samples {
                *value *= scale;
            }
        }
    }

    /// Computes the misfit of each row: its squared difference from the mean about the edge.
    /// Returns the quantile of the misfits at a fraction.
    #[inline(always)]
    fn compute_row_misfits(&mut self, fraction: f32) -> f32 {
        for ((row, placed), unlike) in self.rows.iter().zip(&self.placed).zip(&mut self.row_misfits)
        {
            let mean = &self.phases[placed.phase].samples;
            let mut lanes = [0.0f32; 8];
            for (a, b) in
                row[JUDGED_SAMPLES].chunks_exact(8).zip(mean[JUDGED_SAMPLES].chunks_exact(8))
            {
                for k in 0..8 {
                    let miss = a[k] - b[k];
                    lanes[k] += miss * miss;
                }
            }
            *unlike = lanes.iter().sum();
        }
        refill(&mut self.sorted, self.row_misfits.iter().copied());
        let rank = rank_of(self.sorted.len(), fraction);
        rank::at(&mut self.sorted, rank).unwrap_or(f32::INFINITY)
    }

    /// Means of the rows in several parts along the bead, as grey levels. Only rows that are very
    /// unlike the others are left out: clipped pixels lie farther below their mean than above it,
    /// and leaving them out would raise it.
    pub fn profiles(&self, parts: usize, profiles: &mut Vec<MeanProfilePart>) {
        reset(profiles, parts * PHASES, MeanProfilePart::EMPTY);
        let count = self.rows.len();
        for (k, (row, placed)) in self.rows.iter().zip(&self.placed).enumerate() {
            if self.row_misfits[k] <= MAX_CLIPPED_MISFIT * self.median_misfit {
                profiles[k * parts / count * PHASES + placed.phase].add(row, placed);
            }
        }
        profiles.retain(|profile| profile.rows > 0.0);
        for profile in profiles {
            profile.finish();
        }
    }

    /// Number of rows in the means.
    pub fn used(&self) -> f64 {
        f64::from(self.phases.iter().map(|phase| phase.rows).sum::<f32>())
    }

    /// Number of rows that were placed, and of their windows.
    pub fn placed(&self) -> (f64, f64) {
        (self.placed.iter().map(|placed| f64::from(placed.rows)).sum(), to_f64(self.rows.len()))
    }

    /// Variance of the median window's samples about the mean near the edge, in squared fractions
    /// of the step.
    pub fn row_variance(&self) -> f64 {
        f64::from(self.median_misfit) / to_f64(2 * CORE_HALF)
    }

    /// Windows whose misfit is at most `many` times the median, each with the mean that it is
    /// compared with.
    pub fn typical_rows(&self, many: f32) -> impl Iterator<Item = (&[f32], &[f32])> {
        let rows = self.rows.iter().zip(&self.placed).zip(&self.row_misfits);
        rows.filter(move |(_, unlike)| **unlike <= many * self.median_misfit).map(
            |((row, placed), _)| (row.as_slice(), self.phases[placed.phase].samples.as_slice()),
        )
    }

    /// The means of the phases that have rows.
    #[inline(always)]
    fn means(&self) -> impl Iterator<Item = &PhaseMean> {
        self.phases.iter().filter(|phase| phase.rows > 0.0)
    }
}

/// Mean of the rows of a phase.
#[derive(Debug, Clone, Copy)]
struct PhaseMean {
    samples: [f32; SPAN],
    /// Mean distance of the path from the middle sample \[px\].
    shift: f32,
    /// Number of rows.
    rows: f32,
}

impl PhaseMean {
    const EMPTY: Self = Self { samples: [0.0; SPAN], shift: 0.0, rows: 0.0 };

    /// Each sample's distance from the path and its value, from a distance to
    /// another \[px\].
    #[inline(always)]
    fn samples(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        samples(&self.samples, self.shift.into(), (from, to))
    }
}

/// Each sample's distance from the path and its value, from a distance to another \[px\]; `shift`
/// is the distance of the path from the middle sample.
#[inline(always)]
fn samples(
    values: &[f32; SPAN],
    shift: f64,
    (from, to): (f64, f64),
) -> impl Iterator<Item = (f64, f64)> {
    let first = index((from + shift).ceil());
    let last = index((to + shift).floor() + 1.0).max(first);
    let samples = (first..last).zip(&values[first..last]);
    samples.map(move |(k, value)| (place(k) - shift, f64::from(*value)))
}

/// Rank of the value that a fraction of all values do not exceed.
fn rank_of(count: usize, fraction: f32) -> usize {
    to_count((fraction * to_f32(count)).into()).min(count.saturating_sub(1))
}

fn place(index: usize) -> f64 {
    to_f64(index) - to_f64(HALF_SPAN)
}

/// Number of the sample at a whole distance, within the window.
fn index(distance: f64) -> usize {
    to_count((distance + to_f64(HALF_SPAN)).clamp(0.0, to_f64(SPAN)))
}

#[cfg(test)]
mod tests;
