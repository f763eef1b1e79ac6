//! Edges that are no blurred step between plain surroundings, as on a shiny or strongly shaded
//! strand. Every caliper line is fitted for itself in a short window, with free shading of the
//! bead and the levels of its neighbours as prior.

use super::blur::BinnedProfile;
use super::fit::{EdgeFit, FittedEdge, Prior, ProfileWindow};
use super::located::CaliperEdge;
use super::row_range::RowRange;
use super::strip::{GaugeRows, GreyPixel};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{to_count, to_f32, to_f64};
use crate::numeric::rank;
use crate::vision::buffer::{refill, reset};

/// Neighbours on either side that show the local slope and levels.
const NEIGHBOURS: usize = 4;
/// Longest half window \[px\].
const MAX_HALF: usize = 30;
/// Shortest half window \[px\]: the levels on either side need some pixels.
const MIN_HALF: usize = 4;

/// Input of the refinement.
#[derive(Debug, Clone, Copy)]
pub struct RefinerInput<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a GaugeRows<'a, T>,
    /// The blurred step.
    pub table: &'a StepTable,
    /// Rows of its caliper lines.
    pub lines: &'a [RowRange],
    /// Room between the two edges of the bead \[px\], typical.
    pub width_px: f64,
}

/// Level before the edge, height of the step, shading of the bead: what
/// neighbouring calipers share.
fn levels(fit: &EdgeFit) -> [f64; 3] {
    [fit.edge.ground, fit.edge.height, fit.edge.shading]
}

/// Refines one edge of the bead; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct LineRefiner {
    rough: Vec<Option<f64>>,
    samples: Vec<f32>,
    firsts: Vec<f64>,
    half: usize,
    bead_after: bool,
    profile: BinnedProfile,
    first_fits: Vec<Option<EdgeFit>>,
    scratch: Vec<f64>,
    /// Blur of the edge \[px\].
    pub blur_px: f64,
    /// Noise of a pixel \[grey levels\].
    pub noise_grey: f64,
}

impl LineRefiner {
    /// Locates the edge from rough positions, one a band; `bead_after` is the
    /// bead's side. Returns whether any edge could be located.
    pub fn refine<T: GreyPixel>(
        &mut self,
        task: &RefinerInput<'_, T>,
        bead_after: bool,
        edges: &mut [Option<CaliperEdge>],
        rough: impl Iterator<Item = f64>,
    ) -> bool {
        self.bead_after = bead_after;
        refill(&mut self.rough, rough.map(Some));
        self.half = half_window(3.0, task.width_px).max(8.min(widest_half(task.width_px)));
        self.read(task);
        let Some(blur) = self.fit_blur(task.table) else { return false };
        let half = half_window(blur, task.width_px);
        if half != self.half {
            self.half = half;
            self.read(task);
        }
        self.blur_px = blur;
        self.locate_alone(task);
        if !self.first_fits.iter().any(Option::is_some) {
            return false;
        }
        self.sharpen_blur(task.table);
        self.locate_with_neighbours(task, edges);
        true
    }

    /// Reads the window of every band, along the local slope of the edge.
    fn read<T: GreyPixel>(&mut self, task: &RefinerInput<'_, T>) {
        let length = 2 * self.half + 1;
        reset(&mut self.samples, length * self.rough.len(), 0.0);
        reset(&mut self.firsts, self.rough.len(), f64::NAN);
        for band in 0..self.rough.len() {
            let Some(at) = self.rough[band] else { continue };
            let slope = self.slope(band, task.lines);
            let window = &mut self.samples[band * length..(band + 1) * length];
            if let Some(first) = read_window(task, band, (at, slope), window) {
                self.firsts[band] = first;
            }
        }
    }

