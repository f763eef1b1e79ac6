//! One edge of a bead with texture, or on ground that has a pattern, from the mean profile
//! along its course.
//!
//! A search that follows the strongest step from row to row is drawn outwards by bright
//! patches of the ground, and inwards by dark ones of the bead. Here the position is
//! linear in the pixels: a pattern with a mean of zero moves it as often outwards as
//! inwards, and what remains to the second order is taken off. The course has as few
//! degrees of freedom as the gauge supports: a line, and a bend where it is certain. How
//! far a pattern moves the edge is read from the ground and the bead themselves: the same
//! weights, held against places where there is no edge.

mod weights;

use super::coarse::StepLine;
use super::number::{float, narrow, whole};
use super::rank;
use super::rough::RoughFit;
use super::step::StepTable;
use super::strip::{Grey, Strip};
use super::trace::Located;
use weights::{Samples, Weights, product};

/// Half of the window about an edge \[px\]: longer than a pattern of usual size, so that
/// the ground's level is that beside the edge.
const HALF_PX: usize = 12;
/// The same at least, and at most as a fraction of the bead's width.
const MIN_HALF_PX: usize = 5;
const HALF_FRACTION: f32 = 0.4;
/// Pixels of the longest window.
const WINDOW: usize = 2 * HALF_PX + 1;
/// Blurs that are tried \[px\]: a lens's, up to the roughness of a torn edge. A wrong one
/// does not move an edge in the middle of its window; it only lets in more noise.
pub const BLURS_PX: [f64; 7] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0];
/// Steps of the descent, the longest of them and the last \[px\].
const MAX_STEPS: usize = 12;
const LONGEST_PX: f64 = 1.5;
const LAST_PX: f64 = 1e-3;
/// How far an edge may lie from its line \[px\].
const FARTHEST_PX: f64 = 10.0;
/// How many standard deviations of what the pattern bends an edge by are a bend of the
/// edge.
const BENDS: f64 = 4.0;
/// Ground that is looked at \[px\], and bead: other things lie farther away.
const GROUND_PX: usize = 100;
const BEAD_PX: usize = 120;
/// Distance from the edge at which ground and bead are free of the flank, in blurs.
const FREE_BLURS: f64 = 4.0;
/// Bead beside the flank whose mean is its level \[px\].
const LEVEL_PX: usize = 24;
/// Columns of the ground that tell its pattern, and their distance \[px\].
const MIN_COLUMNS: usize = 6;
const COLUMN_PX: usize = 2;

/// What is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a, T> {
    /// The gauge's pixels.
    pub strip: &'a Strip<'a, T>,
    /// Its caliper lines: first row and the row after the last of each.
    pub lines: &'a [(usize, usize)],
    /// Distance of the two edges \[px\].
    pub width_px: f32,
    /// Whether the bead lies after the edge.
    pub bead_after: bool,
    /// Whether the bead is brighter than what lies outside.
    pub bright: bool,
}

