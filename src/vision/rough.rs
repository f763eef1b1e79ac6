//! One edge of a bead whose edges are torn, or lie beside a groove or in
//! texture: where it runs, row by row, without a model of its flank.
//!
//! The mean over the rows is what this edge adds to the width. The profile along
//! the bead is signal (the bead's roughness); only pixel noise and texture are
//! errors of the mean.
//!
//! ```text
//! window          rows about the edge, turned so that the bead lies after it and is bright
//! route           the course with the strongest step, by dynamic programming
//! mean_profile    mean profile across the edge: bead, ground or groove
//! levels          grey of the bead and of what lies outside, along the route
//! crossing        where each row passes from the one to the other
//! position_noise  standard deviation of the mean position
//! ```

mod crossing;
mod groove;
mod kernel;
mod levels;
mod mean_profile;
mod position_noise;
mod rough_input;
mod route;
mod window;

use super::coarse::StepLine;
use super::located::{self, CaliperEdge};
use super::strip::GreyPixel;
use crate::numeric::number::{narrow_to_f32, to_f64};
use crossing::SUMMED_INSIDE_PX;
use groove::GrooveShape;
pub use groove::MeanBlur;
use levels::{Crossings, EdgeLevels};
use mean_profile::OUTSIDE_PX;
pub use rough_input::RoughInput;
use route::EdgeRoute;
use window::{ALONG_PX, RowWindows, STRAIGHT_ROWS};

/// Rounds in which levels are read along the edge that was found with the levels
/// before.
const ROUNDS: usize = 3;
/// Fraction of the rows of a caliper line that must show the edge.
const MIN_ROWS_FRACTION: f64 = 0.5;

/// Prior of an edge's blur: lenses that are nearly in focus, and roughness too fine to be followed.
const PRIOR_BLUR: MeanBlur = MeanBlur { px: 1.8, variance: 1.0 };
/// Relative difference between the blurs of two edges, as a standard deviation.
const BLUR_DIFFERENCE: f64 = 0.02;
/// Uncertainty of the roughness too fine to be followed, as a fraction of it.
const FINE_ROUGHNESS_FRACTION: f64 = 0.2;

/// Probability of a groove that hides its depth from which on the edge is located beside it.
const MIN_LIKELY_GROOVE: f64 = 0.18;
/// Probability of such a groove from which on the uncertainty of its shape counts.
const MIN_POSSIBLE_GROOVE: f64 = 0.085;
/// Probability of such a groove from which on the shape of the whole flank counts as well, where
/// that lies far from where rows pass half height: of drawn edges beside weak narrow grooves, some
/// that were taken for sloping ground lay 0.7 px off.
const MIN_CONCEIVABLE_GROOVE: f64 = 0.03;
/// That distance \[px\].
const MAX_SHAPE_OFFSET_PX: f64 = 0.5;

/// Standard deviation of an edge beside a groove that hides its depth, as a fraction of that of the
/// edge's waves: the mean over waves is no Gaussian flank. Found on 12,000 rendered beads.
const GROOVE_WAVINESS_FRACTION: f64 = 0.15;
/// Largest value of that standard deviation \[px\].
const MAX_GROOVE_WAVINESS_PX: f64 = 0.15;
/// That fraction beside a groove that shows its depth and is narrow. Measured:
/// reference/accuracy.md, Drawn frames (`grooves`): without it 3.5 of 30,000 widths were more than
/// 5 sigma off, with it 2.5.
const NARROW_GROOVE_WAVINESS_FRACTION: f64 = 0.06;
/// Widest groove that is narrow in this sense \[px\].
const MAX_NARROW_GROOVE_PX: f64 = 7.5;

/// Standard deviation, beside that of noise, of the crossing of half height as the edge beside a
/// groove \[px\]: the groove's floor may be hidden, and torn edges have no Gaussian flank.
/// Measured: reference/accuracy.md, What the parts bring: averaged with the groove's shape by their
/// variances, the same piece of real concrete differs from frame to frame by 0.33 px in the median,
/// with the shape alone by 0.36.
const GROOVE_CROSSING_SIGMA_PX: f64 = 0.5;

/// Difference of the bead's level beside the edge from that farther inside, in standard deviations
/// of the change by light, from which on the level beside the edge is used.
const MIN_LEVEL_SIGMAS: f64 = 0.5;
/// Standard deviation of the shift by that level, as a fraction of it.
const SHIFT_FRACTION: f64 = 0.2;
/// Largest distance of the shape then, in shifts that such a difference makes over the pixels
/// summed inside the edge: a flank that is no blurred step lies farther.
const MAX_LEVEL_SHIFT: f64 = 2.0;

