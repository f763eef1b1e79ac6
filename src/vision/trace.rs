//! One edge of the bead, from rough places to sub-pixel ones with their
//! variances: its profile is read from rows laid over each other, every row is
//! held against it, and the rows of a band are solved for place and levels
//! together.

mod hidden;
mod uncover;

use nalgebra::{Matrix3, Vector3};

use super::cut_off::CutOff;
use super::overlay::{Extent, Look, Overlay, REACH, Shape, Step};
use super::path::{self, Course};
use super::pool::{self, Bands};
use super::refine::{Refiner, Task};
use super::sheet::Sheet;
use super::step::StepTable;
use super::strip::{Grey, Strip};
use super::template::textured::Scatter;
use super::template::{Expected, PlainSums, RowSums, Template};
use super::texture::Texture;
use super::whiten::Whitener;

/// Passes over the rows at most; a second one is made only where the first
/// path was off by a good part of the blur.
const MAX_PASSES: usize = 3;
/// Distance of the path from the edge from which on pixels are read anew \[px\].
const FAR_ASIDE_PX: f64 = 4.0;
/// Share of the blur by which a path may be off.
const NEAR_ENOUGH: f64 = 0.3;
/// Standard deviations beyond which a pixel or a row is not noise.
const MANY_SIGMA: f32 = 4.5;
/// A row that fits worse than the median by so many times does not count.
const UNLIKE: f32 = 2.5;
/// Rows of a band may differ by this much beside their noise \[px\].
const WAVY_PX: f32 = 0.5;
/// Rows that are taken together at most.
const MOST_TOGETHER: usize = 8;
/// Misfit up to which an edge is a blurred step for certain.
const GOOD_FIT: f64 = 1.5;
/// Wild pixels that a row may have; more are a grain.
const FEW_WILD: f32 = 2.0;
/// Share of the plain pixels that must be as they are expected for their level
/// to be believed.
const LEAST_PLAIN: f64 = 0.6;
/// Share of its rows that a band must have left to count.
const LEAST_SHARE: f64 = 0.5;
/// The same where rows are known to be clear, one by one.
const LEAST_CLEAR_SHARE: f64 = 0.2;
/// Share of the rows from which on an edge is taken to be covered in part, and
/// by how much the squares that they leave exceed what may be noise.
const COVERED_SHARE: f64 = 0.03;
const UNFIT: f32 = 1.5;
/// Misfit of the clear rows from which on the edge is not covered, but no blurred
/// step at all.
const CLEAR_FIT: f64 = 1.25;
/// Where levels are picked first: distance from the edge, and apart \[px\].
const PICK: (f32, f32) = (5.0, 3.0);
/// Extra deviation of levels that is believed, in standard deviations of its
/// own doubt.
const BELIEVED: f64 = 2.5;

/// A caliper's edge with sub-pixel position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// Position across the bead at the middle of the band \[px\].
    pub at: f64,
    /// Variance of the position \[px²\].
    pub variance: f64,
    /// Signed height of the step \[grey levels\].
    pub height: f64,
    /// Share of the band's rows that it comes from.
    pub share: f64,
}

/// What is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a Strip<'a, T>,
    /// Its bands.
    pub bands: &'a Bands,
    /// Its caliper lines: first row and the row after the last of each.
    pub lines: &'a [(usize, usize)],
    /// Noise of a pixel \[grey levels\].
    pub noise: f32,
    /// Room between the two edges of the bead \[px\], at its narrowest.
    pub width_px: f32,
    /// Whether the bead lies after the edge.
    pub bead_after: bool,
}