    /// Slope of the rough edge about a band \[px across per px along\].
    fn slope(&self, band: usize, lines: &[RowRange]) -> f64 {
        let from = band.saturating_sub(NEIGHBOURS);
        let to = (band + NEIGHBOURS + 1).min(self.rough.len());
        let near = || (from..to).filter_map(|k| self.rough[k].map(|at| (lines[k].middle(), at)));
        let (mut n, mut sum_v, mut sum_u) = (0.0, 0.0, 0.0);
        for (v, u) in near() {
            n += 1.0;
            sum_v += v;
            sum_u += u;
        }
        let (mean_v, mean_u) = (sum_v / n, sum_u / n);
        let (mut over, mut under) = (0.0, 0.0);
        for (v, u) in near() {
            over += (v - mean_v) * (u - mean_u);
            under += (v - mean_v) * (v - mean_v);
        }
        if under > 0.0 { (over / under).clamp(-2.0, 2.0) } else { 0.0 }
    }

    fn window<'a>(
        &'a self,
        table: &'a StepTable,
        band: usize,
        noise: f64,
    ) -> Option<ProfileWindow<'a>> {
        let (first, blur, bead_after) = (self.firsts[band], self.blur_px, self.bead_after);
        let length = 2 * self.half + 1;
        let samples = &self.samples[band * length..(band + 1) * length];
        (!first.is_nan()).then_some(ProfileWindow {
            table,
            first,
            samples,
            noise,
            blur,
            bead_after,
        })
    }

    fn fit_blur(&mut self, table: &StepTable) -> Option<f64> {
        self.profile = BinnedProfile::default();
        for band in 0..self.rough.len() {
            let Some(at) = self.rough[band] else { continue };
            self.add_to_profile(band, at);
        }
        self.profile.fit(table, self.bead_after)
    }

    fn add_to_profile(&mut self, band: usize, at: f64) {
        let first = self.firsts[band];
        if first.is_nan() {
            return;
        }
        let length = 2 * self.half + 1;
        let window = &self.samples[band * length..(band + 1) * length];
        for (position, &sample) in (0u32..).zip(window) {
            self.profile.add(first + f64::from(position) - at, f64::from(sample));
        }
    }

    /// First pass: every caliper for itself, which also shows the noise.
    fn locate_alone<T: GreyPixel>(&mut self, task: &RefinerInput<'_, T>) {
        self.first_fits.clear();
        let (mut residual, mut freedom) = (0.0, 0.0);
        for band in 0..self.rough.len() {
            let fit = self.rough[band].and_then(|at| {
                let window = self.window(task.table, band, 1.0)?;
                window.fit(start_levels(&window, at), None)
            });
            if let Some(fit) = fit {
                let RowRange { first: from, end: to } = task.lines[band];
                residual += fit.residual * to_f64(to - from);
                freedom += to_f64(2 * self.half + 1) - 4.0;
            }
            self.first_fits.push(fit);
        }
        self.noise_grey = if freedom > 0.0 { (residual / freedom).sqrt().max(0.05) } else { 0.05 };
    }

    /// Fits the blur again at the located positions: approximate ones smear the overlay.
    fn sharpen_blur(&mut self, table: &StepTable) {
        self.profile = BinnedProfile::default();
        for band in 0..self.rough.len() {
            if let Some(fit) = self.first_fits[band] {
                self.add_to_profile(band, fit.edge.at);
            }
        }
        if let Some(blur) = self.profile.fit(table, self.bead_after) {
            self.blur_px = blur;
        }
    }

    /// Second pass: with the levels of the neighbours as prior.
    fn locate_with_neighbours<T: GreyPixel>(
        &mut self,
        task: &RefinerInput<'_, T>,
        edges: &mut [Option<CaliperEdge>],
    ) {
        let excess = [0, 1, 2].map(|which| self.excess_variance(which));
        for (band, edge) in edges.iter_mut().enumerate() {
            *edge = None;
            let Some(alone) = self.first_fits[band] else { continue };
            let RowRange { first: from, end: to } = task.lines[band];
            let noise = self.noise_grey * self.noise_grey / to_f64(to - from);
            let prior = Prior {
                mean: [0, 1, 2].map(|which| self.mean_near(band, which)),
                variance: excess.map(|variance| variance.max(1e-3 * noise)),
            };
            let Some(window) = self.window(task.table, band, noise) else { continue };
            let [ground, height, shading] = prior.mean;
            let start = FittedEdge { at: alone.edge.at, ground, height, shading };
            *edge = window.fit(start, Some(&prior)).map(|fit| CaliperEdge {
                at: fit.edge.at,
                // Levels that neighbours share are wrong for all of them together, so that the mean
                // of many edges is no more certain than if each had its own.
                variance: alone.variance[0] * noise,
                height: fit.edge.height,
                row_fraction: 1.0,
            });
        }
    }

    fn mean_near(&self, band: usize, which: usize) -> f64 {
        let from = band.saturating_sub(NEIGHBOURS);
        let to = (band + NEIGHBOURS + 1).min(self.first_fits.len());
        let (mut sum, mut n) = (0.0, 0.0);
        for fit in self.first_fits[from..to].iter().flatten() {
            sum += levels(fit)[which];
            n += 1.0;
        }
        sum / f64::max(n, 1.0)
    }

    /// How much a level differs from its neighbours beyond what noise
    /// explains: the variance that the prior must allow it. Robust, from the
    /// median of the squares.
    fn excess_variance(&mut self, which: usize) -> f64 {
        let mut scatter = std::mem::take(&mut self.scratch);
        scatter.clear();
        let (mut explained, mut n) = (0.0, 0.0);
        for band in 0..self.first_fits.len() {
            if let Some(fit) = &self.first_fits[band] {
                let off = levels(fit)[which] - self.mean_near(band, which);
                scatter.push(off * off);
                explained += fit.variance[which + 1] * self.noise_grey * self.noise_grey;
                n += 1.0;
            }
        }
        let total = rank::median(&mut scatter).unwrap_or(0.0) / rank::MEDIAN_OF_SQUARED_NORMAL;
        self.scratch = scatter;
        (total - explained / f64::max(n, 1.0)).max(0.0)
    }
}

