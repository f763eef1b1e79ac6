//! The profile of an edge, from rows all along it laid over each other: its
//! blur, how far its surroundings on either side are plain, and how they are
//! shaded. Rows that differ from most, because a grain or a spark lies on
//! them, are left out.

use std::ops::Range;

use super::line::Line;
use super::normal::Normal;
use super::phase::split;
use super::sheet::Sheet;
use super::step::StepTable;

/// Rows that are laid over each other at most.
const ROWS: usize = 100;
/// Farthest sample from the edge on either side \[px\].
pub const REACH: usize = 48;
const SPAN: usize = 2 * REACH;
/// Rows are laid down at the nearest of so many places between pixels.
const PHASES: usize = 2;
/// Samples this near the edge tell whether a row is like the others \[px\].
const CORE: usize = 12;
const JUDGED: Range<usize> = REACH - CORE..REACH + CORE;
/// A row that differs from the mean by so many times what rows do in the
/// median is left out; the second time, when the mean is a better one.
const UNLIKE: [f32; 2] = [2.0, 1.7];
/// Share of the rows that are most alike, from which a mean is made where many
/// may be covered, and how often anew.
const ALIKE: f32 = 0.3;
const SETTLES: usize = 5;
/// The same for rows that are cut off at the end of the scale.
const VERY_UNLIKE: f32 = 3.5;
/// Blur that the place's rounding to half a pixel adds \[px²\].
const ROUNDING: f64 = 1.0 / 48.0;

const LEAST_BLUR_PX: f64 = 0.3;
const MOST_BLUR_PX: f64 = 15.0;
const MAX_STEPS: usize = 16;
/// A step \[px, or blurs\] after which another would change next to nothing: each
/// squares what is left.
const CONVERGED: f64 = 2e-3;
/// Shading that is usual close to an edge, as a standard deviation \[1/px\].
const SHADING_SD: f64 = 0.02;

/// Where and how an edge lies in the rows of a strip.
pub trait Path {
    /// Position of the edge at a place along it \[px\], level before it and step
    /// to the level after it \[grey levels\].
    fn expected(&self, v: f32) -> [f32; 3];
}

/// Samples that are free of anything but this edge, on either side \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Towards smaller places.
    pub before: f64,
    /// Towards larger ones.
    pub after: f64,
}

/// A blurred step, its levels in shares of the step that was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// How far it lies from the path \[px\].
    pub at: f64,
    /// Blur as the standard deviation of a Gaussian \[px\], integration over
    /// pixels included.
    pub blur: f64,
    /// Level before it.
    pub before: f64,
    /// Level after it.
    pub after: f64,
}

/// A first look at an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The step.
    pub step: Step,
    /// Standard deviation of its blur \[px\].
    pub blur_sd: f64,
    /// Change of the level before and after it \[1/px away from it\].
    shading: [f64; 2],
    /// Standard deviation of a pixel, in shares of the step.
    pixel_noise: f64,
    /// Standard deviation of a row's samples about the step, in shares of it.
    noise: f64,
    /// How far there is nothing but this edge.
    pub room: Extent,
}

impl Look {
    /// Samples beside the edge on either side: distances of the nearest and the
    /// farthest \[px\].
    pub fn beside(&self) -> [(usize, usize); 2] {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "within the window"
        )]
        let whole = |distance: f64| distance.max(0.0) as usize;
        let near = 3.0 * self.step.blur + 1.0;
        let to = |room: f64| whole(room).min(REACH);
        [
            (whole((near - self.step.at).ceil()), to(self.room.before)),
            (whole((near + self.step.at).ceil()), to(self.room.after)),
        ]
    }

    /// The same look where texture makes samples less sure than noise does:
    /// `noise` is what independent ones as unsure would have.
    pub fn in_texture(self, noise: f64) -> Self {
        let blur_sd = self.blur_sd * (noise / self.noise).max(1.0);
        Self { blur_sd, pixel_noise: noise, noise: noise.max(self.noise), ..self }
    }
}

