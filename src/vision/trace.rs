//! One edge of the bead, from rough positions to sub-pixel ones with their variances. Its profile
//! is read from superimposed rows, every row is compared with it, and the rows of a band are
//! solved for position and levels together.

mod band_levels;
mod band_sums;
mod bands;
mod clipped;
mod group;
mod occlusion;
mod parts;
mod rows;
mod winding;

use super::blur_estimate::BlurEstimate;
use super::clipped_step::ClippedEdge;
use super::edge_windows::{EdgeWindows, Grouping};
use super::light::Surroundings;
use super::located::{self, CaliperEdge};
use super::overlay::{BlurredStep, Clearance, EdgeSkew, HALF_SPAN, Overlay, StepFit, StepShape};
use super::path::{self, EdgeCorrection, EdgeTrajectory};
use super::pool::Bands;
use super::refine::{LineRefiner, RefinerInput};
use super::rough::RoughFit;
use super::row_range::RowRange;
use super::strip::{GaugeRows, GreyPixel};
use super::texture::SurfaceTexture;
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{narrow_to_f32, to_f32, to_f64};
use crate::vision::buffer::{refill, reset};
use parts::{
    BandValues, EdgeState, EdgeUncertainty, Occlusion, RowFit, TexturedFit, TraceScratch,
    WindingState,
};

/// Passes over the rows at most; a second one is made only where the first
/// path was off by a good part of the blur.
const MAX_PASSES: usize = 3;
/// Distance of the path from the edge from which on pixels are read again \[px\].
const MAX_PATH_OFFSET_PX: f64 = 4.0;
/// Fraction of the blur by which a path may be off.
const MAX_PATH_ERROR_BLURS: f64 = 0.2;
/// Rows that are taken together at most.
const MAX_GROUP_ROWS: usize = 8;
/// Misfit up to which an edge is certainly a blurred step.
const MAX_STEP_MISFIT: f64 = 1.5;
/// Fraction of rows that do not fit above which an edge is occluded in part.
const MAX_UNFIT_FRACTION: f64 = 0.03;
/// Misfit of the clear rows from which on the edge is not occluded, but no blurred step at all.
const MAX_CLEAR_MISFIT: f64 = 1.25;

/// Input for one edge.
#[derive(Debug, Clone, Copy)]
pub struct TraceInput<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a GaugeRows<'a, T>,
    /// The blurred step.
    pub table: &'a StepTable,
    /// The gauge's bands.
    pub bands: &'a Bands,
    /// Rows of its caliper lines.
    pub lines: &'a [RowRange],
    /// Noise of a pixel \[grey levels\].
    pub noise: f32,
    /// Room between the two edges of the bead \[px\], at its narrowest.
    pub width_px: f32,
    /// Whether the bead lies after the edge.
    pub bead_after: bool,
}

/// Traces one edge of the bead; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct EdgeTracer {
    values: BandValues,
    course: EdgeTrajectory,
    /// Trajectory along the bands with levels that were picked again.
    levels: EdgeTrajectory,
    winding: WindingState,
    sheet: EdgeWindows,
    overlay: Overlay,
    /// The fit of a blurred step to the mean profile.
    pub step_fit: Option<StepFit>,
    /// Shape of the edge, and its distance from the course when it was read \[px\].
    shape: Option<StepShape>,
    aside_px: f64,
    textured: TexturedFit,
    row_fit: RowFit,
    occlusion: Occlusion,
    refiner: LineRefiner,
    cut_off: ClippedEdge,
    scratch: TraceScratch,
    /// Positions in the last frame, one a caliper line.
    pub edges: Vec<Option<CaliperEdge>>,
    state: EdgeState,
    /// Fraction of the rows that certainly show something other than the edge.
    pub unfit_fraction: f64,
    /// Median residual of a row from the step that it is compared with, in standard deviations of
    /// its noise; about 1 for a blurred step.
    pub misfit: f64,
    /// Largest number of rows that were compared together.
    max_group_rows: f64,
    /// Blur of the edge \[px\].
    pub blur_px: f64,
    /// Whether ground lies beside it, and not a groove.
    pub is_on_ground: bool,
    /// Uncertainty of its positions beyond the variance of each.
    pub uncertainty: EdgeUncertainty,
}

impl EdgeTracer {
    /// Takes over positions that were found without a model of the flank.
    pub fn take_rough(&mut self, positions: &[Option<CaliperEdge>], fit: &RoughFit) {
        refill(&mut self.edges, positions.iter().copied());
        self.blur_px = fit.blur_px;
        let uncertainty = &mut self.uncertainty;
        (uncertainty.common_variance, uncertainty.mean_variance) = (0.0, Some(fit.variance));
        (uncertainty.along_px, uncertainty.lines_fraction) = (fit.along_px, fit.lines_fraction);
        self.misfit = f64::INFINITY;
        self.state = EdgeState::Clear;
        self.is_on_ground = fit.is_on_ground && !fit.is_groove;
    }