/// Reads a band's window: the rows are shifted by whole pixels along the
/// slope, and what rounding leaves is moved into the position of the first
/// sample, which is returned. `None` where the window leaves the gauge.
fn read_window<T: GreyPixel>(
    task: &RefinerInput<'_, T>,
    band: usize,
    (at, slope): (f64, f64),
    window: &mut [f32],
) -> Option<f64> {
    let RowRange { first: from, end: to } = task.lines[band];
    let middle = task.lines[band].middle();
    let half = to_f64(window.len() / 2);
    let mut left_over = 0.0;
    for v in from..to {
        let drift = slope * (to_f64(v) - middle);
        let first = at.round() - half + drift.round();
        left_over += drift.round() - drift;
        if first < 0.0 || first + to_f64(window.len()) > to_f64(task.strip.across) {
            return None;
        }
        for (sum, pixel) in window.iter_mut().zip(&task.strip.row(v)[to_count(first)..]) {
            *sum += T::sum_to_f32(pixel.add_to(T::Sum::default()));
        }
    }
    let scale = task.strip.scale / to_f32(to - from);
    for sum in window {
        *sum *= scale;
    }
    Some(at.round() - half + left_over / to_f64(to - from))
}

/// Levels to start from: the window's two ends.
fn start_levels(window: &ProfileWindow<'_>, at: f64) -> FittedEdge {
    let samples = window.samples;
    let end = samples.len().min(3);
    let mean = |part: &[f32]| f64::from(part.iter().sum::<f32>()) / to_f64(part.len());
    let ground = mean(&samples[..end]);
    let height = mean(&samples[samples.len() - end..]) - ground;
    FittedEdge { at, ground, height, shading: 0.0 }
}

/// Half window for a blur \[px\]: to where the step is over, but not across
/// the bead's other edge.
fn half_window(blur_px: f64, width_px: f64) -> usize {
    to_count((4.0 * blur_px + 2.0).ceil()).clamp(MIN_HALF, widest_half(width_px))
}

fn widest_half(width_px: f64) -> usize {
    to_count(0.45 * width_px).clamp(MIN_HALF, MAX_HALF)
}