/// An edge as the overlay shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// The step.
    pub step: Step,
    /// How far the surroundings are plain, and what is used of them.
    pub extent: Extent,
    /// Change of the level for each pixel away from the edge, before and after
    /// it, in shares of the step \[1/px\].
    pub shading: (f64, f64),
    /// Variance of the edge's position that doubt about the shading leaves
    /// \[px²\].
    pub variance: f64,
}

/// How a window was laid down: at which phase, how far the path lies ahead of
/// its pixel \[px\], of how many rows it is, and the level before the edge and
/// the step that were expected \[grey levels\].
#[derive(Debug, Clone, Copy)]
struct Laid {
    number: usize,
    phase: usize,
    ahead: f32,
    rows: f32,
    before: f32,
    step: f32,
}

/// Lays rows over each other; keeps its memory from frame to frame.
#[derive(Debug, Clone)]
pub struct Overlay {
    rows: Vec<[f32; SPAN]>,
    phases: Vec<Laid>,
    unlike: Vec<f32>,
    sorted: Vec<f32>,
    mean: [[f32; SPAN]; PHASES],
    counts: [f32; PHASES],
    /// Mean distance of the path from the pixels' places in each phase \[px\].
    shifts: [f32; PHASES],
    /// How unlike the mean a row is in the median.
    typical: f32,
}

/// Mean of rows of one part along the bead, all at nearly the same place
/// between pixels.
#[derive(Debug, Clone)]
pub struct Profile {
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

impl Profile {
    const EMPTY: Self =
        Self { mean: [0.0; SPAN], rows: 0.0, shift: 0.0, spread: 0.0, levels: [0.0; 2] };

    fn add(&mut self, row: &[f32; SPAN], laid: &Laid) {
        let Laid { ahead, rows, before, step, .. } = *laid;
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
        let share = 1.0 / self.rows;
        #[expect(clippy::cast_possible_truncation, reason = "a share")]
        self.mean.iter_mut().for_each(|value| *value *= share as f32);
        self.shift *= share;
        self.spread = (share * self.spread - self.shift * self.shift).max(0.0);
        self.levels = self.levels.map(|level| share * level);
    }

    /// Each sample's distance from the path and its value, from a distance to
    /// another \[px\].
    pub fn samples(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let first = index((from + self.shift).ceil());
        let last = index((to + self.shift).floor() + 1.0);
        (first..last).map(|k| (place(k) - self.shift, f64::from(self.mean[k])))
    }
}

impl Default for Overlay {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            phases: Vec::new(),
            unlike: Vec::new(),
            sorted: Vec::new(),
            mean: [[0.0; SPAN]; PHASES],
            counts: [0.0; PHASES],
            shifts: [0.0; PHASES],
            typical: f32::INFINITY,
        }
    }
}

impl Overlay {
    /// Lays down the windows along a path.
    #[inline(always)]
    pub fn lay(&mut self, sheet: &Sheet, path: &impl Path) {
        self.lay_down(sheet, path);
        self.average(f32::INFINITY, JUDGED);
        let [first, last] = UNLIKE;
        let limit = first * self.judge(0.5);
        self.average(limit, JUDGED);
        self.typical = self.judge(0.5);
        self.average(last * self.typical, 0..SPAN);
    }

    /// Lays down windows along a path of which many may be covered: starts from
    /// those that are said to be clear and goes on with those that are most
    /// like the mean, over and over.
    #[inline(always)]
    pub fn settle(&mut self, sheet: &Sheet, path: &impl Path, clear: impl Fn(usize) -> bool) {
        self.lay_clear(sheet, path, clear);
        for _ in 0..SETTLES {
            let limit = self.judge(ALIKE);
            self.average(limit, 0..SPAN);
        }
    }

    /// Lays down the windows along a path that are clear, and no others.
    #[inline(always)]
    pub fn lay_clear(&mut self, sheet: &Sheet, path: &impl Path, clear: impl Fn(usize) -> bool) {
        self.lay_down(sheet, path);
        for (laid, unlike) in self.phases.iter().zip(&mut self.unlike) {
            *unlike = if clear(laid.number) { 0.0 } else { f32::INFINITY };
        }
        self.average(f32::MAX, 0..SPAN);
    }

