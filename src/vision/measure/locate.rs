//! The bead's two edges, from their contours to sub-pixel positions. Each edge is located by the
//! model that fits it.

use crate::vision::buffer::refill;
use std::ops::Range;

use super::checks::are_not_steps;
use super::search::ContourPair;
use super::work::{EdgeModel, MIN_LINE_FRACTION, MIN_OUTLIER_PX, MeasureState};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{narrow_to_f32, to_count};
use crate::numeric::rank;
use crate::vision::blur_estimate::BlurEstimate;
use crate::vision::motion::BlurShapes;
use crate::vision::overlay::StepFit;
use crate::vision::pixel_noise::PixelNoise;
use crate::vision::reject::{Checked, Reject};
use crate::vision::strip::{GaugeRows, GreyPixel};
use crate::vision::trace::{EdgeTracer, TraceInput};
use crate::vision::{light, occluded, saturated};

/// Smallest deviation that makes a caliper line an outlier where each is fitted alone \[px\].
const MIN_LINE_OUTLIER_PX: f64 = 0.75;
/// Ground on either side of the bead whose pixels count for the noise too \[px\].
const NOISE_MARGIN_PX: f32 = 12.0;
/// Distance of a located edge from the median of its contour from which on it is another edge
/// \[px\]: grains of 12 px beside an edge move its contour by less.
const OTHER_EDGE_PX: f32 = 14.0;
/// Relative difference between the blurs of the two edges, as a standard deviation.
const BLUR_DIFFERENCE: f64 = 0.04;

impl MeasureState {
    #[inline(always)]
    pub fn trace<T: GreyPixel>(&mut self, strip: &GaugeRows<'_, T>, pair: ContourPair) -> Checked {
        let [lefts, rights] = self.search.sides(pair.bright).of(&pair.pair).map(|edge| &edge.at);
        let about = columns_about(lefts, rights, strip.across);
        self.rows.noise = PixelNoise::read(strip, about);
        self.width_px = narrow_distance(lefts, rights, &mut self.scratch.narrow);
        let scene = TraceInput {
            strip,
            table: self.blur_shapes.lens(),
            bands: &self.rows.bands,
            lines: &self.rows.lines,
            noise: self.rows.noise.grey,
            width_px: self.width_px,
            bead_after: true,
        };
        let right_scene = TraceInput { bead_after: false, ..scene };
        let scenes = [scene, right_scene];
        let mut seen = [None; 2];
        (self.both.is_lost, self.both.model, self.both.blur_shape) = (false, EdgeModel::Steps, 0);
        // A loop, so that what is inlined into it is compiled once for both.
        let sides = [(&mut self.left, lefts), (&mut self.right, rights)];
        for (((tracer, rough), scene), seen) in sides.into_iter().zip(&scenes).zip(&mut seen) {
            *seen = tracer.fit_first(scene, rough.iter().copied());
        }
        let failed = Reject::NoPair { got: 0.0, need: MIN_LINE_FRACTION };
        if let [Some(_), Some(_)] = seen {
            let cut_off = [self.left.clipped_sides(&scene), self.right.clipped_sides(&right_scene)];
            if cut_off != [[false; 2]; 2] {
                (self.both.min_outlier_px, self.both.model) = (MIN_OUTLIER_PX, EdgeModel::Clipped);
                let tracers = [&mut self.left, &mut self.right];
                let bead = saturated::SaturatedBead { scenes, lefts, rights };
                self.rows.noise.grey = bead.trace(tracers, cut_off)?;
                return Ok(());
            }
            if let Some((shape, looks)) =
                choose_blur(&self.blur_shapes, [&self.left, &self.right], &scenes)
            {
                self.both.blur_shape = shape;
                seen = looks.map(|look| Some(look.blur()));
                (self.left.step_fit, self.right.step_fit) = (Some(looks[0]), Some(looks[1]));
            }
        }
        let table = self.blur_shapes.table(self.both.blur_shape);
        let scenes = scenes.map(|scene| TraceInput { table, ..scene });
        if let Some(blur) = common_blur(seen) {
            for tracer in [&mut self.left, &mut self.right] {
                tracer.take_shape(table, blur);
            }
            if let (Some(left), Some(right)) = (self.left.surroundings(), self.right.surroundings())
            {
                light::apply_falloff([left, right], self.width_px.into());
            }
            for (tracer, scene) in [&mut self.left, &mut self.right].into_iter().zip(&scenes) {
                tracer.trace(scene, blur);
            }
            if self.left.is_lost() || self.right.is_lost() {
                let candidates = &self.search.candidates;
                let bead = occluded::OccludedBead { scenes, candidates, bright: pair.bright };
                let tracers = [&mut self.left, &mut self.right];
                bead.locate_from_clear_rows(tracers, blur, &mut self.scratch.parallel);
                let contours = [(&self.left, lefts.as_slice()), (&self.right, rights)];
                if let Some([one, other]) = widths_apart(contours, &mut self.scratch.narrow) {
                    return Err(self.ambiguous(one, other));
                }
            }
            self.both.is_lost = self.one_is_lost();
            let found = self.left.is_located() && self.right.is_located();
            let misfits = [&self.left, &self.right].map(EdgeTracer::misfit_of_a_row);
            if found && !self.both.is_lost && !are_not_steps(misfits) {
                self.both.min_outlier_px = MIN_OUTLIER_PX;
                return Ok(());
            }
        }
        (self.both.min_outlier_px, self.both.model) = (MIN_LINE_OUTLIER_PX, EdgeModel::LineByLine);
        // An edge that is no blurred step does not show the shape of its blur.
        let left = self.left.refine(&scene);
        let right = self.right.refine(&right_scene);
        if left && right { Ok(()) } else { Err(failed) }
    }
}