/// Traces one edge of the bead; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Tracer {
    picked: Vec<f32>,
    rough: Vec<f32>,
    path: Vec<f32>,
    before: Vec<f32>,
    step: Vec<f32>,
    course: Course,
    groups: Vec<Group>,
    sheet: Sheet,
    overlay: Overlay,
    seen: Option<Look>,
    texture: Option<Texture>,
    whitener: Whitener,
    scatter_in_texture: Option<Scatter>,
    template: Template,
    plain: Vec<PlainSums>,
    sorted: Vec<f32>,
    solved: Vec<BandSums>,
    memory: Vec<[f32; 3]>,
    scatter: Vec<f64>,
    edges: Vec<Option<Located>>,
    refiner: Refiner,
    /// Rough places that are free to agree, and those of the best course yet.
    free: Vec<f32>,
    best_free: Vec<f32>,
    /// Bands that agree with most of the others.
    trusted: Vec<bool>,
    /// Groups that show the edge and nothing else; none where that is not
    /// asked.
    clear: Vec<bool>,
    /// Whether rows are sorted by that, each for itself.
    sort_rows: bool,
    /// Share of the rows that did not fit.
    unfit: f64,
    /// Whether the edge seems to be covered in part.
    suspect: bool,
    /// Whether its places are known.
    located: bool,
    /// Whether the edge was found to be covered in part, and is located from
    /// its clear rows alone.
    pub covered: bool,
    cut_off: CutOff,
    /// What a row in the median leaves of the step that it is held against, in
    /// standard deviations of its noise; about 1 where the edge is one.
    pub misfit: f64,
    /// Blur of the edge \[px\].
    pub blur_px: f64,
    /// Variance of the whole edge's position that all places share, from
    /// shading that is not known better \[px²\].
    pub common_variance: f64,
}

/// A few rows that are held against the edge together.
#[derive(Debug, Clone, Copy)]
struct Group {
    band: usize,
    /// Number of rows.
    weight: f32,
    /// How far the rows were sampled beyond the path \[px\].
    ahead: f32,
    sums: RowSums,
    /// Place of the edge beside the path \[px\].
    moved: f32,
    /// Sum of the squares of what does not fit, as if of a single row
    /// \[grey levels²\].
    misfit: f32,
}

/// Sums over the rows of a band that count.
#[derive(Debug, Clone, Copy, Default)]
struct BandSums {
    rows: f64,
    all_rows: f64,
    held_rows: f64,
    step: f64,
    vector: [f64; 3],
    before: (f64, f64),
    after: (f64, f64),
}

impl Tracer {
    /// The edges of the last frame, band by band.
    pub fn edges(&self) -> &[Option<Located>] {
        &self.edges
    }

    /// Share of all rows that the edges come from.
    pub fn used_share(&self) -> f64 {
        let used: f64 = self.edges.iter().flatten().map(|edge| edge.share).sum();
        used / float(self.edges.len().max(1))
    }

    /// The same, for those who sort out outliers.
    pub fn edges_mut(&mut self) -> &mut [Option<Located>] {
        &mut self.edges
    }

    /// Whether the edge's places are known.
    pub fn is_located(&self) -> bool {
        self.located
    }

    /// Whether the edge seems to be covered and no clear rows were found.
    pub fn is_hidden(&self) -> bool {
        self.suspect && !self.covered
    }

    /// Whether nothing covers the edge, or its clear rows are known.
    pub fn is_clear(&self) -> bool {
        (self.covered || !self.suspect) && self.misfit < GOOD_FIT
    }

    /// Where the edge is expected at a place along it \[px\].
    pub fn expected_at(&self, v: f64) -> f32 {
        self.course.at(narrow(v))[0]
    }

    /// Looks at the edge along rough places, one a band: its blur and how sure
    /// that is \[px\]. `None` where there is no edge.
    #[inline(always)]
    pub fn look<T: Grey>(
        &mut self,
        table: &StepTable,
        scene: &Scene<'_, T>,
        rough: impl Iterator<Item = Option<f32>>,
    ) -> Option<(f64, f64)> {
        self.edges.clear();
        self.seen = None;
        self.path.clear();
        // Until it is seen, it is hidden.
        self.suspect = true;
        self.located = false;
        self.misfit = f64::INFINITY;
        self.covered = false;
        self.sort_rows = false;
        self.clear.clear();
        self.picked.clear();
        self.picked.extend(rough.map(|at| at.unwrap_or(f32::NAN)));
        if !self.take_picked(scene) {
            return None;
        }
        self.read(scene);
        self.overlay.lay(&self.sheet, &self.course);
        let noise = f64::from(scene.noise) / f64::from(typical(&self.step).abs());
        self.seen = self.overlay.look(table, noise, self.room(scene));
        self.look_for_texture(scene, noise);
        self.seen.map(|seen| (seen.step.blur, seen.blur_sd))
    }

