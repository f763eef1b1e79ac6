//! One edge of a bead with texture, or on ground that has a pattern, from the mean profile
//! along its course.
//!
//! A search that follows the strongest step from row to row is drawn outwards by bright
//! patches of the ground, and inwards by dark ones of the bead. Here the position is
//! linear in the pixels: a pattern with a mean of zero moves it as often outwards as
//! inwards, and what remains to the second order is taken off. The course has as few
//! degrees of freedom as the gauge supports: a line, and a bend where it is certain. How far a
//! pattern moves the edge is estimated from the ground and the bead themselves: the same weights,
//! applied where there is no edge.

mod column;
mod course;
mod descent;
mod mean_edge_input;
mod weights;

use super::coarse::StepLine;
use super::curve::MIN_BEND_SIGMAS;
use super::edge_windows::MAX_SINGLE_ROWS;
use super::located::CaliperEdge;
use super::rough::RoughFit;
use super::row_range::RowRange;
use super::strip::GreyPixel;
use super::vectors;
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{narrow_to_f32, round_to_count, to_f64};
use crate::numeric::rank;
use crate::vision::buffer::refill;
use column::ColumnSums;
use course::{ParabolicCourse, bend_at};
use descent::{
    CONVERGED, DescentResult, MAX_ITERATIONS, MAX_STEP_PX, ROUGHLY_CONVERGED, StopCriterion,
};
pub use mean_edge_input::MeanInput;
use weights::{EdgeWeights, HALF_PX, ShiftSamples, WINDOW, product};

/// Half of the window about an edge at most, as a fraction of the bead's width.
const HALF_FRACTION: f32 = 0.4;
/// Blurs that are tried \[px\]: a lens's, up to the roughness of a torn edge. A wrong one
/// does not move an edge in the middle of its window; it only lets in more noise.
pub const BLURS_PX: [f64; 7] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0];
/// Index of the blur with which an edge is first located.
const USUAL_BLUR: usize = 3;
/// Largest distance between edges of different blurs in one profile \[px\].
const BLUR_SHIFT_PX: usize = 4;
/// Largest distance of an edge from the line at which its search starts \[px\].
const MAX_OFFSET_PX: f64 = 10.0;
/// Ground that is read \[px\]: other things lie farther away.
const MAX_GROUND_PX: usize = 100;
/// Bead that is read \[px\].
const MAX_BEAD_PX: usize = 120;
/// Distance from the edge at which ground and bead are free of the flank, in blurs. Derived: beyond
/// 4 blurs 3·10⁻⁵ of a step is left, 1 − Φ(4).
const FLANK_BLURS: f64 = 4.0;
/// Bead beside the flank whose mean is its level \[px\].
const LEVEL_PX: usize = 24;
/// Fewest columns of the ground that show its pattern: the median of fewer is uncertain.
const MIN_COLUMNS: usize = 6;
/// Distance of these columns \[px\]: closer ones are correlated.
const COLUMN_PX: usize = 2;

/// An edge along a course; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct MeanEdge {
    course: ParabolicCourse,
    half: usize,
    /// Positions in the last frame, one a caliper line.
    pub lines: Vec<Option<CaliperEdge>>,
    columns: Vec<ColumnSums>,
    spreads: Vec<f32>,
}

/// Fit of an edge on a ground with a pattern.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanFit {
    /// How the patterns of the ground and of the bead shift the edge.
    pub samples: [ShiftSamples; 2],
    /// Step from the ground to the bead \[grey levels\]: the smaller of the fitted step and the
    /// difference of their mean levels beside the flank.
    pub contrast: f64,
    /// Level of the bead beside the edge \[grey levels\], dark beads inverted.
    pub bead_grey: f64,
}

impl MeanFit {
    /// This fit as that of a rough edge, with its blur \[px\] and the variance of its mean position
    /// \[px²\].
    pub fn as_rough(&self, blur_px: f64, variance: f64) -> RoughFit {
        RoughFit {
            variance,
            rows_fraction: 1.0,
            contrast: self.contrast,
            blur_px,
            bead_grey: self.bead_grey,
            is_on_ground: true,
            lines_fraction: 1.0,
            ..RoughFit::default()
        }
    }
}