impl<T: Grey> Scene<'_, T> {
    /// Last column.
    fn last(&self) -> f64 {
        float(self.strip.across - 1)
    }

    /// Where a row lies along the gauge: from −1 to 1.
    fn place(&self, row: usize) -> f64 {
        let half = 0.5 * float(self.strip.along);
        (float(row) + 0.5 - half) / half
    }

    /// Grey level at a position of a row, between its two pixels; dark beads negated.
    fn grey(&self, row: usize, at: f64) -> f64 {
        let row = self.strip.row(row);
        let before = whole(narrow(at.floor())).min(row.len() - 1);
        let after = (before + 1).min(row.len() - 1);
        let of = |pixel: T| f64::from(T::float(pixel.add_to(T::Sum::default())));
        let (one, other) = (of(row[before]), of(row[after]));
        let grey = one + (at - float(before)).clamp(0.0, 1.0) * (other - one);
        let sign = if self.bright { 1.0 } else { -1.0 };
        sign * f64::from(self.strip.scale) * grey
    }

    /// Grey levels of a row at a position and at each pixel inwards of it, between two
    /// pixels each; dark beads negated.
    #[inline(always)]
    fn read(&self, row: usize, from: f64, out: &mut [f32]) {
        let pixels = self.strip.row(row);
        let sign = if self.bright { 1.0 } else { -1.0 };
        let scale = sign * self.strip.scale;
        let of = |pixel: &T| scale * T::float(pixel.add_to(T::Sum::default()));
        let before = from.floor();
        let share = narrow(from - before);
        let reach = float(out.len());
        let (lowest, highest) = if self.bead_after {
            (before, before + reach)
        } else {
            (before + 1.0 - reach, before + 1.0)
        };
        if lowest < 0.0 || highest > self.last() {
            // Beyond the gauge its last pixel goes on.
            for (k, out) in out.iter_mut().enumerate() {
                *out = narrow(self.grey(row, from + self.inwards() * float(k)));
            }
            return;
        }
        let pixels = &pixels[whole(narrow(lowest))..=whole(narrow(highest))];
        let between = pixels.windows(2).map(|two| {
            let (one, other) = (of(&two[0]), of(&two[1]));
            one + share * (other - one)
        });
        if self.bead_after {
            out.iter_mut().zip(between).for_each(|(out, grey)| *out = grey);
        } else {
            out.iter_mut().rev().zip(between).for_each(|(out, grey)| *out = grey);
        }
    }

    /// Direction from the edge into the bead.
    fn inwards(&self) -> f64 {
        if self.bead_after { 1.0 } else { -1.0 }
    }
}

/// A course along the gauge: its mean position, and half of what it moves by from end to
/// end \[px\]; the bend is a parabola's with a mean of zero.
#[derive(Debug, Clone, Copy, Default)]
struct Bent {
    at: f64,
    tilt: f64,
    bend: f64,
}

impl Bent {
    fn at(&self, place: f64) -> f64 {
        self.at + self.tilt * place + self.bend * bend_at(place)
    }
}

/// A parabola from −1 to 1 whose mean is zero.
fn bend_at(place: f64) -> f64 {
    place * place - 1.0 / 3.0
}

/// An edge along a course; keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct MeanEdge {
    course: Bent,
    half: usize,
    lines: Vec<Option<Located>>,
    column: Vec<f64>,
    spreads: Vec<f32>,
}

/// What was found of an edge on a ground with a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanFit {
    /// What the ground makes of the edge's position, and the bead.
    pub samples: [Samples; 2],
    /// Step from the ground to the bead \[grey levels\]: the smaller of that in the window
    /// and that of all places that are looked at.
    pub contrast: f64,
    /// Level of the bead beside the edge \[grey levels\], dark beads inverted.
    pub bead_grey: f64,
}

impl MeanFit {
    /// The same as it is of an edge without a model of its flank, with the variance of
    /// its mean position \[px²\].
    pub fn as_rough(&self, blur_px: f64, variance: f64) -> RoughFit {
        RoughFit {
            variance,
            rows_fraction: 1.0,
            contrast: self.contrast,
            blur_px,
            bead_grey: self.bead_grey,
            is_groove: false,
            is_narrow_groove: false,
            is_on_ground: true,
            odd_share: 0.0,
            odd_within_share: 0.0,
            along_px: 0.0,
            lines_fraction: 1.0,
        }
    }
}

impl MeanEdge {
    /// Positions of the last frame, one a caliper line.
    pub fn lines(&self) -> &[Option<Located>] {
        &self.lines
    }

    /// Standard deviation of the ground's pattern along a line, with the noise of the
    /// pixels \[grey levels\]: the median of its columns'. `None` where too little
    /// ground lies within the gauge.
    pub fn pattern<T: Grey>(&mut self, scene: &Scene<'_, T>, line: &StepLine) -> Option<f64> {
        self.take(scene, line);
        self.spreads.clear();
        for off in (HALF_PX..GROUND_PX).step_by(COLUMN_PX) {
            self.column.clear();
            for row in 0..scene.strip.along {
                let at = self.course.at(scene.place(row)) - scene.inwards() * float(off);
                if at < 0.0 || at > scene.last() {
                    break;
                }
                self.column.push(scene.grey(row, at.round()));
            }
            if self.column.len() < scene.strip.along {
                break;
            }
            self.spreads.push(narrow(variance_about_line(&self.column)));
        }
        if self.spreads.len() < MIN_COLUMNS {
            return None;
        }
        rank::median(&mut self.spreads).map(|variance| f64::from(variance).sqrt())
    }

