//! Comparison of every row with the edge: where the row shows it, and whether it shows anything
//! else.

use crate::vision::buffer::{refill, reset};
use std::ops::Range;

use nalgebra::Matrix3;

use super::band_sums::BandSums;
use super::group::RowGroup;
use super::{EdgeTracer, TraceInput};
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::numeric::rank;
use crate::vision::pixel_noise::NOISE_SIGMAS;
use crate::vision::strip::GreyPixel;
use crate::vision::template::{ExpectedStep, PlainSums, RowSums};

/// Misfit of a row, relative to the median, above which it does not count.
const MAX_MISFIT_RATIO: f32 = 2.5;
/// Difference between the rows of a band that is accepted beyond their noise \[px\].
const ROW_WAVINESS_PX: f32 = 0.5;
/// Outlying pixels that a row may have; more are a grain.
const MAX_WILD_PIXELS: f32 = 2.0;
/// Misfit of a row, relative to the limit of what may be noise, above which it is certainly
/// occluded.
const UNFIT_MISFIT_RATIO: f32 = 1.5;

impl EdgeTracer {
    /// Compares every window with the edge.
    #[inline(always)]
    pub fn compare_rows<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        let softness = 1.0 / narrow_to_f32(self.row_fit.template.products.slope_slope);
        self.row_fit.groups.clear();
        reset(&mut self.row_fit.plain, scene.lines.len(), PlainSums::default());
        // Noise of a pixel in the mean of a window's rows.
        let (mut rows, mut noise) = (0.0, 0.0);
        for (number, window) in self.sheet.windows.iter().enumerate() {
            let (band, weight) = (window.line, window.rows);
            if self.occlusion.clear.get(number) == Some(&false) {
                self.row_fit.groups.push(RowGroup::hidden(band, weight));
                continue;
            }
            let [path, _, step] = window.expected;
            if (weight - rows).abs() > 0.0 {
                (rows, noise) = (weight, self.pixel_variance(scene, weight).sqrt());
            }
            let expected = Self::expected(window.expected, noise);
            let pixels = (self.sheet.pixels(number).as_slice(), window.first);
            let sums =
                self.row_fit.template.compare(pixels, &expected, &mut self.row_fit.plain[band]);
            let sums = sums.unwrap_or(RowSums::OUT_OF_SIGHT);
            let ahead = expected.at - path;
            let moved = ahead - sums.slope * softness / step;
            let misfit = self.misfit(&sums, weight);
            self.row_fit.groups.push(RowGroup { band, weight, ahead, sums, moved, misfit });
        }
    }

    /// Expected step of a mean of rows, with tolerances; `noise` is that mean's standard deviation.
    #[inline(always)]
    pub fn expected(edge: [f32; 3], noise: f32) -> ExpectedStep {
        let (noise, step) = (NOISE_SIGMAS * noise, edge[2].abs());
        ExpectedStep::new(edge, [noise + 0.05 * step, noise + 0.15 * step])
    }

    /// Sum of the squared residuals, scaled to a single row, so that groups of all sizes compare
    /// \[grey levels²\].
    #[inline(always)]
    pub fn misfit(&self, sums: &RowSums, weight: f32) -> f32 {
        if sums.wild > MAX_WILD_PIXELS {
            return f32::INFINITY;
        }
        // Weights for a texture are not the slope of the step.
        if self.textured.texture.is_some() {
            return weight * sums.sum_of_squares;
        }
        let stiffness = narrow_to_f32(self.row_fit.template.products.slope_slope);
        weight * (sums.sum_of_squares - sums.slope * sums.slope / stiffness)
    }

    /// Sums up the rows of each band, without those on which a grain or a
    /// spark lies.
    #[inline(always)]
    pub fn sum_bands<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        let products = self.row_fit.template.products;
        refill(&mut self.scratch.sorted, self.row_fit.groups.iter().map(|group| group.misfit));
        if !self.occlusion.clear.is_empty() {
            // What is hidden shows nothing.
            self.scratch.sorted.retain(|misfit| misfit.is_finite());
        }
        let median = rank::median(&mut self.scratch.sorted).unwrap_or(f32::INFINITY);
        let pixels = narrow_to_f32(products.pixels);
        let together =
            self.row_fit.groups.iter().fold(1.0, |most: f32, group| most.max(group.weight));
        let variance = together * self.pixel_variance(scene, together);
        let alike =
            self.textured.texture.map_or(1.0, |texture| narrow_to_f32(texture.effective_pixels()));
        let limit = variance * (pixels + NOISE_SIGMAS * (2.0 * pixels * alike).sqrt());
        let limit = limit.max(MAX_MISFIT_RATIO * median);
        self.misfit = f64::from(median / (variance * pixels)).sqrt();
        // The variance of a window in texture includes the texture already.
        self.max_group_rows = if self.textured.texture.is_some() { 1.0 } else { together.into() };
        let covered = |group: &&RowGroup| {
            group.misfit > UNFIT_MISFIT_RATIO * limit || group.misfit == f32::INFINITY
        };
        let unfit = self.row_fit.groups.iter().filter(covered).count();
        self.unfit_fraction = to_f64(unfit) / to_f64(self.row_fit.groups.len().max(1));
        if self.occlusion.clear.is_empty() {
            self.spread_misfits(limit);
        }
        self.row_fit.solved.clear();
        let mut first = 0;
        for band in 0..scene.lines.len() {
            let mut end = first;
            while end < self.row_fit.groups.len() && self.row_fit.groups[end].band == band {
                end += 1;
            }
            let sums = self.sum_band(scene, (band, first..end), limit, &products.matrix());
            self.row_fit.solved.push(sums);
            first = end;
        }
    }

    /// Rows next to one that fits badly have its grain or spark on them too.
    fn spread_misfits(&mut self, limit: f32) {
        let mut before = 0.0;
        for k in 0..self.row_fit.groups.len() {
            let here = self.row_fit.groups[k].misfit;
            let after = self.row_fit.groups.get(k + 1).map_or(0.0, |group| group.misfit);
            let beside = f32::max(before, after);
            if beside > limit {
                self.row_fit.groups[k].misfit = here.max(beside);
            }
            before = here;
        }
    }

    #[inline(always)]
    fn sum_band<T: GreyPixel>(
        &mut self,
        scene: &TraceInput<'_, T>,
        (band, groups): (usize, Range<usize>),
        limit: f32,
        core: &Matrix3<f64>,
    ) -> BandSums {
        let stiffness = narrow_to_f32(core[(0, 0)]);
        let [_, _, step] = self.course.at(narrow_to_f32(scene.lines[band].middle()));
        let groups = &self.row_fit.groups[groups];
        self.scratch.sorted.clear();
        let fitting = groups.iter().filter(|group| group.misfit <= limit);
        self.scratch.sorted.extend(fitting.map(|group| group.moved));
        let typical = median_of_few(&mut self.scratch.sorted);
        let in_texture = self.textured.scatter.map(|scatter| narrow_to_f32(scatter.of_window));
        let square = scene.noise * scene.noise;
        let of_window = |rows: f32| in_texture.unwrap_or(square / (rows * stiffness)).sqrt();
        let mut sums = BandSums { step: step.into(), ..BandSums::default() };
        for group in groups {
            let far = NOISE_SIGMAS * of_window(group.weight) / step.abs() + ROW_WAVINESS_PX;
            let counts = group.misfit <= limit && (group.moved - typical).abs() <= far;
            sums.all_rows += f64::from(group.weight);
            if self.occlusion.clear.is_empty() || group.misfit < f32::INFINITY {
                sums.held_rows += f64::from(group.weight);
            }
            if counts {
                sums.add(group, core);
            }
        }
        // Plain pixels were summed once for each group.
        let weight = f64::from(groups.first().map_or(1.0, |group| group.weight));
        sums.plain = self.row_fit.plain[band].totals().map(|side| side.map(|sum| sum * weight));
        sums
    }
}

/// Median of a few values, which are sorted; 0 of none.
fn median_of_few(values: &mut [f32]) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