impl MeanEdge {
    /// Standard deviation of the ground's pattern along a line, with the noise of the
    /// pixels \[grey levels\]: the median of its columns'. `None` where too little
    /// ground lies within the gauge.
    pub fn pattern<T: GreyPixel>(
        &mut self,
        scene: &MeanInput<'_, T>,
        line: &StepLine,
    ) -> Option<f64> {
        self.start_from(scene, line);
        let rows = scene.strip.along;
        let ends = [0, rows - 1].map(|row| self.course.at(scene.normalised_position(row)));
        let room = ends.map(|at| if scene.bead_after { at } else { scene.last() - at });
        let fits = |off: &usize| to_f64(*off) <= room[0].min(room[1]);
        let count = (HALF_PX..MAX_GROUND_PX).step_by(COLUMN_PX).take_while(fits).count();
        if count < MIN_COLUMNS {
            return None;
        }
        self.columns.clear();
        self.columns.resize(count, ColumnSums::default());
        let last = scene.strip.across - 1;
        let every = if rows > MAX_SINGLE_ROWS { 2 } else { 1 };
        let seen = rows.div_ceil(every);
        for (number, row) in (0..rows).step_by(every).enumerate() {
            let position = to_f64(number) - 0.5 * to_f64(seen - 1);
            let at =
                self.course.at(scene.normalised_position(row)) - scene.inwards() * to_f64(HALF_PX);
            let nearest = round_to_count(narrow_to_f32(at)).min(last);
            let pixels = scene.strip.row(row);
            for (column, off) in self.columns.iter_mut().zip((0..).step_by(COLUMN_PX)) {
                let at = if scene.bead_after {
                    nearest.saturating_sub(off)
                } else {
                    (nearest + off).min(last)
                };
                column
                    .add(position, f64::from(T::sum_to_f32(pixels[at].add_to(T::Sum::default()))));
            }
        }
        let variances = self.columns.iter().map(|of| narrow_to_f32(of.variance_about_line(seen)));
        refill(&mut self.spreads, variances);
        let variance = rank::median(&mut self.spreads)?;
        Some(f64::from(scene.strip.scale * variance.sqrt()))
    }

    fn start_from<T: GreyPixel>(&mut self, scene: &MeanInput<'_, T>, line: &StepLine) {
        let half = 0.5 * to_f64(scene.strip.along);
        self.course =
            ParabolicCourse { at: line.at.into(), tilt: half * f64::from(line.slope), bend: 0.0 };
        self.half = HALF_PX.min(round_to_count((HALF_FRACTION * scene.width_px).floor()));
    }

    /// Moves the course from a line to the edge beside it. Returns the residual of its profile for
    /// a step of each of [`BLURS_PX`]; infinite where there is no edge.
    pub fn fit_blurs<T: GreyPixel>(
        &mut self,
        scene: &MeanInput<'_, T>,
        line: &StepLine,
        table: &StepTable,
    ) -> [f64; BLURS_PX.len()] {
        self.start_from(scene, line);
        let weights = BLURS_PX.map(|blur_px| EdgeWeights::new(table, blur_px, self.half));
        let usual = weights.iter().flatten().take(USUAL_BLUR + 1).last();
        let is_found =
            usual.is_some_and(|usual| self.descend(scene, usual, ROUGHLY_CONVERGED).is_some());
        // Another blur changes the position within the profile, and hardly its direction.
        let reach = self.half + BLUR_SHIFT_PX;
        let [profile, ..] = self.means(scene, -to_f64(reach), 2 * reach + 1);
        weights.map(|weights| {
            let weights = weights.filter(|_| is_found);
            weights.and_then(|weights| weights.residual_at_edge(&profile)).unwrap_or(f64::INFINITY)
        })
    }