    /// Draws the path through the picked places, as far as they are not wild, with
    /// the levels beside it. Returns whether there is any.
    #[inline(always)]
    fn take_picked<T: Grey>(&mut self, scene: &Scene<'_, T>) -> bool {
        let rough = self.picked.iter().map(|at| at.is_finite().then_some(*at));
        if !path::fill(rough, &mut self.rough) {
            return false;
        }
        path::take_out_wild(&mut self.rough, &mut self.sorted);
        let rest = self.rough.iter().map(|at| at.is_finite().then_some(*at));
        if !path::fill(rest, &mut self.path) {
            return false;
        }
        path::median_of_three(&mut self.path);
        path::smooth(&self.path, &mut self.rough);
        std::mem::swap(&mut self.rough, &mut self.path);
        self.pick_levels(scene);
        self.course.draw(scene.bands, &self.path, &self.before, &self.step);
        true
    }

    /// Locates the edge that was looked at, with what is known of its blur:
    /// mean and standard deviation \[px\].
    #[inline(always)]
    pub fn trace<T: Grey>(&mut self, table: &StepTable, scene: &Scene<'_, T>, blur: (f64, f64)) {
        self.located = self.trace_open(table, scene, blur);
        self.suspect = !self.located || self.unfit > COVERED_SHARE;
        if self.suspect {
            self.covered = self.uncover(table, scene) && self.misfit < CLEAR_FIT;
            self.located = self.covered || self.trace_again(table, scene, blur);
        }
    }

    /// Locates the edge as if nothing covered it.
    #[inline(always)]
    fn trace_open<T: Grey>(
        &mut self,
        table: &StepTable,
        scene: &Scene<'_, T>,
        blur: (f64, f64),
    ) -> bool {
        let Some(seen) = &self.seen else { return false };
        let Some(shape) = self.overlay.shape(table, seen, blur) else { return false };
        let aside = shape.step.at;
        let shape = self.adopt(shape);
        if aside.abs() > FAR_ASIDE_PX {
            self.read(scene);
        }
        self.blur_px = shape.step.blur;
        self.common_variance = shape.variance;
        self.tabulate(table, &shape);
        for _ in 0..MAX_PASSES {
            self.hold(scene);
            self.gather(scene);
            if self.locate(scene, shape.step.blur) {
                break;
            }
        }
        true
    }

    /// Traces once more as if nothing covered the edge.
    #[cold]
    #[inline(never)]
    fn trace_again<T: Grey>(
        &mut self,
        table: &StepTable,
        scene: &Scene<'_, T>,
        blur: (f64, f64),
    ) -> bool {
        self.clear.clear();
        let picked = std::mem::take(&mut self.picked);
        let rough = picked.iter().map(|at| at.is_finite().then_some(*at));
        let seen = self.look(table, scene, rough);
        self.picked = picked;
        self.suspect = true;
        seen.is_some() && self.trace_open(table, scene, blur)
    }

    fn look_for_texture<T: Grey>(&mut self, scene: &Scene<'_, T>, noise: f64) {
        self.texture = None;
        let Some(seen) = self.seen else { return };
        let Some(texture) = Texture::read(&self.overlay, noise * noise, seen.beside()) else {
            return;
        };
        let pitch = float(scene.strip.along) / self.overlay.laid().0;
        self.seen = Some(seen.in_texture(texture.over_area(pitch).sqrt()));
        self.texture = Some(texture.in_grey(typical(&self.step).into()));
    }