    fn take<T: Grey>(&mut self, scene: &Scene<'_, T>, line: &StepLine) {
        let half = 0.5 * float(scene.strip.along);
        self.course = Bent { at: line.at.into(), tilt: half * f64::from(line.slope), bend: 0.0 };
        self.half = HALF_PX.min(whole((HALF_FRACTION * scene.width_px).floor()));
    }

    /// Descends from a line to the edge beside it. Returns what a step of each of
    /// [`BLURS_PX`] leaves of its profile; infinite where there is no edge.
    pub fn approach<T: Grey>(
        &mut self,
        scene: &Scene<'_, T>,
        line: &StepLine,
        table: &StepTable,
    ) -> [f64; BLURS_PX.len()] {
        self.take(scene, line);
        let start = self.course;
        BLURS_PX.map(|blur_px| {
            self.course = start;
            let weights = Weights::new(table, blur_px, self.half);
            let found = weights.and_then(|weights| self.descend(scene, &weights, false));
            found.map_or(f64::INFINITY, |found| found.left_over)
        })
    }

    /// Locates the edge with a blur; `None` where there is none.
    pub fn locate<T: Grey>(
        &mut self,
        scene: &Scene<'_, T>,
        line: &StepLine,
        table: &StepTable,
        blur_px: f64,
    ) -> Option<MeanFit> {
        self.take(scene, line);
        let weights = Weights::new(table, blur_px, self.half)?;
        let straight = self.descend(scene, &weights, false)?;
        let free = whole(narrow((FREE_BLURS * blur_px).ceil()));
        let [ground, bead] = self.beside(scene, free, 2);
        let bends = weights.on_ground(&ground).with(weights.on_bead(&bead));
        let bends = bends.variance().sqrt() / straight.step;
        let found = if straight.bend.abs() > BENDS * bends {
            self.descend(scene, &weights, true)?
        } else {
            straight
        };
        let [ground, bead] = self.beside(scene, free, 0);
        let bead_grey = mean(&bead[..bead.len().min(LEVEL_PX)])?;
        let contrast = found.step.min(bead_grey - mean(&ground)?);
        if !weights.is_like(&ground, found.ground, found.step) {
            return None;
        }
        let samples = [weights.on_ground(&ground), weights.on_bead(&bead)];
        let samples = samples.map(|of| of.over(found.step));
        let shift = samples[0].shift() + samples[1].shift();
        self.gather(scene, &weights, &found, contrast, shift);
        (contrast > 0.0).then_some(MeanFit { samples, contrast, bead_grey })
    }

    /// Moves the course until the mean profile about it shows the edge in its middle.
    fn descend<T: Grey>(
        &mut self,
        scene: &Scene<'_, T>,
        weights: &Weights,
        bends: bool,
    ) -> Option<Descent> {
        let start = self.course.at;
        for _ in 0..MAX_STEPS {
            let means = self.means(scene, -float(self.half), 2 * self.half + 1);
            let step = weights.step(&means[0]);
            if step <= 0.0 || (self.course.at - start).abs() > FARTHEST_PX {
                return None;
            }
            let moves =
                means.each_ref().map(|mean| scene.inwards() * product(&weights.place, mean) / step);
            let is_near = moves[0].abs() < LAST_PX && moves[1].abs() < LAST_PX;
            if is_near && (!bends || moves[2].abs() < LAST_PX) {
                let left_over = weights.left_over(&means[0]);
                let ground = product(&weights.levels[0], &means[0]);
                return Some(Descent { step, ground, bend: moves[2], left_over });
            }
            let [at, tilt, bend] = moves.map(|by| by.clamp(-LONGEST_PX, LONGEST_PX));
            self.course.at += at;
            self.course.tilt += tilt;
            self.course.bend += if bends { bend } else { 0.0 };
        }
        None
    }