    #[inline(always)]
    fn lay_down(&mut self, sheet: &Sheet, path: &impl Path) {
        let windows = sheet.windows();
        let count = windows.len().min(ROWS);
        self.rows.clear();
        self.phases.clear();
        for k in 0..count {
            let number = (2 * k + 1) * windows.len() / (2 * count);
            let window = &windows[number];
            let [at, before, step] = path.expected(window.middle);
            let (place, phase) = split(at, PHASES);
            let start = place - window.first - REACH.cast_signed();
            let pixels = usize::try_from(start).ok().and_then(|start| {
                sheet.pixels(number).get(start..start + SPAN)?.first_chunk::<SPAN>()
            });
            let Some(pixels) = pixels else { continue };
            #[expect(clippy::cast_precision_loss, reason = "a place near the gauge")]
            let ahead = at - place as f32;
            let (scale, shift) = (1.0 / step, before / step);
            let mut row = [0.0; SPAN];
            for (sample, pixel) in row.iter_mut().zip(pixels) {
                *sample = pixel * scale - shift;
            }
            self.rows.push(row);
            self.phases.push(Laid { number, phase, ahead, rows: window.rows, before, step });
        }
        self.unlike.clear();
        self.unlike.resize(self.rows.len(), 0.0);
    }

    /// Means of the rows that are not unlike the others, in some columns.
    #[inline(always)]
    fn average(&mut self, limit: f32, columns: Range<usize>) {
        self.mean = [[0.0; SPAN]; PHASES];
        self.counts = [0.0; PHASES];
        self.shifts = [0.0; PHASES];
        for ((row, laid), &unlike) in self.rows.iter().zip(&self.phases).zip(&self.unlike) {
            if unlike > limit {
                continue;
            }
            let Laid { phase, ahead, rows, .. } = *laid;
            self.counts[phase] += rows;
            self.shifts[phase] += rows * ahead;
            let sums = self.mean[phase][columns.clone()].iter_mut();
            for (sum, sample) in sums.zip(&row[columns.clone()]) {
                *sum += rows * sample;
            }
        }
        for ((mean, shift), count) in self.mean.iter_mut().zip(&mut self.shifts).zip(self.counts) {
            let share = 1.0 / f32::max(count, 1.0);
            *shift *= share;
            for value in mean {
                *value *= share;
            }
        }
    }

    /// How far each row lies from the mean about the edge; returns how far a
    /// share of them does at most.
    #[inline(always)]
    fn judge(&mut self, share: f32) -> f32 {
        for ((row, laid), unlike) in self.rows.iter().zip(&self.phases).zip(&mut self.unlike) {
            let mean = &self.mean[laid.phase];
            let mut lanes = [0.0f32; 8];
            for (a, b) in row[JUDGED].chunks_exact(8).zip(mean[JUDGED].chunks_exact(8)) {
                for k in 0..8 {
                    let miss = a[k] - b[k];
                    lanes[k] += miss * miss;
                }
            }
            *unlike = lanes.iter().sum();
        }
        self.sorted.clear();
        self.sorted.extend_from_slice(&self.unlike);
        if self.sorted.is_empty() {
            return f32::INFINITY;
        }
        let rank = rank_of(self.sorted.len(), share);
        *self.sorted.select_nth_unstable_by(rank, f32::total_cmp).1
    }

    /// Means of the rows in several parts along the bead, as grey levels. Only
    /// rows that are very unlike the others are left out: of pixels that are cut
    /// off above, more lie far below their mean than above it, and leaving them
    /// out would lift it.
    pub fn profiles(&self, parts: usize, profiles: &mut Vec<Profile>) {
        profiles.clear();
        profiles.resize(parts * PHASES, Profile::EMPTY);
        let count = self.rows.len();
        for (k, (row, laid)) in self.rows.iter().zip(&self.phases).enumerate() {
            if self.unlike[k] <= VERY_UNLIKE * self.typical {
                profiles[k * parts / count * PHASES + laid.phase].add(row, laid);
            }
        }
        profiles.retain(|profile| profile.rows > 0.0);
        for profile in profiles {
            profile.finish();
        }
    }

