//! Beads that have a texture, or lie on ground that has a pattern.

use super::checks::{COMPLETE_FRACTION, edge_positions};
use super::model_selection::has_grains;
use super::pattern_limits::{
    MAX_PATTERN, MAX_PATTERN_BESIDE_COMPLETE, blur_inflation, check_pattern, with_texture_variance,
};
use super::uniformity;
use super::work::{GaugeFrame, MIN_LINE_FRACTION, MeasureState, Outcome};
use crate::numeric::number::to_f64;
use crate::vision::coarse::{LinePair, StepLine};
use crate::vision::ground::{EdgePosition, EdgeSide, MIN_EXCESS_VARIANCE};
use crate::vision::mean_edge::{BLURS_PX, MeanInput};
use crate::vision::reject::{Checked, Reject};
use crate::vision::row_range::RowRange;
use crate::vision::strip::{GaugeRows, GreyPixel};
use crate::vision::trace::EdgeTracer;

/// Weakest pattern, as a fraction of the contrast, beside which blurred steps are not good enough:
/// a weaker one draws them outwards by hardly 0.02 px.
const MIN_PATTERN: f64 = 0.06;
/// Weakest texture of the bead that counts, as a fraction of the contrast. Measured:
/// reference/accuracy.md, The sets: sparks over 5 % of a smooth bead (`spots`) look like up to
/// 0.12.
const MIN_TEXTURE: f64 = 0.13;
/// Smallest ratio of the weaker to the stronger texture beside the two edges of one bead.
const MIN_TEXTURE_RATIO: f64 = 0.4;
/// Smallest texture half-way between two lines, as a fraction of the smallest beside them.
const MIDDLE_TEXTURE_RATIO: f32 = 0.5;
/// Blur that is assumed while a flank is not known \[px\]: texture is read beyond it.
const ASSUMED_BLUR_PX: f64 = 3.0;
impl MeasureState {
    /// Standard deviation of the pattern that the ground has on both sides of a pair of
    /// lines \[grey levels\]; 0 where one side has none: what is on one side alone is a
    /// groove or a neighbour.
    pub fn ground_pattern<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        pair: &LinePair,
    ) -> f64 {
        let noise = f64::from(self.rows.noise.grey);
        let mut least = f64::INFINITY;
        let sides = self.mean_edges.iter_mut().zip(&pair.sides);
        for ((edge, line), bead_after) in sides.zip([true, false]) {
            let scene = scene(strip, &self.rows.lines, pair, bead_after);
            least = least.min(edge.pattern(&scene, line).unwrap_or(0.0));
        }
        let variance = least * least;
        if variance > (1.0 + MIN_EXCESS_VARIANCE) * noise * noise {
            (variance - noise * noise).sqrt()
        } else {
            0.0
        }
    }

    /// Measures a bead whose texture shows before any edge is located. `None` where no texture
    /// shows, where the ground has a pattern too, and where grains may lie on its edges.
    #[inline(never)]
    pub fn measure_busy<T: GreyPixel>(&mut self, frame: &GaugeFrame<'_, T>) -> Option<Outcome> {
        let pair = self.find_lines(frame).ok()?;
        if !self.is_textured_between_lines(frame.strip, &pair) {
            return None;
        }
        let pattern = self.ground_pattern(frame.strip, &pair);
        if let Some(found) = self.measure_patterned((&pair, pattern), frame) {
            return (pattern == 0.0).then_some(found);
        }
        let fits = self.fit_rough(frame.strip, &pair).ok()?;
        if fits.iter().any(has_grains) {
            return None;
        }
        let fits = with_texture_variance(&pair, fits);
        Some(self.width_of_rough_beside(pattern, true, &fits, frame))
    }

    /// Measures a bead again where it or the ground has a pattern. `None` where neither has one, or
    /// only a weak one, and where the mean profile shows no edges and the pattern is accepted
    /// beside blurred steps.
    #[inline(never)]
    pub fn measure_texture<T: GreyPixel>(&mut self, frame: &GaugeFrame<'_, T>) -> Option<Outcome> {
        let fractions = self.texture_between_steps(frame.strip);
        let is_textured = rms(fractions) > MIN_TEXTURE;
        if !is_textured && self.both.pattern_ratio == 0.0 {
            return None;
        }
        let Ok(pair) = self.find_lines(frame) else {
            return self.check_complete(is_textured && are_alike(fractions)).err().map(Err);
        };
        let pattern = self.ground_pattern(frame.strip, &pair);
        let contrast = self.both.contrasts[0].min(self.both.contrasts[1]);
        if !is_textured && pattern < MIN_PATTERN * contrast {
            return None;
        }
        let found = self.measure_patterned((&pair, pattern), frame);
        if found.is_some() {
            return found;
        }
        let is_whole =
            self.left.used_fraction().min(self.right.used_fraction()) > COMPLETE_FRACTION;
        let checked = if is_whole {
            self.check_complete(is_textured)
        } else {
            check_pattern(pattern / contrast, is_textured)
        };
        checked.err().map(Err)
    }

    /// Refuses the blurred steps of a plain bead that show all along it, beside a strong pattern on
    /// both sides.
    fn check_complete(&self, is_textured: bool) -> Checked {
        let (got, limit) = (self.both.pattern_ratio, MAX_PATTERN_BESIDE_COMPLETE);
        if !is_textured && got > limit { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
    }

    /// Standard deviation of the bead's texture beside either of two blurred steps, as a
    /// fraction of its contrast.
    fn texture_between_steps<T: GreyPixel>(&mut self, strip: &GaugeRows<'_, T>) -> [f64; 2] {
        let sides = [(&self.left, 1.0), (&self.right, -1.0)];
        let room_px = self.right.middle() - self.left.middle();
        let noise = self.rows.noise.grey.into();
        let mut fractions = [0.0; 2];
        for (((tracer, inwards), contrast), fraction) in
            sides.into_iter().zip(self.both.contrasts).zip(&mut fractions)
        {
            all_edge_positions(tracer, &self.rows.lines, &mut self.scratch.positions);
            let blur_px = tracer.blur_px;
            let positions = &self.scratch.positions;
            let side = EdgeSide { strip, noise, positions, outwards: inwards, blur_px, room_px };
            let texture = self.scratch.ground.texture(&side);
            *fraction = texture.unwrap_or(0.0) / contrast;
        }
        fractions
    }

    /// Whether a texture shows beside both of two lines, and half-way between them: lines in the
    /// ground's pattern have texture beside them, and a plain bead between.
    pub fn is_textured_between_lines<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        pair: &LinePair,
    ) -> bool {
        let [left, right] = pair.sides;
        let middle = StepLine {
            at: f32::midpoint(left.at, right.at),
            slope: f32::midpoint(left.slope, right.slope),
            step: MIDDLE_TEXTURE_RATIO * left.step.min(right.step),
        };
        let width_px = pair.width_px();
        [(left, 1.0), (right, -1.0), (middle, 1.0), (middle, -1.0)]
            .iter()
            .all(|(line, inwards)| self.is_textured_beside(strip, line, *inwards, width_px))
    }

    /// Whether a texture that is strong for the step of a line shows on one side of it.
    fn is_textured_beside<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        line: &StepLine,
        inwards: f64,
        width_px: f32,
    ) -> bool {
        let middle = 0.5 * (to_f64(strip.along) - 1.0);
        self.scratch.positions.clear();
        self.scratch.positions.extend(self.rows.lines.iter().map(|&rows| {
            let off = rows.middle() - middle;
            EdgePosition { rows, at: f64::from(line.at) + off * f64::from(line.slope) }
        }));
        let side = EdgeSide {
            strip,
            noise: self.rows.noise.grey.into(),
            positions: &self.scratch.positions,
            outwards: inwards,
            blur_px: ASSUMED_BLUR_PX,
            room_px: width_px.into(),
        };
        let texture = self.scratch.ground.texture(&side);
        texture.is_some_and(|texture| texture > MIN_TEXTURE * f64::from(line.step))
    }

    /// Measures a bead by its mean profile, near two lines and beside a pattern with a standard
    /// deviation \[grey levels\]; `None` where the mean profile shows no edges, and beside a
    /// groove.
    pub fn measure_patterned<T: GreyPixel>(
        &mut self,
        lines: (&LinePair, f64),
        frame: &GaugeFrame<'_, T>,
    ) -> Option<Outcome> {
        if lines.0.has_groove() {
            return None;
        }
        let found = self.measure_mean_profile(lines, frame);
        (!matches!(found, Err(Reject::NoPair { .. }))).then_some(found)
    }

    fn measure_mean_profile<T: GreyPixel>(
        &mut self,
        (pair, pattern): (&LinePair, f64),
        frame: &GaugeFrame<'_, T>,
    ) -> Outcome {
        let failed = Reject::NoPair { got: 0.0, need: MIN_LINE_FRACTION };
        let scenes = [true, false].map(|after| scene(frame.strip, &self.rows.lines, pair, after));
        let [left, right] = &mut self.mean_edges;
        let lens = self.blur_shapes.lens();
        let of_left = left.fit_blurs(&scenes[0], &pair.sides[0], lens);
        let of_right = right.fit_blurs(&scenes[1], &pair.sides[1], lens);
        // Both edges are seen through one lens.
        let left_over = |k: &usize| of_left[*k] + of_right[*k];
        let best = (0..BLURS_PX.len()).min_by(|a, b| left_over(a).total_cmp(&left_over(b)));
        let blur_px = best.filter(|k| left_over(k).is_finite()).map(|k| BLURS_PX[k]);
        let blur_px = blur_px.ok_or(failed)?;
        let one = left.locate(&scenes[0], lens, blur_px).ok_or(failed)?;
        let other = right.locate(&scenes[1], lens, blur_px).ok_or(failed)?;
        let got = pattern / one.contrast.min(other.contrast);
        if got > MAX_PATTERN {
            return Err(Reject::Patterned { got, limit: MAX_PATTERN });
        }
        let ground = one.samples[0].with(other.samples[0]).variance();
        let bead = one.samples[1].with(other.samples[1]).variance();
        if !(ground + bead).is_finite() {
            return Err(failed);
        }
        // An edge beside a strong pattern is drawn to its bright positions.
        let beside = ground * (1.0 + (got / MAX_PATTERN).powi(4)) + bead;
        // A flank's slope falls with its blur, and so texture moves an edge by more.
        let inflation = blur_inflation(blur_px);
        let variance = beside * if pattern > 0.0 { inflation } else { inflation * inflation };
        let fits = [one, other].map(|fit| fit.as_rough(blur_px, variance));
        uniformity::check_uniformity(&fits, uniformity::middle_grey(frame.strip, pair))?;
        self.left_px.clear();
        self.right_px.clear();
        let [left, right] = &self.mean_edges;
        self.left.take_rough(&left.lines, &fits[0]);
        self.right.take_rough(&right.lines, &fits[1]);
        self.check_contrast()?;
        self.check_boundary(frame.strip.across)?;
        self.width_on_surface(frame.view, frame.surface)
    }
}