    /// Makes the template; one that knows the texture where there is some.
    fn tabulate(&mut self, table: &StepTable, shape: &Shape) {
        self.scatter_in_texture = None;
        if let Some(texture) = &self.texture {
            self.template.tabulate(table, shape, true);
            self.scatter_in_texture = self.template.whiten(&mut self.whitener, texture);
        }
        if self.scatter_in_texture.is_none() {
            self.texture = None;
            self.template.tabulate(table, shape, false);
        }
    }

    /// Variance of a pixel of the mean of so many rows \[grey levels²\].
    fn pixel_variance<T: Grey>(&self, scene: &Scene<'_, T>, rows: f32) -> f32 {
        let texture = self.texture.map_or(0.0, |texture| narrow(texture.of_window()));
        scene.noise * scene.noise / rows + texture
    }

    /// Locates the edge anew, line by line, where it is not a blurred step.
    /// Returns whether there is one.
    #[cold]
    pub fn refine<T: Grey>(&mut self, table: &StepTable, scene: &Scene<'_, T>) -> bool {
        let width_px = f64::from(scene.width_px);
        let task = Task { strip: scene.strip, lines: scene.lines, width_px };
        // A blurred step that does not fit says nothing of the place either.
        if !self.take_picked(scene) {
            return false;
        }
        self.covered = false;
        self.edges.clear();
        self.edges.resize(scene.lines.len(), None);
        let course = &self.course;
        let rough =
            scene.lines.iter().map(|&line| f64::from(course.at(narrow(pool::middle(line)))[0]));
        let found = self.refiner.refine(table, &task, scene.bead_after, &mut self.edges, rough);
        self.blur_px = self.refiner.blur_px;
        self.common_variance = 0.0;
        self.misfit = f64::INFINITY;
        found
    }

    /// Levels on either side of the edge in every band, as the median of a few
    /// places in its profile and of its neighbours.
    #[inline(always)]
    fn pick_levels<T: Grey>(&mut self, scene: &Scene<'_, T>) {
        self.pick_raw_levels(scene);
        path::median_of_three(&mut self.before);
        path::median_of_three(&mut self.step);
        path::smooth(&self.before, &mut self.rough);
        std::mem::swap(&mut self.before, &mut self.rough);
        path::smooth(&self.step, &mut self.rough);
        std::mem::swap(&mut self.step, &mut self.rough);
        self.steady_steps();
    }

    /// The same, each band for itself.
    fn pick_raw_levels<T: Grey>(&mut self, scene: &Scene<'_, T>) {
        self.before.clear();
        self.step.clear();
        let inside = 0.45 * scene.width_px;
        let (room_before, room_after) =
            if scene.bead_after { (f32::INFINITY, inside) } else { (inside, f32::INFINITY) };
        let (left, right) = (picked(-1.0, room_before), picked(1.0, room_after));
        let unit = scene.bands.unit();
        for (band, &at) in self.path.iter().enumerate() {
            let profile = scene.bands.profile(band);
            #[expect(clippy::cast_possible_truncation, reason = "a place in the gauge")]
            let at = (at + 0.5) as isize;
            let before = unit * level(profile, at, left);
            self.before.push(before);
            self.step.push(unit * level(profile, at, right) - before);
        }
    }

    /// Steps that are small or turned over against the others are not believed.
    fn steady_steps(&mut self) {
        self.sorted.clear();
        self.sorted.extend_from_slice(&self.step);
        let middle = self.sorted.len() / 2;
        let typical = *self.sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
        let typical = if typical.abs() < 1.0 { 1.0f32.copysign(typical) } else { typical };
        for step in &mut self.step {
            if *step / typical < 0.3 {
                *step = 0.3 * typical;
            }
        }
    }