    /// Rows that the means are of.
    pub fn used(&self) -> f64 {
        f64::from(self.counts.iter().sum::<f32>())
    }

    /// Rows that were laid down, and windows.
    pub fn laid(&self) -> (f64, f64) {
        #[expect(clippy::cast_precision_loss, reason = "there are few windows")]
        let windows = self.rows.len() as f64;
        (self.phases.iter().map(|laid| f64::from(laid.rows)).sum(), windows)
    }

    /// Variance of a window's samples about the mean near the edge, of the window
    /// in the median, in squared shares of the step.
    pub fn unlikeness(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let samples = (2 * CORE) as f64;
        f64::from(self.typical) / samples
    }

    /// The windows that differ by no more than so many medians of what rows do,
    /// each with the mean that it is compared with.
    pub fn rows_like_others(&self, many: f32) -> impl Iterator<Item = (&[f32], &[f32])> {
        let rows = self.rows.iter().zip(&self.phases).zip(&self.unlike);
        rows.filter(move |(_, unlike)| **unlike <= many * self.typical)
            .map(|((row, laid), _)| (row.as_slice(), self.mean[laid.phase].as_slice()))
    }

    /// Each sample's distance from the path, its value and its weight.
    #[inline(always)]
    fn samples(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64, f64)> {
        (0..PHASES).filter(|&phase| self.counts[phase] > 0.0).flat_map(move |phase| {
            let shift = f64::from(self.shifts[phase]);
            let weight = f64::from(self.counts[phase]);
            let first = index((from + shift).ceil());
            let last = index((to + shift).floor() + 1.0);
            (first..last).map(move |k| {
                let distance = place(k) - shift;
                (distance, f64::from(self.mean[phase][k]), weight)
            })
        })
    }

    /// Looks at the edge. `noise` is the standard deviation of a pixel as a
    /// share of the step, `room` how far to look. `None` where no step can be
    /// fitted.
    #[inline(always)]
    pub fn look(&self, table: &StepTable, noise: f64, room: Extent) -> Option<Look> {
        let (slope, at) = self.steepest(room)?;
        let blur = (0.2 / slope).clamp(0.5, MOST_BLUR_PX);
        let step = Step { at, blur, before: 0.0, after: 1.0 };
        let room = self.up_to_neighbours(step, noise, room);
        let unknown = f64::INFINITY;
        let look =
            Look { step, blur_sd: unknown, shading: [0.0; 2], pixel_noise: noise, noise, room };
        self.fit(table, look, None)
    }

    /// How far the surroundings on one side of a known step are plain \[px\],
    /// after it or before it, their slope in shares of the step that was given
    /// \[1/px away from it\], and the variance that its doubt leaves to the
    /// level at the edge.
    pub fn beside(
        &self,
        table: &StepTable,
        look: &Look,
        step: &Step,
        after: bool,
    ) -> (f64, (f64, f64)) {
        let (sign, room) = if after { (1.0, look.room.after) } else { (-1.0, look.room.before) };
        let (extent, line) = self.plain(table, step, look.pixel_noise, sign, room);
        (extent, line.sure_slope(look.pixel_noise))
    }

    /// Reads the edge's shape from a look at it and what is known of its blur:
    /// mean and standard deviation \[px\].
    #[inline(always)]
    pub fn shape(&self, table: &StepTable, look: &Look, blur: (f64, f64)) -> Option<Shape> {
        let look = self.fit(table, *look, Some(blur))?;
        let Look { step, noise, room, .. } = look;
        let sharp = step.blur * step.blur - ROUNDING;
        let step = Step { blur: sharp.max(LEAST_BLUR_PX.powi(2)).sqrt(), ..step };
        let (before, line_before) = self.plain(table, &step, noise, -1.0, room.before);
        let (after, line_after) = self.plain(table, &step, noise, 1.0, room.after);
        let ((slope_before, doubt_before), (slope_after, doubt_after)) =
            (line_before.sure_slope(look.pixel_noise), line_after.sure_slope(look.pixel_noise));
        // A level that is off by a share moves the edge by √π blurs times it.
        let per_level = std::f64::consts::PI * step.blur * step.blur;
        Some(Shape {
            step,
            extent: Extent { before, after },
            shading: (slope_before, slope_after),
            variance: per_level * (doubt_before + doubt_after),
        })
    }