/// Root of the mean square of the fractions of both sides.
fn rms([left, right]: [f64; 2]) -> f64 {
    f64::midpoint(left * left, right * right).sqrt()
}

/// Whether a bead has the same texture beside both edges: one of them may lie in the ground's
/// pattern.
fn are_alike([left, right]: [f64; 2]) -> bool {
    left.min(right) >= MIN_TEXTURE_RATIO * left.max(right)
}

/// Positions of an edge on all caliper lines, interpolated where it is not located.
fn all_edge_positions(tracer: &EdgeTracer, lines: &[RowRange], places: &mut Vec<EdgePosition>) {
    edge_positions(tracer, lines, places);
    if places.len() == lines.len() {
        return;
    }
    let located: Vec<(f64, f64)> =
        places.iter().map(|position| (position.rows.middle(), position.at)).collect();
    let (Some(first), Some(last)) = (located.first(), located.last()) else { return };
    places.clear();
    places.extend(lines.iter().map(|&rows| {
        let row = rows.middle();
        let after = located.partition_point(|position| position.0 < row);
        let (one, other) =
            (located[..after].last().unwrap_or(first), located[after..].first().unwrap_or(last));
        let fraction = if other.0 > one.0 { (row - one.0) / (other.0 - one.0) } else { 0.0 };
        EdgePosition { rows, at: one.1 + fraction * (other.1 - one.1) }
    }));
}

/// Input of the mean profile for one edge of a pair.
fn scene<'a, T: GreyPixel>(
    strip: &'a GaugeRows<'a, T>,
    lines: &'a [RowRange],
    pair: &LinePair,
    bead_after: bool,
) -> MeanInput<'a, T> {
    MeanInput { strip, lines, width_px: pair.width_px(), bead_after, bright: pair.bright }
}