    /// How far there is nothing but this edge for certain: up to the gauge's
    /// border and to the middle of the bead.
    fn room<T: Grey>(&self, scene: &Scene<'_, T>) -> Extent {
        let (low, high) =
            self.path.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &at| {
                (low.min(at), high.max(at))
            });
        #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
        let (across, reach) = (scene.strip.across as f32, REACH as f32 - 1.0);
        let inside = 0.5 * scene.width_px;
        let mut before = low.clamp(2.0, reach);
        let mut after = (across - 1.0 - high).clamp(2.0, reach);
        if scene.bead_after {
            after = after.min(inside);
        } else {
            before = before.min(inside);
        }
        Extent { before: before.into(), after: after.into() }
    }

    /// Takes over what the overlay shows: the path is moved, and levels and
    /// shading are those at the edge.
    fn adopt(&mut self, shape: Shape) -> Shape {
        let Step { at, before, after, .. } = shape.step;
        let height = after - before;
        let flanks = shape.flanks.about(at, height);
        self.course.adopt(narrow(at), (narrow(before), narrow(after)));
        Shape {
            step: Step { at: 0.0, before: 0.0, after: 1.0, ..shape.step },
            shading: shape.shading.map(|shading| shading.of(height)),
            flanks,
            variance: shape.variance / (height * height),
            ..shape
        }
    }

    /// Reads the pixels along the path.
    #[inline(always)]
    fn read<T: Grey>(&mut self, scene: &Scene<'_, T>) {
        let course = &self.course;
        let most = if self.sort_rows { 1 } else { MOST_TOGETHER };
        let how = (course.steepest(), most);
        self.sheet.read(scene.strip, scene.lines, how, |v| course.at(v)[0]);
    }

    /// Holds every window against the edge.
    #[inline(always)]
    fn hold<T: Grey>(&mut self, scene: &Scene<'_, T>) {
        let stiffness = narrow(self.template.products.slope_slope);
        self.groups.clear();
        self.plain.clear();
        self.plain.resize(scene.lines.len(), PlainSums::default());
        for (number, window) in self.sheet.windows().iter().enumerate() {
            let (band, weight) = (window.line, window.rows);
            if self.clear.get(number) == Some(&false) {
                self.groups.push(Group::hidden(band, weight));
                continue;
            }
            let [path, before, step] = self.course.at(window.middle);
            let noise = self.pixel_variance(scene, weight).sqrt();
            let expected = Self::expected([path, before, step], noise);
            let pixels = (self.sheet.pixels(number).as_slice(), window.first);
            let sums = self.template.hold(pixels, &expected, &mut self.plain[band]);
            let sums = sums.unwrap_or(RowSums::OUT_OF_SIGHT);
            let ahead = expected.at - path;
            let moved = ahead - sums.slope / (step * stiffness);
            let misfit = self.misfit(&sums, weight);
            self.groups.push(Group { band, weight, ahead, sums, moved, misfit });
        }
    }

    /// What the mean of some rows is held against, whose pixels have a noise.
    #[inline(always)]
    fn expected([path, before, step]: [f32; 3], noise: f32) -> Expected {
        let noise = MANY_SIGMA * noise;
        Expected {
            at: Template::sampled(path),
            before,
            step,
            tolerance: noise + 0.05 * step.abs(),
            tolerance_at_step: noise + 0.15 * step.abs(),
        }
    }

    /// Sum of the squares of what does not fit, as if of a single row, so that
    /// groups of all sizes compare \[grey levels²\].
    #[inline(always)]
    fn misfit(&self, sums: &RowSums, weight: f32) -> f32 {
        if sums.wild > FEW_WILD {
            return f32::INFINITY;
        }
        // Weights that know a texture are not the slope of the step.
        if self.texture.is_some() {
            return weight * sums.squares;
        }
        let stiffness = narrow(self.template.products.slope_slope);
        weight * (sums.squares - sums.slope * sums.slope / stiffness)
    }

    /// Sums up the rows of each band, without those on which a grain or a
    /// spark lies.
    #[inline(always)]
    fn gather<T: Grey>(&mut self, scene: &Scene<'_, T>) {
        let products = self.template.products;
        self.sorted.clear();
        self.sorted.extend(self.groups.iter().map(|group| group.misfit));
        if !self.clear.is_empty() {
            // What is hidden says nothing.
            self.sorted.retain(|misfit| misfit.is_finite());
        }
        if self.sorted.is_empty() {
            self.sorted.push(f32::INFINITY);
        }
        let middle = self.sorted.len() / 2;
        let median = *self.sorted.select_nth_unstable_by(middle, f32::total_cmp).1;
        let pixels = narrow(products.pixels);
        let together = self.groups.iter().fold(1.0, |most: f32, group| most.max(group.weight));
        let variance = together * self.pixel_variance(scene, together);
        let alike = self.texture.map_or(1.0, |texture| narrow(texture.pixels_alike()));
        let limit = variance * (pixels + MANY_SIGMA * (2.0 * pixels * alike).sqrt());
        let limit = limit.max(UNLIKE * median);
        self.misfit = f64::from(median / (variance * pixels)).sqrt();
        let covered =
            |group: &&Group| group.misfit > UNFIT * limit || group.misfit == f32::INFINITY;
        let unfit = self.groups.iter().filter(covered).count();
        self.unfit = float(unfit) / float(self.groups.len().max(1));
        if self.clear.is_empty() {
            self.spread_misfits(limit);
        }
        self.solved.clear();
        let mut first = 0;
        for band in 0..scene.lines.len() {
            let mut end = first;
            while end < self.groups.len() && self.groups[end].band == band {
                end += 1;
            }
            let sums = self.gather_band(scene, (band, first..end), limit, &products.matrix());
            self.solved.push(sums);
            first = end;
        }
    }

    /// Rows next to one that fits badly share its grain or spark.
    fn spread_misfits(&mut self, limit: f32) {
        let mut before = 0.0;
        for k in 0..self.groups.len() {
            let here = self.groups[k].misfit;
            let after = self.groups.get(k + 1).map_or(0.0, |group| group.misfit);
            let beside = f32::max(before, after);
            if beside > limit {
                self.groups[k].misfit = here.max(beside);
            }
            before = here;
        }
    }

    #[inline(always)]
    fn gather_band<T: Grey>(
        &mut self,
        scene: &Scene<'_, T>,
        (band, groups): (usize, std::ops::Range<usize>),
        limit: f32,
        core: &Matrix3<f64>,
    ) -> BandSums {
        let stiffness = narrow(core[(0, 0)]);
        let [_, _, step] = self.course.at(narrow(pool::middle(scene.lines[band])));
        let groups = &self.groups[groups];
        self.sorted.clear();
        let fitting = groups.iter().filter(|group| group.misfit <= limit);
        self.sorted.extend(fitting.map(|group| group.moved));
        let typical = median_of_few(&mut self.sorted);
        let in_texture = self.scatter_in_texture.map(|scatter| narrow(scatter.of_window));
        let of_window = |weight: f32| {
            in_texture.unwrap_or(scene.noise * scene.noise / (weight * stiffness)).sqrt()
        };
        let widen = |(count, sum): (f32, f32)| (f64::from(count), f64::from(sum));
        let mut sums = BandSums {
            step: step.into(),
            before: widen(self.plain[band].before()),
            after: widen(self.plain[band].after()),
            ..BandSums::default()
        };
        for group in groups {
            let far = MANY_SIGMA * of_window(group.weight) / step.abs() + WAVY_PX;
            let counts = group.misfit <= limit && (group.moved - typical).abs() <= far;
            sums.all_rows += f64::from(group.weight);
            if self.clear.is_empty() || group.misfit < f32::INFINITY {
                sums.held_rows += f64::from(group.weight);
            }
            if counts {
                sums.add(group, core);
            }
        }
        // Plain pixels are those of a group's mean.
        let weight = f64::from(groups.first().map_or(1.0, |group| group.weight));
        sums.before = (sums.before.0 * weight, sums.before.1 * weight);
        sums.after = (sums.after.0 * weight, sums.after.1 * weight);
        sums
    }

    /// Solves every band; returns whether the path was near enough for that.
    #[inline(always)]
    fn locate<T: Grey>(&mut self, scene: &Scene<'_, T>, blur: f64) -> bool {
        let variance = match self.scatter_in_texture {
            Some(scatter) => scatter.of_mean,
            None => f64::from(scene.noise).powi(2),
        };
        let core = self.template.products.matrix();
        let extra = [0, 1].map(|side| self.extra_variance(core, variance, side));
        let plain = self.template.plain_pixels();
        let least_share = if self.clear.is_empty() { LEAST_SHARE } else { LEAST_CLEAR_SHARE };
        self.edges.clear();
        let textured = self.texture.is_some();
        let mut off: f64 = 0.0;
        for (band, sums) in self.solved.iter().enumerate() {
            let located =
                sums.solve(core, variance, extra, plain, least_share).map(|(moved, located)| {
                    let bent = if textured { 0.0 } else { moved / blur };
                    let moved = moved * (1.0 + bent * bent / 12.0);
                    off = off.max(moved.abs());
                    let [path, _, _] = self.course.at(narrow(pool::middle(scene.lines[band])));
                    Located { at: f64::from(path) + moved, ..located }
                });
            self.edges.push(located);
        }
        if off <= NEAR_ENOUGH * blur {
            return true;
        }
        self.redraw(scene);
        false
    }

    /// Draws the path anew through the edges that were found.
    #[inline(always)]
    fn redraw<T: Grey>(&mut self, scene: &Scene<'_, T>) {
        let places = self.edges.iter().map(|edge| edge.map(|edge| narrow(edge.at)));
        path::fill(places, &mut self.rough);
        path::median_of_three(&mut self.rough);
        if self.texture.is_some() {
            // What the texture makes of a place is no path.
            path::smooth(&self.rough, &mut self.sorted);
            std::mem::swap(&mut self.rough, &mut self.sorted);
        }
        self.course.redraw(scene.lines, &self.rough, &mut self.memory);
        self.read(scene);
    }

    /// How much the level at the edge differs from that of the surroundings
    /// from band to band beyond what noise explains: texture does that, and
    /// then the surroundings say less. Robust, from the median.
    #[inline(always)]
    fn extra_variance(&mut self, core: Matrix3<f64>, variance: f64, side: usize) -> f64 {
        let Some(inverse) = core.try_inverse() else { return 0.0 };
        self.scatter.clear();
        let mut explained = 0.0;
        for sums in &self.solved {
            let (count, sum) = if side == 0 { sums.before } else { sums.after };
            if sums.rows < 1.0 || count < 1.0 {
                continue;
            }
            let at_edge = (inverse * Vector3::from(sums.vector))[side + 1] / sums.rows;
            let off = at_edge - sum / count;
            let expected = variance * (inverse[(side + 1, side + 1)] / sums.rows + 1.0 / count);
            explained += expected;
            self.scatter.push(off * off / expected);
        }
        if self.scatter.len() < 6 {
            return 0.0;
        }
        let bands = float(self.scatter.len());
        let middle = self.scatter.len() / 2;
        // 0.455 is the median of the square of a standard normal number.
        let ratio = *self.scatter.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.455;
        let doubt = 2.3 / bands.sqrt();
        if ratio < 1.0 + BELIEVED * doubt { 0.0 } else { (ratio - 1.0) * explained / bands }
    }
}