    /// Fraction of all rows that the edges come from.
    pub fn used_fraction(&self) -> f64 {
        let used: f64 = self.edges.iter().flatten().map(|edge| edge.row_fraction).sum();
        used / to_f64(self.edges.len().max(1))
    }

    /// Mean of the edges' positions across the bead \[px\].
    pub fn middle(&self) -> f64 {
        located::mean_position(&self.edges)
    }

    /// Whether the edge's positions are known.
    pub fn is_located(&self) -> bool {
        self.state != EdgeState::NotFound
    }

    /// Whether the edge was found to be occluded in part, and is located from its clear rows alone.
    pub fn is_occluded(&self) -> bool {
        self.state == EdgeState::Occluded
    }

    /// Whether the edge was not found, or seems to be occluded and no clear rows were found.
    pub fn is_lost(&self) -> bool {
        matches!(self.state, EdgeState::NotFound | EdgeState::Unresolved)
    }

    /// The misfit as if rows had been compared one by one: the misfit of an edge that is no blurred
    /// step grows with the number of rows that are averaged.
    pub fn misfit_of_a_row(&self) -> f64 {
        let beyond = (self.misfit * self.misfit - 1.0) / self.max_group_rows.max(1.0);
        (1.0 + beyond.max(0.0)).sqrt()
    }

    /// Whether nothing occludes the edge, or its clear rows are known, and it is a blurred step.
    pub fn is_clear(&self) -> bool {
        matches!(self.state, EdgeState::Clear | EdgeState::Occluded)
            && self.misfit < MAX_STEP_MISFIT
    }

    /// Where the edge is expected at a position along it \[px\].
    pub fn expected_at(&self, v: f64) -> f32 {
        self.course.at(narrow_to_f32(v))[0]
    }

    /// First fit of the edge along rough positions, one a band. Returns its blur; `None` where
    /// there is no edge.
    #[inline(always)]
    pub fn fit_first<T: GreyPixel>(
        &mut self,
        scene: &TraceInput<'_, T>,
        rough: impl Iterator<Item = Option<f32>>,
    ) -> Option<BlurEstimate> {
        self.edges.clear();
        let positions = &mut self.uncertainty;
        (positions.mean_variance, positions.along_px, positions.lines_fraction) = (None, 0.0, 1.0);
        self.is_on_ground = true;
        self.step_fit = None;
        self.values.path.clear();
        self.state = EdgeState::NotFound;
        self.misfit = f64::INFINITY;
        (self.occlusion.sort_rows, self.unfit_fraction) = (false, 0.0);
        (self.winding.is_followed, self.winding.excess) = (false, 0.0);
        self.occlusion.clear.clear();
        refill(&mut self.values.picked, rough.map(|at| at.unwrap_or(f32::NAN)));
        if !self.take_picked(scene) {
            return None;
        }
        self.follow_windings(scene);
        self.lay_over(scene)
    }

    /// Superimposes the rows along the course and fits a step to them; returns its blur.
    #[inline(always)]
    fn lay_over<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> Option<BlurEstimate> {
        self.read(scene);
        self.overlay.lay(&self.sheet);
        let noise = f64::from(scene.noise) / f64::from(typical(&self.values.step).abs());
        self.step_fit = self.overlay.with(scene.table).first_fit(noise, self.room(scene));
        self.look_for_texture(scene, noise);
        self.step_fit.as_ref().map(StepFit::blur)
    }

    /// Whether the edge was located with weights for the texture beside it.
    pub fn is_textured(&self) -> bool {
        self.textured.texture.is_some()
    }

    /// Whether a narrow groove may lie beside the edge, after it or before it. `noise` is the
    /// standard deviation of a pixel as fractions of the step.
    pub fn is_beside_groove(&self, after: bool, noise: f64) -> bool {
        self.misfit.is_finite() && self.overlay.rises_beside(after, noise)
    }

    /// Skew of the edge's flank; `None` where it is not located as a blurred step that nothing
    /// occludes.
    pub fn skew(&self, table: &StepTable) -> Option<EdgeSkew> {
        let is_step = self.state == EdgeState::Clear && self.misfit.is_finite();
        self.overlay.with(table).skew(self.step_fit.as_ref().filter(|_| is_step)?)
    }