    /// Mean over the rows of so many pixels at distances from the course, from one inwards
    /// on, and how it changes with the course's tilt and bend.
    fn means<T: Grey>(&self, scene: &Scene<'_, T>, first: f64, pixels: usize) -> [Vec<f64>; 3] {
        let mut means: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; pixels]);
        let mut squares = [0.0; 3];
        let mut greys = vec![0.0_f32; pixels];
        for row in 0..scene.strip.along {
            let place = scene.place(row);
            scene.read(row, self.course.at(place) + scene.inwards() * first, &mut greys);
            let shares = [1.0, place, bend_at(place)];
            for ((mean, square), share) in means.iter_mut().zip(&mut squares).zip(shares) {
                *square += share * share;
                for (mean, grey) in mean.iter_mut().zip(&greys) {
                    *mean += share * f64::from(*grey);
                }
            }
        }
        for (mean, square) in means.iter_mut().zip(squares) {
            for mean in mean {
                *mean /= square.max(f64::MIN_POSITIVE);
            }
        }
        means
    }

    /// The same of ground and bead, free of the flank, as far as they lie in the gauge.
    fn beside<T: Grey>(&self, scene: &Scene<'_, T>, free: usize, term: usize) -> [Vec<f64>; 2] {
        let ends = [-1.0, 0.0, 1.0].map(|place| self.course.at(place));
        let nearest = ends.into_iter().fold(f64::INFINITY, f64::min);
        let farthest = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let room = if scene.bead_after { nearest } else { scene.last() - farthest };
        let ground_px = GROUND_PX.min(whole(narrow(room.floor()))).saturating_sub(free);
        let bead_px = BEAD_PX.min(whole(0.5 * scene.width_px)).saturating_sub(free);
        let sides = [(-float(ground_px + free), ground_px), (float(free), bead_px)];
        sides.map(|(first, pixels)| std::mem::take(&mut self.means(scene, first, pixels)[term]))
    }

    /// Positions of the caliper lines, less what all are shifted inwards by.
    fn gather<T: Grey>(
        &mut self,
        scene: &Scene<'_, T>,
        weights: &Weights,
        found: &Descent,
        contrast: f64,
        shift: f64,
    ) {
        self.lines.clear();
        let mut positions = Vec::with_capacity(scene.lines.len());
        let mut greys = [0.0_f32; WINDOW];
        for &(from, to) in scene.lines {
            let (mut aside, mut middle) = (0.0, 0.0);
            for row in from..to {
                let at = self.course.at(scene.place(row));
                middle += at / float(to - from);
                let greys = &mut greys[..=2 * self.half];
                scene.read(row, at - scene.inwards() * float(self.half), greys);
                for (weight, grey) in weights.place.iter().zip(greys) {
                    aside += weight * f64::from(*grey);
                }
            }
            let aside = aside / found.step / float(to - from) - shift;
            positions.push((middle, scene.inwards() * aside));
        }
        let squares: f64 = positions.iter().map(|(_, aside)| aside * aside).sum();
        let variance = squares / float(positions.len().max(1));
        self.lines.extend(positions.into_iter().map(|(middle, aside)| {
            Some(Located { at: middle + aside, variance, height: contrast, share: 1.0 })
        }));
    }
}

/// Where a descent ended.
#[derive(Debug, Clone, Copy)]
struct Descent {
    /// Step from the ground to the bead in the window \[grey levels\].
    step: f64,
    /// Level of the ground in the window \[grey levels\].
    ground: f64,
    /// Bend that is left \[px\].
    bend: f64,
    /// Sum of the squares that a step leaves of the profile, in that of its height.
    left_over: f64,
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / float(values.len()))
}

/// Variance of values about the straight line through them.
fn variance_about_line(values: &[f64]) -> f64 {
    let count = float(values.len());
    let middle = (count - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / count;
    let (mut square, mut across, mut along) = (0.0, 0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let place = float(k) - middle;
        square += (value - mean).powi(2);
        across += place * (value - mean);
        along += place * place;
    }
    (square - across * across / along).max(0.0) / (count - 2.0).max(1.0)
}