/// Finds one edge; keeps its buffers from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct RoughEdge {
    windows: RowWindows,
    route: EdgeRoute,
    levels: EdgeLevels,
    crossings: Crossings,
    /// Positions in the last frame, one a caliper line.
    pub lines: Vec<Option<CaliperEdge>>,
    /// Variance of the mean profile \[grey levels²\].
    profile_variance: f64,
    /// Shape of the mean profile.
    shape: Option<GrooveShape>,
}

/// Fit of a rough edge.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RoughFit {
    /// Variance of the mean position over the gauge \[px²\].
    pub variance: f64,
    /// Fraction of the rows that show the edge.
    pub rows_fraction: f64,
    /// Step from outside to the bead \[grey levels\], positive.
    pub contrast: f64,
    /// Standard deviation of the Gaussian that has the flank's slope \[px\].
    pub blur_px: f64,
    /// Level of the bead beside the edge \[grey levels\], dark beads inverted.
    pub bead_grey: f64,
    /// Whether a groove lies outside.
    pub is_groove: bool,
    /// Whether it is too narrow to show how dark it is.
    pub is_narrow_groove: bool,
    /// Whether what lies outside is as wide as ground.
    pub is_on_ground: bool,
    /// Fraction of the pixels about the edge that show neither the bead nor what lies
    /// outside.
    pub odd_fraction: f64,
    /// That fraction in the bead farther inside, by its texture.
    pub odd_fraction_within: f64,
    /// Standard deviation of the smoothing along the bead \[px\].
    pub along_px: f64,
    /// Fraction of the lines' variance that differs from line to line.
    pub lines_fraction: f64,
}

impl RoughFit {
    /// Whether the fraction of odd pixels about the edge exceeds that of the bead's texture by more
    /// than `by`.
    pub fn exceeds_texture(&self, by: f64) -> bool {
        self.odd_fraction > self.odd_fraction_within + by
    }
}

impl RoughEdge {
    /// Mean of the positions across the bead \[px\].
    pub fn middle(&self) -> f64 {
        located::mean_position(&self.lines)
    }

    /// Finds where the edge runs near a line, and the shape of its mean profile; [`Self::locate`]
    /// gives its positions. `None` where no edge runs there.
    #[inline(always)]
    pub fn find<T: GreyPixel>(&mut self, scene: &RoughInput<'_, T>, line: &StepLine) -> Option<()> {
        self.windows.read(scene, line);
        self.route.find(&self.windows, scene.width_px)?;
        for round in 1..=ROUNDS {
            self.levels.read(&self.windows, self.route.rows(), scene)?;
            let every = if round == ROUNDS { 1 } else { STRAIGHT_ROWS };
            self.levels.cross(&self.windows, self.route.rows(), every, &mut self.crossings);
            if round == ROUNDS {
                self.levels.describe(&self.windows, self.route.rows(), &mut self.crossings);
            }
            self.route.follow(&self.crossings.at)?;
        }
        self.profile_variance = position_noise::profile_variance(&self.levels)?;
        self.shape = self.fit_shape(PRIOR_BLUR, scene, None);
        Some(())
    }

    /// Blur of the edge that was found.
    pub fn blur(&self) -> Option<MeanBlur> {
        let fine = FINE_ROUGHNESS_FRACTION
            * position_noise::fine_roughness(&self.crossings, self.windows.fine());
        self.shape.map(|shape| {
            let MeanBlur { px, variance } = shape.blur;
            let other = (BLUR_DIFFERENCE * px).powi(2) + (0.5 * fine / px).powi(2);
            MeanBlur { px, variance: variance + other }
        })
    }