    /// Fits the same rows with another shape of the blur, starting from a fit to them or from none.
    /// The noise by a texture that was found stays.
    #[inline(always)]
    pub fn refit<T: GreyPixel>(
        &self,
        table: &StepTable,
        scene: &TraceInput<'_, T>,
        before: Option<&StepFit>,
    ) -> Option<StepFit> {
        let fitter = self.overlay.with(table);
        if let Some(before) = before {
            return fitter.refit(before);
        }
        fitter.first_fit(self.step_fit?.pixel_noise, self.room(scene))
    }

    /// Draws the path through the picked positions without outliers, with the levels beside it.
    /// Returns whether there is any.
    #[inline(always)]
    fn take_picked<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        let rough = self.values.picked.iter().map(|at| at.is_finite().then_some(*at));
        if !path::fill(rough, &mut self.scratch.rough) {
            return false;
        }
        path::remove_outliers(&mut self.scratch.rough, &mut self.scratch.sorted);
        let rest = self.scratch.rough.iter().map(|at| at.is_finite().then_some(*at));
        if !path::fill(rest, &mut self.values.path) {
            return false;
        }
        path::median_of_three(&mut self.values.path);
        path::smooth_bent(&mut self.values.path, &mut self.scratch.rough);
        std::mem::swap(&mut self.scratch.rough, &mut self.values.path);
        self.pick_levels(scene);
        self.course.draw(scene.bands, &self.values.path, &self.values.before, &self.values.step);
        true
    }

    /// Reads the shape of the edge from its first fit, with a prior of its blur.
    #[inline(always)]
    pub fn take_shape(&mut self, table: &StepTable, blur: BlurEstimate) {
        self.shape = None;
        let Some(seen) = &self.step_fit else { return };
        let Some(shape) = self.overlay.with(table).shape(seen, blur) else { return };
        self.aside_px = shape.step.at;
        self.shape = Some(self.apply_shape(shape));
    }

    /// The levels that were picked before and after the edge: means over the bands
    /// \[grey levels\].
    pub fn levels(&self) -> [f64; 2] {
        let [before, step] =
            [&self.values.before, &self.values.step].map(|values| f64::from(typical(values)));
        [before, before + step]
    }

    /// Levels and shape of the edge whose shape was read; `None` where it was not.
    pub fn surroundings(&mut self) -> Option<Surroundings<'_>> {
        let [before, after] = self.levels();
        Some(Surroundings { shape: self.shape.as_mut()?, before, step: after - before })
    }

    /// Locates the edge whose shape was read; `blur` as in [`Self::take_shape`].
    #[inline(always)]
    pub fn trace<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, blur: BlurEstimate) {
        let found = self.trace_open(scene);
        let is_open = found && self.unfit_fraction <= MAX_UNFIT_FRACTION && !self.lost_rows(scene);
        if is_open || self.trace_winding(scene) {
            self.state = EdgeState::Clear;
        } else if self.locate_occluded(scene) {
            self.state = EdgeState::Occluded;
        } else {
            self.trace_again(scene, blur);
        }
    }

    /// Locates the edge as if nothing occluded it; `false` without a shape.
    #[inline(always)]
    fn trace_open<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        let Some(shape) = self.shape else { return false };
        if self.aside_px.abs() > MAX_PATH_OFFSET_PX {
            self.read(scene);
        }
        self.blur_px = shape.step.blur;
        self.uncertainty.common_variance = shape.variance;
        self.tabulate(scene.table, &shape);
        for _ in 0..MAX_PASSES {
            self.compare_rows(scene);
            self.sum_bands(scene);
            if self.locate(scene, shape.step.blur) {
                break;
            }
        }
        true
    }

    /// Traces once more as if nothing occluded the edge.
    #[cold]
    #[inline(never)]
    fn trace_again<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, blur: BlurEstimate) {
        self.occlusion.clear.clear();
        let picked = std::mem::take(&mut self.values.picked);
        let rough = picked.iter().map(|at| at.is_finite().then_some(*at));
        let seen = self.fit_first(scene, rough);
        self.values.picked = picked;
        self.take_shape(scene.table, blur);
        let found = seen.is_some() && self.trace_open(scene);
        self.state = if found { EdgeState::Unresolved } else { EdgeState::NotFound };
    }

    fn look_for_texture<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, noise: f64) {
        self.textured.texture = None;
        let Some(seen) = self.step_fit else { return };
        let Some(texture) = SurfaceTexture::read(&self.overlay, noise * noise, seen.beside())
        else {
            return;
        };
        let pitch = to_f64(scene.strip.along) / self.overlay.placed().0;
        self.step_fit = Some(seen.with_texture(texture.over_area(pitch).sqrt()));
        self.textured.texture = Some(texture.in_grey(typical(&self.values.step).into()));
    }

    /// Tabulates the template, with weights for the texture where there is one.
    fn tabulate(&mut self, table: &StepTable, shape: &StepShape) {
        self.textured.scatter = None;
        if let Some(texture) = &self.textured.texture {
            self.row_fit.template.tabulate(table, shape, true);
            self.textured.scatter =
                self.row_fit.template.whiten(&mut self.textured.whitener, texture);
        }
        if self.textured.scatter.is_none() {
            self.textured.texture = None;
            self.row_fit.template.tabulate(table, shape, false);
        }
    }

    /// Variance of a pixel in the mean of `rows` rows \[grey levels²\].
    fn pixel_variance<T: GreyPixel>(&self, scene: &TraceInput<'_, T>, rows: f32) -> f32 {
        let texture =
            self.textured.texture.map_or(0.0, |texture| narrow_to_f32(texture.of_window()));
        scene.noise * scene.noise / rows + texture
    }

    /// Locates the edge again, line by line, where it is not a blurred step. Returns whether there
    /// is one.
    #[cold]
    pub fn refine<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        let width_px = f64::from(scene.width_px);
        let task =
            RefinerInput { strip: scene.strip, table: scene.table, lines: scene.lines, width_px };
        // A blurred step that does not fit says nothing of the position either.
        if !self.take_picked(scene) {
            return false;
        }
        reset(&mut self.edges, scene.lines.len(), None);
        let course = &self.course;
        let rough =
            scene.lines.iter().map(|&line| f64::from(course.at(narrow_to_f32(line.middle()))[0]));
        let found = self.refiner.refine(&task, scene.bead_after, &mut self.edges, rough);
        self.blur_px = self.refiner.blur_px;
        self.uncertainty.common_variance = 0.0;
        self.misfit = f64::INFINITY;
        self.state = if found { EdgeState::Clear } else { EdgeState::NotFound };
        found
    }

    /// Distance on either side that certainly holds only this edge: up to the gauge's boundary and
    /// to the middle of the bead.
    fn room<T: GreyPixel>(&self, scene: &TraceInput<'_, T>) -> Clearance {
        let (low, high) =
            self.values.path.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &at| {
                (low.min(at), high.max(at))
            });
        let (across, reach) = (to_f32(scene.strip.across), to_f32(HALF_SPAN - 1));
        let inside = 0.5 * scene.width_px;
        let mut before = low.clamp(2.0, reach);
        let mut after = (across - 1.0 - high).clamp(2.0, reach);
        if scene.bead_after {
            after = after.min(inside);
        } else {
            before = before.min(inside);
        }
        Clearance { before: before.into(), after: after.into() }
    }

    /// Applies the shape of the overlay: the path is moved, and levels and shading become those at
    /// the edge.
    fn apply_shape(&mut self, shape: StepShape) -> StepShape {
        let BlurredStep { at, before, after, .. } = shape.step;
        let height = after - before;
        let flanks = shape.flanks.about(at, height);
        self.shift_course(at, before, after);
        StepShape {
            step: BlurredStep { at: 0.0, before: 0.0, after: 1.0, ..shape.step },
            shading: shape.shading.map(|shading| shading.of(height)),
            flanks,
            variance: shape.variance / (height * height),
            ..shape
        }
    }

    /// Shifts the expected edge and corrects its levels: those before and after the edge, as
    /// fractions of the step.
    fn shift_course(&mut self, aside: f64, before: f64, after: f64) {
        let [aside, before, after] = [aside, before, after].map(narrow_to_f32);
        self.course.correct(EdgeCorrection { aside, before, after });
        self.sheet.correct(EdgeCorrection { aside, before, after });
    }

    /// Reads the pixels along the path.
    #[inline(always)]
    fn read<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        let course = &self.course;
        let most = if self.occlusion.sort_rows { 1 } else { MAX_GROUP_ROWS };
        let grouping = Grouping { steepest: course.steepest(), max_rows: most };
        self.sheet.read(scene.strip, scene.lines, grouping, |v| course.at(v));
    }

    /// Draws the path again through the edges that were found.
    #[inline(always)]
    fn redraw<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        self.fill_from_edges(scene);
        path::median_of_three(&mut self.scratch.rough);
        if self.textured.texture.is_some() && !self.winding.is_followed {
            // The noise of positions by texture is not part of the path.
            path::smooth(&self.scratch.rough, &mut self.scratch.sorted);
            std::mem::swap(&mut self.scratch.rough, &mut self.scratch.sorted);
        }
        self.course.redraw(scene.lines, &self.scratch.rough, &mut self.scratch.course);
        self.read(scene);
    }
}

fn typical(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / to_f32(values.len().max(1))
}

#[cfg(test)]
mod tests;
