//! An edge that grains or spots occlude in part: which rows show it and nothing else. All that is
//! known of it is taken from those rows alone.

use super::{EdgeState, EdgeTracer, MAX_CLEAR_MISFIT, typical};
use crate::numeric::number::{narrow_to_f32, to_count, to_f32};
use crate::numeric::rank;
use crate::vision::blur_estimate::BlurEstimate;
use crate::vision::buffer::refill;
use crate::vision::consensus::keep_consensus;
use crate::vision::located::CaliperEdge;
use crate::vision::overlay::{Clearance, StepShape};
use crate::vision::pixel_noise::NOISE_SIGMAS;
use crate::vision::strip::GreyPixel;
use crate::vision::template::{PlainSums, StepTemplate};
use crate::vision::trace::TraceInput;

/// Largest distance of a band from the consensus course \[px\].
const MAX_OFFSET_PX: f32 = 0.8;
/// Largest distance of a level from the consensus, as a fraction of the step.
const MAX_LEVEL_OFFSET: f32 = 0.08;
/// Addition to that distance, in standard deviations of a pixel.
const MAX_LEVEL_OFFSET_SIGMAS: f32 = 1.0;
/// How often rows are judged, each time by an edge that was read from those
/// which passed before.
const MAX_PASSES: usize = 3;
/// Percentage of the rows that are assumed to be clear in any case: the worst fit of them shows
/// what fits.
const CLEAR_PERCENTILE: usize = 30;
/// Largest sum of squared residuals of a clear row, relative to that of the worst fit.
const MAX_MISFIT_RATIO: f32 = 3.2;
/// Largest sum of squared residuals of a clear row, as a multiple of what noise explains.
const MAX_NOISE_RATIO: f32 = 3.0;
/// Largest difference of the levels beside an edge from those a little away, as a fraction of the
/// step: grains have levels of their own.
const MAX_LEVEL_DIFFERENCE: f64 = 0.25;
/// Trajectories that are tried.
const MAX_ATTEMPTS: usize = 3;
/// Fraction of clear rows along a trajectory from which on no other is tried.
const ENOUGH_CLEAR_FRACTION: f32 = 0.4;
/// Fraction of clear rows where there is none. By definition.
const NONE_CLEAR: f32 = 0.0;
/// Farthest that a clear row's edge lies from its neighbours', in standard deviations. Derived:
/// noise alone exceeds 3.5 in 5 of 10,000 rows.
const MAX_OFFSET_SIGMAS: f32 = 3.5;
/// Distances that are kept from an occluded row, in blurs, because blur shades the rows beside it;
/// the smaller ones where few rows would be left.
const MARGIN_BLURS: [f64; 4] = [2.0, 1.5, 1.0, 0.5];
/// Fraction and number of clear rows from which on no smaller distance is tried, and that are
/// needed.
const WANTED_CLEAR_ROWS: (f32, f32) = (0.25, 20.0);
const MIN_CLEAR_ROWS: (f32, f32) = (0.12, 12.0);
/// Longest run of rows that may show the same edge elsewhere, as a fraction of the rows: more are
/// not occluded, but a bead of another shape.
const MAX_ELSEWHERE_FRACTION: f32 = 0.08;
/// Distance from which on a row's edge is elsewhere \[px\].
const MIN_ELSEWHERE_PX: f32 = 1.0;
/// Fraction of an edge's positions that may be strays.
const MAX_STRAY_FRACTION: f32 = 0.25;