    /// Locates the edge near the course with a blur \[px\]; `None` where there is none.
    pub fn locate<T: GreyPixel>(
        &mut self,
        scene: &MeanInput<'_, T>,
        table: &StepTable,
        blur_px: f64,
    ) -> Option<MeanFit> {
        let weights = EdgeWeights::new(table, blur_px, self.half)?;
        let straight = self.descend(scene, &weights, CONVERGED)?;
        let free = round_to_count(narrow_to_f32((FLANK_BLURS * blur_px).ceil()));
        let mut beside = self.side_profiles(scene, free);
        let [_, _, ground] = &beside.ground;
        let [_, _, bead] = &beside.bead;
        let bends = weights.on_ground(ground).with(weights.on_bead(bead));
        let bends = bends.variance().sqrt() / straight.step;
        let mut found = straight;
        if straight.bend.abs() > MIN_BEND_SIGMAS * bends {
            found = self.descend(scene, &weights, StopCriterion { bends: true, ..CONVERGED })?;
            beside = self.side_profiles(scene, free);
        }
        let ([ground, ..], [bead, ..]) = (&beside.ground, &beside.bead);
        let bead_grey = mean(&bead[..bead.len().min(LEVEL_PX)])?;
        let contrast = found.step.min(bead_grey - mean(ground)?);
        if !weights.is_ground_level(ground, found.ground, found.step) {
            return None;
        }
        let samples = [weights.on_ground(ground), weights.on_bead(bead)];
        let samples = samples.map(|of| of.over(found.step));
        let shift = samples[0].shift() + samples[1].shift();
        self.locate_lines(scene, &weights, &found, contrast, shift);
        (contrast > 0.0).then_some(MeanFit { samples, contrast, bead_grey })
    }

    /// Moves the course until the mean profile about it shows the edge in its middle.
    fn descend<T: GreyPixel>(
        &mut self,
        scene: &MeanInput<'_, T>,
        weights: &EdgeWeights,
        goal: StopCriterion,
    ) -> Option<DescentResult> {
        let start = self.course.at;
        for _ in 0..MAX_ITERATIONS {
            let means = self.means(scene, -to_f64(self.half), 2 * self.half + 1);
            let step = weights.step(&means[0]);
            if step <= 0.0 || (self.course.at - start).abs() > MAX_OFFSET_PX {
                return None;
            }
            let moves = means
                .each_ref()
                .map(|mean| scene.inwards() * product(&weights.position, mean) / step);
            let unknowns = if goal.bends { &moves[..] } else { &moves[..2] };
            if unknowns.iter().all(|by| by.abs() < goal.last_px) {
                let ground = product(&weights.levels[0], &means[0]);
                return Some(DescentResult { step, ground, bend: moves[2] });
            }
            let [at, tilt, bend] = moves.map(|by| by.clamp(-MAX_STEP_PX, MAX_STEP_PX));
            self.course.at += at;
            self.course.tilt += tilt;
            self.course.bend += if goal.bends { bend } else { 0.0 };
        }
        None
    }

