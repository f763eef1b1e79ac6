//! An edge one side of which passes the end of the camera's scale.

use super::{Extent, Look, MAX_PASSES, NEAR_ENOUGH, Scene, State, Step, Tracer, typical};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::narrow;
use crate::numeric::rank;
use crate::vision::blur_estimate::BlurEstimate;
use crate::vision::clipped_step;
use crate::vision::located::Located;
use crate::vision::path;
use crate::vision::strip::Grey;

/// Upper end of the camera's scale \[grey levels of 256\].
const END: f64 = 255.0;
/// Levels that come so near it are cut off by noise, in standard deviations.
const NEAR_END: f64 = 1.5;

/// Times that a path is smoothed at most before an edge that is cut off is read
/// along it.
const SMOOTHINGS: usize = 4;
/// A path that runs farther off the places than noise puts them no longer follows its
/// edge, which is rough: in the mean square, so many times the variance of a place,
const SMOOTHED_AWAY: f32 = 4.0;
/// and this much of the blur, which softens the flank too little to matter.
const BESIDE_BLURS: f32 = 0.1;

impl Tracer {
    /// Blur of the edge that was looked at.
    pub fn blur(&self) -> Option<BlurEstimate> {
        self.seen.as_ref().map(Look::blur)
    }

    /// Whether the levels on either side of the edge that was looked at pass the
    /// end of the scale, or come so near that noise does: before it, after it.
    pub fn is_cut_off<T: Grey>(&self, scene: &Scene<'_, T>) -> [bool; 2] {
        let Some(seen) = &self.seen else { return [false; 2] };
        let (before, step) = self.mean_levels();
        let limit = END - NEAR_END * f64::from(scene.noise);
        [seen.step.before, seen.step.after].map(|level| before + step * level > limit)
    }

    /// Mean level before the edge and mean step, as picked \[grey levels\].
    fn mean_levels(&self) -> (f64, f64) {
        (typical(&self.values.before).into(), typical(&self.values.step).into())
    }

    /// Locates an edge that is cut off at the end of the scale on one side.
    /// Returns what is known of it, `None` where that is nothing.
    pub fn trace_cut_off<T: Grey>(
        &mut self,
        table: &StepTable,
        scene: &Scene<'_, T>,
        hidden_after: bool,
    ) -> Option<clipped_step::Found> {
        let seen = self.seen?;
        let (before, height) = self.mean_levels();
        let Extent { before: room_before, after: room_after } = seen.room;
        let (visible, room) = if hidden_after {
            (seen.step.before, [room_before, room_after])
        } else {
            (seen.step.after, [room_after, room_before])
        };
        let visible = before + height * visible;
        let noise = f64::from(scene.noise);
        let mut task = clipped_step::Scene { hidden_after, noise, white: END, room, shading: 0.0 };
        let Step { at, blur, .. } = seen.step;
        let start = clipped_step::Step { at, blur, visible, hidden: END + 0.3 * (END - visible) };
        let rough = self.cut_off.fit(table, &task, &self.overlay, start, None)?;
        self.shift_course(rough.step.at, 0.0, 1.0);
        self.locate_cut_off(table, scene, &task, &rough);
        // A path that jitters rounds off the corner at the end of the scale,
        // which looks like a higher level.
        self.straighten(scene, rough.step.blur);
        self.overlay.lay(&self.sheet);
        let start = clipped_step::Step { at: 0.0, ..rough.step };
        let first = self.cut_off.fit(table, &task, &self.overlay, start, None)?;
        // The surroundings that can be seen, beside the step as it really is.
        let share = |level: f64| (level - before) / height;
        let (visible, hidden) = (share(first.step.visible), share(first.step.hidden));
        let (before, after) = if hidden_after { (visible, hidden) } else { (hidden, visible) };
        let step = Step { at: first.step.at, blur: first.step.blur, before, after };
        let (extent, (slope, doubt)) = self.overlay.beside(table, &seen, &step, !hidden_after);
        task.room[0] = extent;
        task.shading = slope * height;
        let blur = self.cut_off.expected_blur(&first);
        let found = self.cut_off.fit(table, &task, &self.overlay, first.step, blur)?;
        self.cut_off.remember(&found);
        let per_level = std::f64::consts::PI * found.step.blur * found.step.blur;
        self.blur_px = found.step.blur;
        self.uncertainty.common_variance =
            found.variance + per_level * doubt / (after - before).powi(2);
        self.shift_course(found.step.at, 0.0, 1.0);
        self.locate_cut_off(table, scene, &task, &found);
        self.state = State::Open;
        Some(found)
    }

    /// Draws a path through the edges that were found, as smooth as the edge is.
    fn straighten<T: Grey>(&mut self, scene: &Scene<'_, T>, blur: f64) {
        let places = self.edges.iter().map(|edge| edge.map(|edge| narrow(edge.at)));
        if !path::fill(places, &mut self.scratch.rough) {
            return;
        }
        path::median_of_three(&mut self.scratch.rough);
        let (sum, n) = self
            .edges
            .iter()
            .flatten()
            .fold((0.0, 0.0), |(sum, n), edge| (sum + edge.variance, n + 1.0));
        let variance = sum / f64::max(n, 1.0);
        let limit = SMOOTHED_AWAY * narrow(variance) + (BESIDE_BLURS * narrow(blur)).powi(2);
        self.occlusion.free.clear();
        self.occlusion.free.extend_from_slice(&self.scratch.rough);
        for _ in 0..SMOOTHINGS {
            path::smooth(&self.scratch.rough, &mut self.values.path);
            if self.smoothed_away() > limit {
                break;
            }
            std::mem::swap(&mut self.scratch.rough, &mut self.values.path);
        }
        self.course.redraw(scene.lines, &self.scratch.rough, &mut self.scratch.course);
        self.read(scene);
    }

    /// Mean square of how far the path lies off the places that it was drawn through,
    /// from the median, so that a few wild ones do not count \[px²\].
    fn smoothed_away(&mut self) -> f32 {
        self.scratch.sorted.clear();
        let offs =
            self.values.path.iter().zip(&self.occlusion.free).map(|(path, at)| (path - at).powi(2));
        self.scratch.sorted.extend(offs);
        rank::median(&mut self.scratch.sorted).unwrap_or(0.0) / narrow(rank::MEDIAN_SQUARE)
    }

    fn locate_cut_off<T: Grey>(
        &mut self,
        table: &StepTable,
        scene: &Scene<'_, T>,
        task: &clipped_step::Scene,
        found: &clipped_step::Found,
    ) {
        let height = found.step.hidden - found.step.visible;
        let height = if task.hidden_after { height } else { -height };
        for _ in 0..MAX_PASSES {
            let (edges, course) = (&mut self.edges, &self.course);
            let mut off: f64 = 0.0;
            edges.clear();
            let (sheet, lines) = (&self.sheet, scene.lines.len());
            self.misfit = self.cut_off.locate(table, task, sheet, lines, found, |line, located| {
                edges.push(located.map(|located| {
                    let [path, _, _] = course.at(narrow(scene.lines[line].middle()));
                    let clipped_step::Line { moved, variance, share } = located;
                    off = off.max(moved.abs());
                    Located { at: f64::from(path) + moved, variance, height, share }
                }));
            });
            if off <= NEAR_ENOUGH * found.step.blur {
                break;
            }
            self.redraw(scene);
        }
    }
}