impl Group {
    /// Rows that are not to be held.
    fn hidden(band: usize, weight: f32) -> Self {
        let (ahead, moved, misfit) = (0.0, 0.0, f32::INFINITY);
        Self { band, weight, ahead, sums: RowSums::default(), moved, misfit }
    }
}

impl BandSums {
    fn add(&mut self, group: &Group, core: &Matrix3<f64>) {
        let (sums, weight) = (&group.sums, f64::from(group.weight));
        self.rows += weight;
        // The unknown is the step times the distance from the path.
        let ahead = self.step * f64::from(group.ahead);
        self.vector[0] += weight * (core[(0, 0)] * ahead - f64::from(sums.slope));
        self.vector[1] += weight * (core[(1, 0)] * ahead + f64::from(sums.before));
        self.vector[2] += weight * (core[(2, 0)] * ahead + f64::from(sums.after));
    }

    /// Place relative to the path and what is known of it; `None` without a
    /// row or an edge.
    #[inline(always)]
    fn solve(
        &self,
        core: Matrix3<f64>,
        variance: f64,
        extra: [f64; 2],
        plain: [f64; 2],
        least_share: f64,
    ) -> Option<(f64, Located)> {
        if self.rows < least_share * self.all_rows || self.rows < 1.0 {
            return None;
        }
        let mut matrix = core * self.rows;
        let mut vector = Vector3::from(self.vector);
        for (side, (count, sum)) in [self.before, self.after].into_iter().enumerate() {
            if count >= LEAST_PLAIN * plain[side] * self.held_rows {
                let weight = 1.0 / (1.0 / count + extra[side] / variance);
                matrix[(side + 1, side + 1)] += weight;
                vector[side + 1] += weight * sum / count;
            }
        }
        let (found, variance_of_place) = solve(&matrix, &vector)?;
        let height = self.step + found[2] - found[1];
        let variance = variance * variance_of_place / (self.step * self.step);
        let share = self.rows / self.all_rows;
        Some((found[0] / self.step, Located { at: 0.0, variance, height, share }))
    }
}