    /// Mean profile over the rows, `count` pixels from the distance `first` inwards of the course
    /// on, and how it changes with the course's tilt and bend.
    fn means<T: GreyPixel>(&self, scene: &MeanInput<'_, T>, first: f64, count: usize) -> Profiles {
        // The lowest position of the profile, which inwards of a right edge is its last.
        let reach = if scene.bead_after { 0.0 } else { to_f64(count.saturating_sub(1)) };
        let lowest = scene.inwards() * first - reach;
        let mut sums: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; count]);
        let mut squares = [0.0; 3];
        let mut greys = vec![0.0; count + 1];
        vectors::widest(
            #[inline(always)]
            || {
                for row in 0..scene.strip.along {
                    let position = scene.normalised_position(row);
                    let fractions = [1.0, position, bend_at(position)];
                    for (square, fraction) in squares.iter_mut().zip(fractions) {
                        *square += fraction * fraction;
                    }
                    let between = scene.fetch(row, self.course.at(position) + lowest, &mut greys);
                    add_row(&mut sums, &greys, between, fractions.map(narrow_to_f32));
                }
            },
        );
        if !scene.bead_after {
            for sums in &mut sums {
                sums.reverse();
            }
        }
        let scale = scene.sign() * f64::from(scene.strip.scale);
        let mut squares = squares.iter();
        sums.map(|sums| {
            let square = squares.next().map_or(1.0, |square| square.max(f64::MIN_POSITIVE));
            sums.into_iter().map(|sum| scale * f64::from(sum) / square).collect()
        })
    }

    /// Mean profiles of ground and bead, from `free` pixels beside the edge on, within the gauge.
    fn side_profiles<T: GreyPixel>(&self, scene: &MeanInput<'_, T>, free: usize) -> SideProfiles {
        let ends = [-1.0, 0.0, 1.0].map(|position| self.course.at(position));
        let nearest = ends.into_iter().fold(f64::INFINITY, f64::min);
        let farthest = ends.into_iter().fold(f64::NEG_INFINITY, f64::max);
        let room = if scene.bead_after { nearest } else { scene.last() - farthest };
        let ground_px =
            MAX_GROUND_PX.min(round_to_count(narrow_to_f32(room.floor()))).saturating_sub(free);
        let bead_px = MAX_BEAD_PX.min(round_to_count(0.5 * scene.width_px)).saturating_sub(free);
        SideProfiles {
            ground: self.means(scene, -to_f64(ground_px + free), ground_px),
            bead: self.means(scene, to_f64(free), bead_px),
        }
    }

    /// Positions of the caliper lines, corrected by `shift`, the common shift inwards \[px\].
    fn locate_lines<T: GreyPixel>(
        &mut self,
        scene: &MeanInput<'_, T>,
        weights: &EdgeWeights,
        found: &DescentResult,
        contrast: f64,
        shift: f64,
    ) {
        self.lines.clear();
        let mut positions = Vec::with_capacity(scene.lines.len());
        let mut greys = [0.0; WINDOW + 1];
        let greys = &mut greys[..=weights.pixels];
        // In the order of the pixels of a row.
        let mut position = weights.position;
        if !scene.bead_after {
            position[..weights.pixels].reverse();
        }
        let per_grey = scene.sign() * f64::from(scene.strip.scale) / found.step;
        for &RowRange { first: from, end: to } in scene.lines {
            let (mut aside, mut middle) = (0.0, 0.0);
            for row in from..to {
                let at = self.course.at(scene.normalised_position(row));
                middle += at / to_f64(to - from);
                let between = scene.fetch(row, at - to_f64(self.half), greys);
                for (weight, pixels) in position.iter().zip(greys.windows(2)) {
                    aside += weight * f64::from(pixels[0] + between * (pixels[1] - pixels[0]));
                }
            }
            let aside = per_grey * aside / to_f64(to - from) - shift;
            positions.push((middle, scene.inwards() * aside));
        }
        let squares: f64 = positions.iter().map(|(_, aside)| aside * aside).sum();
        let variance = squares / to_f64(positions.len().max(1));
        self.lines.extend(positions.into_iter().map(|(middle, aside)| {
            Some(CaliperEdge { at: middle + aside, variance, height: contrast, row_fraction: 1.0 })
        }));
    }
}

/// Mean profile across an edge, outermost pixel first, and how it changes with the
/// course's tilt and bend \[grey levels\].
type Profiles = [Vec<f64>; 3];

/// Mean profiles of ground and bead beside an edge.
#[derive(Debug)]
struct SideProfiles {
    ground: Profiles,
    bead: Profiles,
}

/// Adds a row, interpolated between its pixels, to the sums, times the row's fractions.
#[inline(always)]
fn add_row(sums: &mut [Vec<f32>; 3], pixels: &[f32], between: f32, fractions: [f32; 3]) {
    let [mean, tilt, bend] = sums;
    let pairs = pixels.iter().zip(&pixels[1..]);
    for (((mean, tilt), bend), (one, other)) in mean.iter_mut().zip(tilt).zip(bend).zip(pairs) {
        let grey = one + between * (other - one);
        *mean += fractions[0] * grey;
        *tilt += fractions[1] * grey;
        *bend += fractions[2] * grey;
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / to_f64(values.len()))
}
