//! An edge that winds more quickly than the bands resolve, as that of a rough bead in a tall gauge.
//! It is picked again on every caliper line.

use super::{EdgeTracer, MAX_UNFIT_FRACTION, StepFit, TraceInput, typical};
use crate::numeric::number::{narrow_to_f32, to_f32};
use crate::numeric::rank;
use crate::vision::edge::STEP_HALF_WIDTH;
use crate::vision::edge_windows::{EdgeWindow, Grouping, MAX_SINGLE_ROWS, MIDDLE_PX, WINDOW_PX};
use crate::vision::path;
use crate::vision::strip::GreyPixel;

/// Distance of a band from the line between its neighbours from which on an edge winds \[px\]:
/// three of four bands exceed it. Grains on a tenth of the rows do not make an edge wind; those on
/// a third do.
const MIN_WINDING_PX: f32 = 0.12;
/// That distance for each unit of a pixel's noise, as a fraction of the step \[px\]: picks spread
/// with the noise.
const WINDING_PER_NOISE_PX: f32 = 2.5;
/// Fraction of its rows that an edge may lose to a spark or two; one that loses more
/// may wind.
const MAX_LOST_FRACTION: f64 = 0.12;
/// Passes along a winding edge at most.
const MAX_PASSES: usize = 3;
/// How far beside the line between two bands the edge is looked for \[px\].
const SEARCH_HALF_PX: usize = 8;
/// Fraction of the expected step that a line must show.
const MIN_STEP_FRACTION: f32 = 0.25;

impl EdgeTracer {
    /// Draws the path of a winding edge from line to line, where there are more lines
    /// than bands.
    #[inline(always)]
    pub fn follow_windings<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        self.winding.excess = if could_wind(scene) { self.winding(scene.noise) } else { 0.0 };
        if self.seems_winding() {
            self.pick_lines(scene);
        }
    }

    /// Whether an edge that could wind has lost more rows than sparks explain.
    pub fn lost_rows<T: GreyPixel>(&self, scene: &TraceInput<'_, T>) -> bool {
        could_wind(scene) && self.used_fraction() < 1.0 - MAX_LOST_FRACTION
    }

    /// Whether the edge winds more quickly than bands show it, as far as they show.
    pub fn seems_winding(&self) -> bool {
        self.winding.excess > 1.0
    }

    /// Distance from the line between their neighbours that three of four bands exceed, relative to
    /// that from which on an edge winds.
    fn winding(&mut self, noise: f32) -> f32 {
        let least =
            MIN_WINDING_PX.max(WINDING_PER_NOISE_PX * noise / typical(&self.values.step).abs());
        self.scratch.sorted.clear();
        let offs =
            self.values.picked.windows(3).map(|near| (near[1] - 0.5 * (near[0] + near[2])).abs());
        self.scratch.sorted.extend(offs.filter(|off| !off.is_nan()));
        let quarter = self.scratch.sorted.len() / 4;
        rank::at(&mut self.scratch.sorted, quarter).unwrap_or(0.0) / least
    }

    /// Locates the edge along positions picked from line to line. Returns whether all but a few
    /// rows show it: then it winds, and nothing occludes it.
    #[cold]
    #[inline(never)]
    pub fn trace_winding<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        if !could_wind(scene) || self.step_fit.is_none() || !self.pick_lines(scene) {
            return false;
        }
        for _ in 0..MAX_PASSES {
            self.lay_over(scene);
            let Some(StepFit { room, .. }) = self.step_fit else { return false };
            self.pick_levels_within(scene, room);
            let Some(blur) = self.lay_over(scene) else { return false };
            self.take_shape(scene.table, blur);
            if !self.trace_open(scene) {
                return false;
            }
            if self.unfit_fraction <= MAX_UNFIT_FRACTION && !self.lost_rows(scene) {
                return true;
            }
            self.redraw(scene);
        }
        false
    }

    /// Fills the rough positions with the edges that were found; where none was, a
    /// winding edge stays on its course, and another one runs straight on.
    pub fn fill_from_edges<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        let (course, winds) = (&self.course, self.winding.is_followed);
        let positions = self.edges.iter().zip(scene.lines).map(|(edge, &line)| match edge {
            Some(edge) => Some(narrow_to_f32(edge.at)),
            None => winds.then(|| course.at(narrow_to_f32(line.middle()))[0]),
        });
        path::fill(positions, &mut self.scratch.rough);
    }

    /// Draws the course through the positions where each line has its highest step.
    /// Returns whether there is any.
    #[cold]
    #[inline(never)]
    fn pick_lines<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        let picked = self.values.picked.iter().map(|at| at.is_finite().then_some(*at));
        if !path::fill(picked, &mut self.values.path) {
            return false;
        }
        path::remove_outliers(&mut self.values.path, &mut self.scratch.sorted);
        let rest = self.values.path.iter().map(|at| at.is_finite().then_some(*at));
        path::fill(rest, &mut self.scratch.rough);
        std::mem::swap(&mut self.values.path, &mut self.scratch.rough);
        self.course.draw(scene.bands, &self.values.path, &self.values.before, &self.values.step);
        let course = &self.course;
        let tall = scene.strip.along.div_ceil(scene.lines.len());
        let grouping = Grouping { steepest: 0.0, max_rows: tall };
        self.sheet.read(scene.strip, scene.lines, grouping, |v| course.at(v));
        let windows = self.sheet.windows.iter().enumerate();
        let picks = windows.map(|(number, window)| pick(window, self.sheet.pixels(number)));
        if !path::fill(picks, &mut self.scratch.rough) {
            return false;
        }
        path::median_of_three(&mut self.scratch.rough);
        self.course.redraw(scene.lines, &self.scratch.rough, &mut self.scratch.course);
        self.winding.is_followed = true;
        true
    }
}