/// Solves symmetric equations for place and levels, the levels first; the
/// variance is that of the place.
fn solve(matrix: &Matrix3<f64>, vector: &Vector3<f64>) -> Option<([f64; 3], f64)> {
    let (before, both, after) = (matrix[(1, 1)], matrix[(2, 1)], matrix[(2, 2)]);
    let determinant = before * after - both * both;
    let with = [matrix[(1, 0)], matrix[(2, 0)]];
    // What two sums do to the levels, times the determinant.
    let levels =
        |sums: [f64; 2]| [after * sums[0] - both * sums[1], before * sums[1] - both * sums[0]];
    let shift = levels(with);
    let stiffness = matrix[(0, 0)] * determinant - (with[0] * shift[0] + with[1] * shift[1]);
    if determinant <= 0.0 || stiffness <= 0.0 {
        return None;
    }
    let place = (vector[0] * determinant - vector[1] * shift[0] - vector[2] * shift[1]) / stiffness;
    let levels = levels([vector[1] - with[0] * place, vector[2] - with[1] * place])
        .map(|level| level / determinant);
    Some(([place, levels[0], levels[1]], determinant / stiffness))
}

/// Distances from an edge at which its level on one side is picked \[px\].
#[expect(clippy::cast_possible_truncation, reason = "a few pixels")]
fn picked(sign: f32, room: f32) -> [isize; 5] {
    let near = PICK.0.min(0.4 * room);
    let apart = PICK.1.min((room - near) / 5.0);
    [0.0, 1.0, 2.0, 3.0, 4.0].map(|k| (sign * (near + k * apart)).round() as isize)
}

/// Level at such distances from an edge: the median of five places.
#[inline(always)]
fn level(profile: &[u16], at: isize, distances: [isize; 5]) -> f32 {
    let last = profile.len() - 1;
    median_of_five(distances.map(|distance| {
        let place = usize::try_from(at + distance).unwrap_or(0).min(last);
        f32::from(profile[place])
    }))
}

#[inline(always)]
fn median_of_five(values: [f32; 5]) -> f32 {
    let [first, second, third, fourth, last] = values;
    let low = first.min(second).max(third.min(fourth));
    let high = first.max(second).min(third.max(fourth));
    // The extremes of the four are out; the last lies among the rest.
    low.min(high).max(last.min(low.max(high)))
}

fn typical(values: &[f32]) -> f32 {
    let sum: f32 = values.iter().sum();
    #[expect(clippy::cast_precision_loss, reason = "there are few bands")]
    let count = values.len().max(1) as f32;
    sum / count
}

#[expect(clippy::cast_possible_truncation, reason = "the quantity needs no more")]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// Median of a few values, which are sorted; 0 of none.
fn median_of_few(values: &mut [f32]) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[expect(clippy::cast_precision_loss, reason = "a count")]
fn float(number: usize) -> f64 {
    number as f64
}