/// Fits both edges with the shape of blur that fits best: its number, and the fits with it; `None`
/// where a lens's blur is enough.
#[inline(always)]
fn choose_blur<T: GreyPixel>(
    shapes: &BlurShapes,
    [left, right]: [&EdgeTracer; 2],
    scenes: &[TraceInput<'_, T>; 2],
) -> Option<(usize, [StepFit; 2])> {
    let again = |table: &StepTable, before: Option<[&StepFit; 2]>| {
        [(left, 0), (right, 1)]
            .map(|(edge, k)| edge.refit(table, &scenes[k], before.map(|looks| looks[k])))
    };
    shapes.choose([left.step_fit.as_ref()?, right.step_fit.as_ref()?], again)
}

/// Common blur of two edges seen through one lens, and the standard deviation of one edge's blur
/// about it; `None` where neither has a blur.
fn common_blur(seen: [Option<BlurEstimate>; 2]) -> Option<BlurEstimate> {
    let weight =
        |BlurEstimate { px, sd_px }| 1.0 / (sd_px * sd_px + (BLUR_DIFFERENCE * px).powi(2));
    let (mut sum, mut weights) = (0.0, 0.0);
    for seen in seen.into_iter().flatten() {
        sum += weight(seen) * seen.px;
        weights += weight(seen);
    }
    let blur = sum / weights;
    (weights > 0.0).then_some(BlurEstimate { px: blur, sd_px: BLUR_DIFFERENCE * blur })
}

/// Width between the located edges, and that between their contours \[px\], where an edge lies away
/// from its contour: a seam or a rib may have been taken for the edge. `None` where both run along
/// their contours.
fn widths_apart(
    sides: [(&EdgeTracer, &[Option<f32>]); 2],
    scratch: &mut Vec<f32>,
) -> Option<[f32; 2]> {
    let [left, right] = sides.map(|(tracer, contour)| {
        refill(scratch, contour.iter().flatten().copied());
        let contour = rank::median(scratch).unwrap_or(f32::NAN);
        let found = narrow_to_f32(tracer.middle());
        let is_elsewhere = tracer.is_occluded() && (found - contour).abs() > OTHER_EDGE_PX;
        [if is_elsewhere { found } else { contour }, contour]
    });
    let [located, contours] = [0, 1].map(|of| right[of] - left[of]);
    (located != contours).then_some([located, contours])
}

/// Columns of the bead and a little beside it.
fn columns_about(left: &[Option<f32>], right: &[Option<f32>], across: usize) -> Range<usize> {
    let low = left.iter().flatten().fold(f32::INFINITY, |low, &at| low.min(at));
    let high = right.iter().flatten().fold(0.0, |high: f32, &at| high.max(at));
    let [from, to] = [low - NOISE_MARGIN_PX, high + NOISE_MARGIN_PX].map(|at| to_count(at.into()));
    from.min(across - 1)..to.clamp(from + 1, across)
}

/// Distance between two contours that a tenth of the bands do not reach \[px\]; 0 without bands.
fn narrow_distance(left: &[Option<f32>], right: &[Option<f32>], scratch: &mut Vec<f32>) -> f32 {
    refill(scratch, left.iter().zip(right).filter_map(|(left, right)| Some((*right)? - (*left)?)));
    let rank = scratch.len() / 10;
    rank::at(scratch, rank).unwrap_or(0.0)
}
