//! An edge one side of which passes the end of the camera's scale.

use super::{
    BlurredStep, Clearance, EdgeState, EdgeTracer, MAX_PASSES, MAX_PATH_ERROR_BLURS, TraceInput,
    typical,
};
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::numeric::rank;
use crate::vision::clipped_step::{ClippedLine, ClippedScene, ClippedStep, ClippedStepFit};
use crate::vision::located::CaliperEdge;
use crate::vision::path;
use crate::vision::strip::GreyPixel;

/// Upper end of the camera's scale \[grey levels of 256\]. By definition of the scale
/// (reference/conventions.md, Grey levels).
const SCALE_END_GREY: f64 = 255.0;
/// Distance from that end, in standard deviations, within which noise clips a level.
const NEAR_END_SIGMAS: f64 = 1.5;

/// Smoothings of a path at most, before an edge that is clipped is read along it.
const MAX_SMOOTHINGS: usize = 4;
/// Largest mean squared distance of a smoothed path from the positions, in variances of a position:
/// a path farther off no longer follows a rough edge.
const MAX_SMOOTHING_RATIO: f32 = 4.0;
/// Addition to that distance, as a fraction of the blur: it softens the flank too little to matter.
const MAX_SMOOTHING_BLURS: f32 = 0.1;

impl EdgeTracer {
    /// Whether the levels before and after the edge pass the end of the scale, or come so near that
    /// noise does.
    pub fn clipped_sides<T: GreyPixel>(&self, scene: &TraceInput<'_, T>) -> [bool; 2] {
        let Some(seen) = &self.step_fit else { return [false; 2] };
        let (before, step) = self.mean_levels();
        let limit = SCALE_END_GREY - NEAR_END_SIGMAS * f64::from(scene.noise);
        [seen.step.before, seen.step.after].map(|level| before + step * level > limit)
    }

    /// Mean level before the edge and mean step, as picked \[grey levels\].
    fn mean_levels(&self) -> (f64, f64) {
        (typical(&self.values.before).into(), typical(&self.values.step).into())
    }

    /// Locates an edge that is clipped at the end of the scale on one side. Returns the step that
    /// was fitted; `None` where none can be.
    pub fn trace_clipped<T: GreyPixel>(
        &mut self,
        scene: &TraceInput<'_, T>,
        hidden_after: bool,
    ) -> Option<ClippedStepFit> {
        let seen = self.step_fit?;
        let (before, height) = self.mean_levels();
        let Clearance { before: room_before, after: room_after } = seen.room;
        let (visible, room) = if hidden_after {
            (seen.step.before, [room_before, room_after])
        } else {
            (seen.step.after, [room_after, room_before])
        };
        let visible = before + height * visible;
        let mut task = ClippedScene {
            table: scene.table,
            clipped_after: hidden_after,
            noise: scene.noise.into(),
            white: SCALE_END_GREY,
            room,
            shading: 0.0,
        };
        let BlurredStep { at, blur, .. } = seen.step;
        let clipped = SCALE_END_GREY + 0.3 * (SCALE_END_GREY - visible);
        let start = ClippedStep { at, blur, visible, clipped };
        let rough = self.cut_off.fit(&task, &self.overlay, start, None)?;
        self.shift_course(rough.step.at, 0.0, 1.0);
        self.locate_clipped(scene, &task, &rough);
        // A path that jitters rounds off the corner at the end of the scale,
        // which looks like a higher level.
        self.straighten(scene, rough.step.blur);
        self.overlay.lay(&self.sheet);
        let start = ClippedStep { at: 0.0, ..rough.step };
        let first = self.cut_off.fit(&task, &self.overlay, start, None)?;
        // The visible surroundings, beside the step as it really is.
        let fraction = |level: f64| (level - before) / height;
        let (visible, hidden) = (fraction(first.step.visible), fraction(first.step.clipped));
        let (before, after) = if hidden_after { (visible, hidden) } else { (hidden, visible) };
        let step = BlurredStep { at: first.step.at, blur: first.step.blur, before, after };
        let (extent, (slope, level_variance)) =
            self.overlay.with(scene.table).side_slope(&seen, &step, !hidden_after);
        task.room[0] = extent;
        task.shading = slope * height;
        let blur = self.cut_off.expected_blur(&first);
        let found = self.cut_off.fit(&task, &self.overlay, first.step, blur)?;
        self.cut_off.keep_blur(&found);
        let per_level = std::f64::consts::PI * found.step.blur * found.step.blur;
        self.blur_px = found.step.blur;
        self.uncertainty.common_variance =
            found.variance + per_level * level_variance / (after - before).powi(2);
        self.shift_course(found.step.at, 0.0, 1.0);
        self.locate_clipped(scene, &task, &found);
        self.state = EdgeState::Clear;
        Some(found)
    }

    /// Draws a path through the edges that were found, as smooth as the edge is.
    fn straighten<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, blur: f64) {
        let positions = self.edges.iter().map(|edge| edge.map(|edge| narrow_to_f32(edge.at)));
        if !path::fill(positions, &mut self.scratch.rough) {
            return;
        }
        path::median_of_three(&mut self.scratch.rough);
        let found = || self.edges.iter().flatten();
        let sum: f64 = found().map(|edge| edge.variance).sum();
        let variance = sum / to_f64(found().count().max(1));
        let limit = MAX_SMOOTHING_RATIO * narrow_to_f32(variance)
            + (MAX_SMOOTHING_BLURS * narrow_to_f32(blur)).powi(2);
        self.occlusion.free.clear();
        self.occlusion.free.extend_from_slice(&self.scratch.rough);
        for _ in 0..MAX_SMOOTHINGS {
            path::smooth(&self.scratch.rough, &mut self.values.path);
            if self.smoothing_error() > limit {
                break;
            }
            std::mem::swap(&mut self.scratch.rough, &mut self.values.path);
        }
        self.course.redraw(scene.lines, &self.scratch.rough, &mut self.scratch.course);
        self.read(scene);
    }

    /// Mean squared distance of the path from the positions that it was drawn through, from the
    /// median, so that a few outliers do not count \[px²\].
    fn smoothing_error(&mut self) -> f32 {
        self.scratch.sorted.clear();
        let offs =
            self.values.path.iter().zip(&self.occlusion.free).map(|(path, at)| (path - at).powi(2));
        self.scratch.sorted.extend(offs);
        rank::median(&mut self.scratch.sorted).unwrap_or(0.0)
            / narrow_to_f32(rank::MEDIAN_OF_SQUARED_NORMAL)
    }

    fn locate_clipped<T: GreyPixel>(
        &mut self,
        scene: &TraceInput<'_, T>,
        task: &ClippedScene,
        found: &ClippedStepFit,
    ) {
        let height = found.step.clipped - found.step.visible;
        let height = if task.clipped_after { height } else { -height };
        for _ in 0..MAX_PASSES {
            let (edges, course) = (&mut self.edges, &self.course);
            let mut off: f64 = 0.0;
            edges.clear();
            let (sheet, lines) = (&self.sheet, scene.lines.len());
            self.misfit = self.cut_off.locate(task, sheet, lines, found, |line, located| {
                edges.push(located.map(|located| {
                    let [path, _, _] = course.at(narrow_to_f32(scene.lines[line].middle()));
                    let ClippedLine { moved, variance, row_fraction } = located;
                    off = off.max(moved.abs());
                    CaliperEdge { at: f64::from(path) + moved, variance, height, row_fraction }
                }));
            });
            if off <= MAX_PATH_ERROR_BLURS * found.step.blur {
                break;
            }
            self.redraw(scene);
        }
    }
}