    /// Where the edge that was found lies. `other` is the blur of the other edge, which is
    /// seen through the same lens.
    #[inline(always)]
    pub fn locate<T: GreyPixel>(
        &mut self,
        scene: &RoughInput<'_, T>,
        other: Option<MeanBlur>,
    ) -> Option<RoughFit> {
        let mean = self.levels.mean.as_ref()?;
        let (is_groove, on_ground) = (mean.is_groove(), mean.on_ground);
        let (bead_grey, hides_depth) = (mean.bead(), mean.filled > 0.0);
        let known = other.filter(|blur| blur.variance < PRIOR_BLUR.variance);
        let shape = known.and_then(|blur| self.fit_shape(blur, scene, self.shape)).or(self.shape);
        let is_groove_likely =
            shape.is_some_and(|shape| shape.groove_probability > MIN_LIKELY_GROOVE);
        let noise = position_noise::of_mean(&self.windows, &self.levels, &self.crossings, scene)?;
        // Where a rib or a shadow lies within, only the level beside the edge is the bead's.
        let off = |shape: &GrooveShape| shape.at - to_f64(OUTSIDE_PX) - self.crossings.off_course;
        let contrast = self.levels.contrast();
        let of_level = |shape: &GrooveShape| {
            let level = shape.level_off * groove::BEAD_SIGMA * bead_grey / contrast;
            shape.level_off > MIN_LEVEL_SIGMAS
                && off(shape).abs() < MAX_LEVEL_SHIFT * level * f64::from(SUMMED_INSIDE_PX)
        };
        let shaped = shape.filter(|shape| is_groove_likely || of_level(shape));
        let is_narrow =
            !on_ground && shape.is_some_and(|shape| shape.width() < MAX_NARROW_GROOVE_PX);
        let waves = || position_noise::roughness(&self.crossings).sqrt();
        let of_waves = if hides_depth {
            (GROOVE_WAVINESS_FRACTION * waves()).min(MAX_GROOVE_WAVINESS_PX).powi(2)
        } else if is_narrow {
            (NARROW_GROOVE_WAVINESS_FRACTION * waves()).powi(2)
        } else {
            0.0
        };
        let of_crossing = noise.of_mean + GROOVE_CROSSING_SIGMA_PX.powi(2);
        let weight_of = |shape: GrooveShape| {
            if on_ground { 1.0 } else { of_crossing / (of_crossing + shape.variance + of_waves) }
        };
        let shift = shaped.map_or(0.0, |shape| weight_of(shape) * off(&shape));
        for at in &mut self.crossings.at {
            *at += narrow_to_f32(shift);
        }
        let of_shape = |shape: GrooveShape| {
            if is_groove_likely {
                let (weight, of_groove) = (weight_of(shape), shape.variance + of_waves);
                let rest = 1.0 - weight;
                // Both come from the same pixels and read them differently: a correlation of a
                // half.
                let common = weight * rest * (of_groove * of_crossing).sqrt();
                return weight * weight * of_groove + rest * rest * of_crossing + common;
            }
            shape.variance.max(noise.of_mean) + (SHIFT_FRACTION * shift).powi(2)
        };
        let variance_of_alternatives = |shape: GrooveShape| {
            let is_possible = shape.groove_probability > MIN_POSSIBLE_GROOVE;
            let is_far = shape.groove_probability > MIN_CONCEIVABLE_GROOVE
                && off(&shape).abs() > MAX_SHAPE_OFFSET_PX;
            let of_place = if is_possible { shape.variance } else { 0.0 };
            of_place + if is_far { off(&shape).powi(2) } else { 0.0 }
        };
        let variance_without_shape = shape.map_or(0.0, variance_of_alternatives).max(noise.of_mean);
        self.locate_lines(scene, noise.of_row);
        let seen = self.crossings.at.iter().filter(|at| at.is_finite()).count();
        Some(RoughFit {
            variance: shaped.map_or(variance_without_shape, of_shape),
            rows_fraction: to_f64(seen) / to_f64(self.crossings.at.len()),
            contrast,
            blur_px: noise.blur_px,
            bead_grey,
            is_groove,
            is_narrow_groove: is_groove_likely,
            is_on_ground: on_ground,
            odd_fraction: position_noise::mean_of(&self.crossings.odd),
            odd_fraction_within: position_noise::mean_of(&self.crossings.odd_within),
            along_px: ALONG_PX,
            lines_fraction: noise.lines_fraction,
        })
    }

    /// Fits a groove or a step to the mean profile.
    fn fit_shape<T>(
        &self,
        blur: MeanBlur,
        scene: &RoughInput<'_, T>,
        before: Option<GrooveShape>,
    ) -> Option<GrooveShape> {
        let known = groove::GroovePrior {
            table: scene.table,
            variance: self.profile_variance,
            blur,
            edge: scene.edge,
            roughness: position_noise::roughness(&self.crossings),
            before,
        };
        groove::fit(self.levels.mean.as_ref()?, &known)
    }

    /// Positions of the caliper lines from those of their rows.
    fn locate_lines<T: GreyPixel>(&mut self, scene: &RoughInput<'_, T>, variance_of_row: f64) {
        let (windows, crossings) = (&self.windows, &self.crossings.at);
        let height = self.levels.contrast();
        self.lines.clear();
        let mut next = 0;
        for line in 0..scene.lines.len() {
            let (mut sum, mut seen, mut rows) = (0.0, 0.0, 0.0);
            while next < windows.rows.len() && windows.lines[next] == line {
                let weight = windows.rows_of(next);
                rows += weight;
                if let Some(at) = windows.position(next, crossings[next]) {
                    // Rows that are missing on one side of the line's middle
                    // must not slant it.
                    sum += weight * at;
                    seen += weight;
                }
                next += 1;
            }
            let located = (seen >= MIN_ROWS_FRACTION * rows && seen > 0.0).then(|| CaliperEdge {
                at: sum / seen,
                variance: variance_of_row / seen,
                height,
                row_fraction: seen / rows,
            });
            self.lines.push(located);
        }
    }
}