impl EdgeTracer {
    /// Locates an edge from the rows that show it and nothing else. Returns
    /// whether there are enough of them.
    #[cold]
    #[inline(never)]
    pub fn locate_occluded<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        self.look_row_by_row();
        refill(&mut self.occlusion.free, self.values.picked.iter().copied());
        let mut best = NONE_CLEAR;
        for attempt in 0..MAX_ATTEMPTS {
            let clear = self.try_course(scene).unwrap_or(NONE_CLEAR);
            if clear >= ENOUGH_CLEAR_FRACTION {
                best = clear;
                break;
            }
            if clear > best {
                best = clear;
                std::mem::swap(&mut self.occlusion.free, &mut self.occlusion.best_free);
                refill(&mut self.occlusion.free, self.occlusion.best_free.iter().copied());
            }
            if attempt + 1 < MAX_ATTEMPTS {
                self.exclude_course();
            }
        }
        if best == NONE_CLEAR {
            return false;
        }
        if best < ENOUGH_CLEAR_FRACTION {
            std::mem::swap(&mut self.occlusion.free, &mut self.occlusion.best_free);
            if self.try_course(scene).is_none() {
                return false;
            }
        }
        self.locate_from_clear_rows(scene)
    }

    /// Judges rows one by one, each against noise alone: what occludes some of them would pass for
    /// texture.
    fn look_row_by_row(&mut self) {
        self.occlusion.sort_rows = true;
        self.winding.is_followed = false;
        self.textured.texture = None;
        self.textured.scatter = None;
    }

    /// Locates an edge from its clear rows where the bead's other edge shows how this one runs:
    /// where most of it is occluded, what occludes it may have the larger consensus. `positions`
    /// are those that run beside the other edge, one a band, NaN in bands without.
    #[cold]
    #[inline(never)]
    pub fn locate_occluded_along<T: GreyPixel>(
        &mut self,
        scene: &TraceInput<'_, T>,
        blur: BlurEstimate,
        positions: &[f32],
    ) {
        self.look_row_by_row();
        refill(&mut self.occlusion.free, positions.iter().copied());
        if self.try_course(scene).is_some() && self.locate_from_clear_rows(scene) {
            self.state = EdgeState::Occluded;
        } else {
            self.trace_again(scene, blur);
        }
    }

    /// Removes the few positions that lie far from the consensus course of the others: between gaps
    /// they have no neighbours that could show it. `least_px` is the smallest distance that makes a
    /// stray. Many strays stay, and show that the edge is uncertain.
    pub fn drop_strays(&mut self, least_px: f64) {
        let at = |edge: &Option<CaliperEdge>| edge.map_or(f32::NAN, |edge| narrow_to_f32(edge.at));
        refill(&mut self.scratch.rough, self.edges.iter().map(at));
        let sigmas = self.edges.iter().flatten().map(|edge| narrow_to_f32(edge.variance.sqrt()));
        refill(&mut self.scratch.sorted, sigmas);
        let count = self.scratch.sorted.len();
        let Some(sigma) = rank::median(&mut self.scratch.sorted) else { return };
        let tolerance = narrow_to_f32(least_px).max(NOISE_SIGMAS * sigma);
        let left = keep_consensus(&mut self.scratch.rough, tolerance);
        if to_f32(count - left) > MAX_STRAY_FRACTION * to_f32(count) {
            return;
        }
        for (edge, at) in self.edges.iter_mut().zip(&self.scratch.rough) {
            if at.is_nan() {
                *edge = None;
            }
        }
    }

    /// Locates the edge from its clear rows. Returns whether they show one.
    #[inline(never)]
    fn locate_from_clear_rows<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        let Some(shape) = self.read_shape(scene) else { return false };
        self.row_fit.template.tabulate(scene.table, &shape, false);
        self.blur_px = shape.step.blur;
        self.uncertainty.common_variance = shape.variance;
        self.compare_rows(scene);
        self.sum_bands(scene);
        self.locate(scene, shape.step.blur);
        self.misfit < MAX_CLEAR_MISFIT
    }

    /// Finds the clear rows along the consensus course of the free bands. Returns their fraction;
    /// `None` where there are too few.
    #[inline(never)]
    fn try_course<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> Option<f32> {
        self.occlusion.clear.clear();
        if !self.take_course(scene) {
            return None;
        }
        self.read(scene);
        let (windows, trusted) = (&self.sheet.windows, &self.occlusion.trusted);
        let clear = |number: usize| trusted[scene.bands.band_of(windows[number].middle)];
        self.overlay.lay_robustly(&self.sheet, clear);
        for _ in 0..MAX_PASSES {
            let shape = self.read_shape(scene)?;
            self.row_fit.template.tabulate(scene.table, &shape, false);
            self.occlusion.clear.clear();
            self.compare_rows(scene);
            if !self.judge_rows(scene, shape.step.blur) {
                return None;
            }
            self.follow(scene);
            self.read(scene);
            let clear = &self.occlusion.clear;
            self.overlay.lay_clear(&self.sheet, |number| clear[number]);
        }
        Some(self.clear_fraction())
    }

    /// Removes the bands of the last consensus from the free ones.
    fn exclude_course(&mut self) {
        for (free, trusted) in self.occlusion.free.iter_mut().zip(&self.occlusion.trusted) {
            if *trusted {
                *free = f32::NAN;
            }
        }
    }

    /// Takes the consensus course of the bands, in position and levels; `false` with too few bands.
    fn take_course<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> bool {
        refill(&mut self.scratch.rough, self.occlusion.free.iter().copied());
        if keep_consensus(&mut self.scratch.rough, MAX_OFFSET_PX) < 4 {
            return false;
        }
        refill(&mut self.occlusion.trusted, self.scratch.rough.iter().map(|at| at.is_finite()));
        self.scratch.fill_rough();
        std::mem::swap(&mut self.scratch.rough, &mut self.values.path);
        self.pick_raw_levels(scene);
        let step = typical(&self.values.step).abs();
        let off = MAX_LEVEL_OFFSET * step + MAX_LEVEL_OFFSET_SIGMAS * scene.noise;
        // The level after the edge stands in for the step until it is smooth.
        for (step, before) in self.values.step.iter_mut().zip(&self.values.before) {
            *step += before;
        }
        for values in [&mut self.values.before, &mut self.values.step] {
            std::mem::swap(values, &mut self.scratch.rough);
            keep_consensus(&mut self.scratch.rough, off);
            self.scratch.fill_rough();
            std::mem::swap(values, &mut self.scratch.rough);
        }
        for (step, before) in self.values.step.iter_mut().zip(&self.values.before) {
            *step -= before;
        }
        self.steady_steps();
        self.course.draw(scene.bands, &self.values.path, &self.values.before, &self.values.step);
        true
    }

    /// Reads the edge's shape from the overlay and applies it. Rows are known to be clear about the
    /// edge only: beside it spots may lie anywhere, and would pass for shading.
    fn read_shape<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) -> Option<StepShape> {
        let noise = f64::from(scene.noise) / f64::from(typical(&self.values.step).abs());
        let room = self.room(scene);
        let fitter = self.overlay.with(scene.table);
        let look = fitter.first_fit(noise, room)?;
        let core = StepTemplate::core_half(look.step.blur);
        let room = Clearance { before: room.before.min(core), after: room.after.min(core) };
        let look = fitter.first_fit(noise, room)?;
        let shape =
            fitter.shape(&look, BlurEstimate { px: look.step.blur, sd_px: f64::INFINITY })?;
        let other = f64::max(shape.step.before.abs(), (shape.step.after - 1.0).abs());
        if other > MAX_LEVEL_DIFFERENCE {
            return None;
        }
        Some(self.apply_shape(shape))
    }

    /// Finds which rows are clear; returns whether there are enough.
    #[inline(never)]
    fn judge_rows<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, blur: f64) -> bool {
        let limit = self.max_row_misfit(scene.noise);
        let far = self.max_row_offset(scene, limit);
        let weight = self.row_fit.groups.first().map_or(1.0, |group| group.weight);
        let rows = to_f32(scene.strip.along);
        for blurs in MARGIN_BLURS {
            let reach = to_count((blurs * blur / f64::from(weight)).ceil());
            self.occlusion.clear.clear();
            for (k, group) in self.row_fit.groups.iter().enumerate() {
                let near = k.saturating_sub(reach)..(k + reach + 1).min(self.row_fit.groups.len());
                let hit = self.row_fit.groups[near].iter().any(|group| group.misfit > limit);
                self.occlusion.clear.push(!hit && group.moved.abs() <= far);
            }
            let clear = self.clear_fraction() * rows;
            if clear >= f32::max(WANTED_CLEAR_ROWS.0 * rows, WANTED_CLEAR_ROWS.1) {
                break;
            }
        }
        let clear = self.clear_fraction() * rows;
        clear >= f32::max(MIN_CLEAR_ROWS.0 * rows, MIN_CLEAR_ROWS.1)
            && self.elsewhere(scene, limit) <= MAX_ELSEWHERE_FRACTION * rows
    }

    /// Largest sum of squared residuals of a clear row \[grey levels²\].
    fn max_row_misfit(&mut self, noise: f32) -> f32 {
        refill(&mut self.scratch.sorted, self.row_fit.groups.iter().map(|group| group.misfit));
        let rank = self.scratch.sorted.len() * CLEAR_PERCENTILE / 100;
        let sure = rank::at(&mut self.scratch.sorted, rank).unwrap_or(f32::INFINITY);
        let pixels = narrow_to_f32(self.row_fit.template.products.pixels);
        let noise = noise * noise * (pixels + NOISE_SIGMAS * (2.0 * pixels).sqrt());
        noise.max(f32::min(MAX_MISFIT_RATIO * sure, MAX_NOISE_RATIO * noise))
    }

    /// Largest distance of a clear row's edge from the course \[px\].
    fn max_row_offset<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>, limit: f32) -> f32 {
        let stiffness = narrow_to_f32(self.row_fit.template.products.slope_slope);
        let step = typical(&self.values.step).abs();
        let weight = self.row_fit.groups.first().map_or(1.0, |group| group.weight);
        let noise = scene.noise / (step * stiffness.sqrt() * weight.sqrt());
        self.scratch.sorted.clear();
        let likely = self.row_fit.groups.iter().filter(|group| group.misfit <= limit);
        self.scratch.sorted.extend(likely.map(|group| group.moved.abs()));
        let median = rank::median(&mut self.scratch.sorted).unwrap_or(0.0);
        MAX_OFFSET_SIGMAS * noise.max(1.48 * median)
    }

    fn clear_fraction(&self) -> f32 {
        let clear = self.occlusion.clear.iter().filter(|clear| **clear).count();
        to_f32(clear) / to_f32(self.occlusion.clear.len().max(1))
    }

    /// Longest run of rows that do not fit, but show the same edge where their band has one
    /// \[rows\].
    #[inline(never)]
    fn elsewhere<T: GreyPixel>(&self, scene: &TraceInput<'_, T>, limit: f32) -> f32 {
        let (mut longest, mut run) = (0.0f32, 0.0);
        let windows = &self.sheet.windows;
        for (number, (group, clear)) in
            self.row_fit.groups.iter().zip(&self.occlusion.clear).enumerate()
        {
            let window = &windows[number];
            let at = self.values.picked[scene.bands.band_of(window.middle)];
            let [path, before, step] = window.expected;
            if *clear
                || group.misfit <= limit
                || at.is_nan()
                || (at - path).abs() < MIN_ELSEWHERE_PX
            {
                run = 0.0;
                continue;
            }
            let noise = scene.noise / group.weight.sqrt();
            let expected = Self::expected([at, before, step], noise);
            let mut plain = PlainSums::default();
            let pixels = (self.sheet.pixels(number).as_slice(), window.first);
            let sums = self.row_fit.template.compare(pixels, &expected, &mut plain);
            let fits = sums.is_some_and(|sums| self.misfit(&sums, group.weight) <= limit);
            run = if fits { run + group.weight } else { 0.0 };
            longest = longest.max(run);
        }
        longest
    }

    /// Draws the course through the clear rows.
    fn follow<T: GreyPixel>(&mut self, scene: &TraceInput<'_, T>) {
        self.scratch.rough.clear();
        let mut first = 0;
        for band in 0..scene.lines.len() {
            let (mut sum, mut n) = (0.0, 0.0);
            while first < self.row_fit.groups.len() && self.row_fit.groups[first].band == band {
                if self.occlusion.clear[first] {
                    sum += self.row_fit.groups[first].moved;
                    n += 1.0;
                }
                first += 1;
            }
            self.scratch.rough.push(if n > 0.0 { sum / n } else { f32::NAN });
        }
        self.scratch.fill_rough();
        for (at, &line) in self.scratch.rough.iter_mut().zip(scene.lines) {
            *at += self.course.at(narrow_to_f32(line.middle()))[0];
        }
        self.course.redraw(scene.lines, &self.scratch.rough, &mut self.scratch.course);
    }
}