    /// Steepest slope of the overlay near the path \[1/px\], and where.
    #[inline(always)]
    fn steepest(&self, room: Extent) -> Option<(f64, f64)> {
        let (from, to) = (halves(-room.before.min(8.0)), halves(room.after.min(8.0)));
        let mut best = (0.0, 0);
        for half in from..=to {
            let slope = self.slope(half);
            if slope > best.0 {
                best = (slope, half);
            }
        }
        (best.0 > 0.01).then_some((f64::from(best.0), f64::from(best.1) / 2.0))
    }

    /// Mean slope over two pixels about a distance in half pixels, of both
    /// phases \[1/px\].
    #[inline(always)]
    fn slope(&self, half: i16) -> f32 {
        let (mut sum, mut n) = (0.0, 0.0);
        let middle = i16::try_from(REACH).unwrap_or(0);
        for (phase, mean) in (0i16..).zip(&self.mean) {
            let weight = self.counts[usize::from(phase.unsigned_abs())];
            // The nearest sample, of two as near the one farther out.
            let twice = half + phase;
            let k = i16::midpoint(twice, twice.signum()) + middle;
            let k = usize::try_from(k).unwrap_or(0).clamp(1, SPAN - 2);
            sum += weight * 0.5 * (mean[k + 1] - mean[k - 1]);
            n += weight;
        }
        sum / n.max(1.0)
    }

    /// Cuts the room off half-way to a neighbouring step: where the slope has
    /// fallen off and rises again, in either direction.
    #[expect(clippy::cast_possible_truncation, reason = "a slope needs no more")]
    #[inline(always)]
    fn up_to_neighbours(&self, start: Step, noise: f64, room: Extent) -> Extent {
        let noise = noise / (2.0 * self.used().max(1.0)).sqrt();
        let notable = (5.0 * noise).max(0.06 / start.blur.max(1.0)) as f32;
        let first = (0.5 * start.blur).clamp(0.5, 3.0);
        let cut = |sign: i16, room: f64| {
            let mut lowest = (f32::INFINITY, room);
            let from = halves(start.at + f64::from(sign) * first);
            for step in 0..halves(room - 1.0 - first) {
                let slope = self.slope(from + sign * step).abs();
                if slope < lowest.0 {
                    lowest = (slope, first + f64::from(step) / 2.0);
                }
                if slope > lowest.0 + notable {
                    return lowest.1;
                }
            }
            room
        };
        Extent { before: cut(-1, room.before), after: cut(1, room.after) }
    }

    /// Fits place, blur, levels and a little shading about the edge.
    #[inline(always)]
    fn fit(&self, table: &StepTable, start: Look, known: Option<(f64, f64)>) -> Option<Look> {
        let mut look = start;
        // Shading is held near none, because over a short way it could pass
        // for a shift of the edge.
        for _ in 0..MAX_STEPS {
            let Look { step, noise, .. } = look;
            let (mut normal, misfit) = self.linearise(table, &look);
            let hold = |noise: f64, sd: f64| (noise / sd).powi(2);
            normal.hold(4, hold(start.pixel_noise, SHADING_SD), -look.shading[0]);
            normal.hold(5, hold(start.pixel_noise, SHADING_SD), -look.shading[1]);
            if let Some((mean, sd)) = known {
                normal.hold(1, hold(noise, sd), mean - step.blur);
            }
            let solved = normal.solve()?;
            let moved = solved.unknowns;
            // What the model leaves is noise, if not of the pixels.
            look.noise = start.pixel_noise.max(misfit.sqrt());
            look.step = Step {
                at: step.at + moved[0].clamp(-step.blur, step.blur),
                blur: (step.blur + moved[1].clamp(-0.5 * step.blur, 0.5 * step.blur))
                    .clamp(LEAST_BLUR_PX, MOST_BLUR_PX),
                before: step.before + moved[2],
                after: step.after + moved[3],
            };
            look.shading[0] += moved[4];
            look.shading[1] += moved[5];
            look.blur_sd = look.noise * solved.variance(1).max(0.0).sqrt();
            if moved[0].abs() < CONVERGED && moved[1].abs() < CONVERGED * step.blur {
                break;
            }
        }
        let inside = look.step.at > -look.room.before && look.step.at < look.room.after;
        (inside && look.step.after - look.step.before > 0.1).then_some(look)
    }