/// Whether there are more lines than bands, so that an edge may wind between these,
/// and plenty of rows, so that those of a line are read together.
fn could_wind<T: GreyPixel>(scene: &TraceInput<'_, T>) -> bool {
    scene.lines.len() > scene.bands.count() && scene.strip.along > MAX_SINGLE_ROWS
}

/// Position of the highest step of the expected kind in a window \[px\].
fn pick(window: &EdgeWindow, pixels: &[f32; WINDOW_PX]) -> Option<f32> {
    let [_, _, step] = window.expected;
    let height = |k: usize| {
        let sum = |from: usize| pixels[from..from + STEP_HALF_WIDTH].iter().sum::<f32>();
        (sum(k) - sum(k - STEP_HALF_WIDTH)) / step
    };
    let near = MIDDLE_PX - SEARCH_HALF_PX..=MIDDLE_PX + 1 + SEARCH_HALF_PX;
    let best = near.max_by(|&a, &b| height(a).total_cmp(&height(b)))?;
    let [before, here, after] = [height(best - 1), height(best), height(best + 1)];
    let bend = before + after - 2.0 * here;
    let enough = here >= MIN_STEP_FRACTION * to_f32(STEP_HALF_WIDTH) && bend < 0.0;
    let ahead = (0.5 * (before - after) / bend).clamp(-1.0, 1.0);
    enough.then(|| position(window.first) + to_f32(best) - 0.5 + ahead)
}

#[expect(clippy::cast_precision_loss, reason = "a position near the gauge")]
fn position(at: isize) -> f32 {
    at as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::blurred_step::StepTable;

    fn window(at: f64, heights: [f64; 2]) -> (EdgeWindow, [f32; WINDOW_PX]) {
        let table = StepTable::default();
        let level = |from: f64, k: usize| {
            let (step, _) = table.at((f64::from(to_f32(k)) + 100.0 - from) / 1.5);
            step
        };
        let pixels = std::array::from_fn(|k| {
            narrow_to_f32(40.0 + heights[0] * level(at, k) + heights[1] * level(at - 30.0, k))
        });
        let expected = [156.0, 40.0, narrow_to_f32(heights[0])];
        (EdgeWindow { line: 0, rows: 8.0, middle: 3.5, first: 100, expected }, pixels)
    }

    #[test]
    fn a_step_is_picked_where_it_is_and_no_other() {
        for (at, height) in [(151.3, 80.0), (156.0, -60.0), (162.75, 12.0)] {
            let (window, pixels) = window(at, [height, 3.0 * height]);
            let found = f64::from(pick(&window, &pixels).unwrap());
            assert!((found - at).abs() < 0.15, "{found} for {at}");
        }
    }

    #[test]
    fn a_step_of_the_other_kind_is_none() {
        let (mut window, pixels) = window(156.0, [80.0, 0.0]);
        window.expected[2] = -80.0;
        assert_eq!(pick(&window, &pixels), None);
    }
}