    /// Normal equations about a step, and the mean square of what it leaves,
    /// for a sample of weight 1.
    #[inline(always)]
    fn linearise(&self, table: &StepTable, look: &Look) -> (Normal<6>, f64) {
        let Look { step: edge, room, shading, .. } = *look;
        let reach = 4.5 * edge.blur + 2.0;
        let from = (edge.at - reach.min(room.before)).max(-place_limit());
        let to = (edge.at + reach.min(room.after)).min(place_limit());
        let height = edge.after - edge.before;
        let mut normal = Normal::<6>::default();
        let (mut square, mut n) = (0.0, -6.0);
        for (distance, value, weight) in self.samples(from, to) {
            let z = (distance - edge.at) / edge.blur;
            let (step, density) = table.at(z);
            let depth = [density - z * (1.0 - step), density + z * step].map(|d| d * edge.blur);
            let slope = height * density / edge.blur;
            let miss = value
                - edge.before * (1.0 - step)
                - edge.after * step
                - shading[0] * depth[0]
                - shading[1] * depth[1];
            square += weight * miss * miss;
            n += 1.0;
            let row = [-slope, -slope * z, 1.0 - step, step, depth[0], depth[1]];
            normal.add(row, miss, weight);
        }
        (normal, square / f64::max(n, 1.0))
    }

    /// How far from the edge a side is plain, that is a straight line within
    /// what noise explains, and that line.
    #[inline(always)]
    fn plain(
        &self,
        table: &StepTable,
        shape: &Step,
        noise: f64,
        sign: f64,
        room: f64,
    ) -> (f64, Line) {
        let height = shape.after - shape.before;
        let first = 3.0 * shape.blur;
        let mut line = Line::default();
        let mut end = first.min(room);
        while end + 2.0 <= room {
            let mut block = Line::default();
            let (near, far) = (shape.at + sign * end, shape.at + sign * (end + 2.0));
            for (distance, value, weight) in self.samples(near.min(far), near.max(far) - 1e-9) {
                let (step, _) = table.at((distance - shape.at) / shape.blur);
                let miss = value - shape.before - height * step;
                block.add(sign * (distance - shape.at), miss, weight);
            }
            if block.weight <= 0.0 {
                break;
            }
            let (expected, variance) = line.at(block.middle());
            let off = block.mean() - expected;
            let doubt = noise * noise * (variance + 1.0 / block.weight);
            // The first few pixels show the slope.
            if line.shows_slope() && off.abs() > 4.0 * doubt.sqrt() + 0.006 * height {
                break;
            }
            line.join(&block);
            end += 2.0;
        }
        (end, line)
    }
}

/// Number of the value that a share of all do not exceed.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a share of a small number"
)]
fn rank_of(count: usize, share: f32) -> usize {
    ((share * count as f32) as usize).min(count - 1)
}

#[expect(clippy::cast_precision_loss, reason = "the window is short")]
fn place(index: usize) -> f64 {
    index as f64 - REACH as f64
}

#[expect(clippy::cast_precision_loss, reason = "the window is short")]
fn place_limit() -> f64 {
    REACH as f64 - 1.0
}

/// A distance in half pixels.
#[expect(clippy::cast_possible_truncation, reason = "the window is short")]
fn halves(distance: f64) -> i16 {
    (2.0 * distance).round() as i16
}

/// Number of the sample at a whole distance, within the window.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the window"
)]
fn index(distance: f64) -> usize {
    (distance + REACH as f64).clamp(0.0, SPAN as f64) as usize
}
