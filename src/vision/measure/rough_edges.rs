//! Beads whose edges are no blurred steps: torn ones, grooves, texture.

use super::pattern_limits::{check_pattern, with_texture_variance};
use super::uniformity;
use super::work::{GaugeFrame, MIN_LINE_FRACTION, MeasureState, Outcome};
use crate::numeric::number::{narrow_to_f32, to_f64};
use crate::vision::coarse::{LinePair, StepLine};
use crate::vision::gauge::{EdgeKind, Polarity, WidthRangePx};
use crate::vision::line::LineSums;
use crate::vision::reject::{Checked, Reject};
use crate::vision::rough::{RoughFit, RoughInput};
use crate::vision::strip::{GaugeRows, GreyPixel};
use crate::vision::vectors;

/// Factor by which the range of widths is narrower for lines: the search range allows 1.5 times for
/// single positions, and lines are means over the gauge that differ less.
const LINE_RANGE_FACTOR: f32 = 1.4;

/// Widest blur of a rough edge \[px\]: what lies outside is looked for within 20 px, and
/// a flank of three blurs must end before.
pub const MAX_ROUGH_BLUR_PX: f64 = 6.3;
/// Blur up to which the level outside is read free of the flank \[px\].
const MAX_CLEAR_BLUR_PX: f64 = 5.0;
/// Error of an edge for each pixel by which its blur exceeds that: drawn edges of 5.7 to 6 px, by
/// motion, lay 0.45 px too far out.
const OFFSET_PER_BLUR: f64 = 0.5;
/// Fraction of the width beside either edge where its flank may be: the bead's texture is read
/// between.
const TEXTURE_MARGIN_FRACTION: f32 = 0.15;
/// Smallest ratio of an edge's strength to that of a typical line of texture: on layers that are
/// seen from the side, whose lower edges fade into shadow, lines of texture were taken for edges up
/// to 4.8; the edges of concrete beads have 5 to 17.
const MIN_TEXTURE_RATIO: f64 = 5.0;

impl MeasureState {
    /// Measures a bead by where its rows pass half height. `refused` is why it was not
    /// measured by blurred steps.
    pub fn measure_rough<T: GreyPixel>(
        &mut self,
        refused: &Reject,
        frame: &GaugeFrame<'_, T>,
    ) -> Outcome {
        let pair = self.find_lines(frame)?;
        let pattern = self.ground_pattern(frame.strip, &pair);
        let is_textured = self.is_textured_between_lines(frame.strip, &pair);
        if (pattern > 0.0 || is_textured)
            && let Some(found) = self.measure_patterned((&pair, pattern), frame)
        {
            return found;
        }
        // Texture looks like seams and ribs; in a plain bead these are real.
        if !is_textured && matches!(refused, Reject::Ambiguous { .. }) {
            return Err(*refused);
        }
        let fits = self.fit_rough(frame.strip, &pair)?;
        if may_be_occluded(refused) && self.may_be_grains(refused, &fits) {
            return Err(*refused);
        }
        let fits = if is_textured { with_texture_variance(&pair, fits) } else { fits };
        self.width_of_rough_beside(pattern, is_textured, &fits, frame)
    }

    /// Looks for a bead with rough edges.
    #[cold]
    #[inline(never)]
    pub fn find_rough<T: GreyPixel>(
        &mut self,
        frame: &GaugeFrame<'_, T>,
    ) -> Result<[RoughFit; 2], Reject> {
        let pair = match self.find_lines(frame) {
            // Holes within the bead that lie one behind the other look like ribs and texture.
            Err(Reject::Ambiguous { .. } | Reject::Vague { .. })
                if self.has_gaps() && self.both.pattern_ratio == 0.0 =>
            {
                self.pair_of_steps(frame.strip)
            }
            pair => pair?,
        };
        self.fit_rough(frame.strip, &pair)
    }

    /// The lines along two blurred steps.
    fn pair_of_steps<T: GreyPixel>(&self, strip: &GaugeRows<'_, T>) -> LinePair {
        let middle = 0.5 * (to_f64(strip.along) - 1.0);
        let sides = [&self.left, &self.right].map(|tracer| {
            let mut line = LineSums::default();
            for (edge, &rows) in tracer.edges.iter().zip(&self.rows.lines) {
                if let Some(edge) = edge {
                    line.add(rows.middle() - middle, edge.at, edge.row_fraction);
                }
            }
            let [at, next] = [0.0, 1.0].map(|row| line.at(row).0);
            (narrow_to_f32(at), narrow_to_f32(next - at))
        });
        let steps = self.both.contrasts.map(narrow_to_f32);
        let [left, right] =
            [0, 1].map(|k| StepLine { at: sides[k].0, slope: sides[k].1, step: steps[k] });
        let bright = self.left.edges.iter().flatten().any(|edge| edge.height > 0.0);
        let bare = (left.step * right.step).sqrt();
        let (sides, score_without_grooves, strengths) = ([left, right], bare, steps);
        LinePair { sides, bright, score: bare, score_without_grooves, strengths }
    }

    /// Looks for the bead's edges as lines.
    pub fn find_lines<T: GreyPixel>(
        &mut self,
        frame: &GaugeFrame<'_, T>,
    ) -> Result<LinePair, Reject> {
        let failed = Reject::NoPair { got: 0.0, need: MIN_LINE_FRACTION };
        let WidthRangePx { min, max } = frame.range;
        let range = WidthRangePx { min: LINE_RANGE_FACTOR * min, max: max / LINE_RANGE_FACTOR };
        let usual_px = (range.min * range.max).sqrt();
        vectors::widest(
            #[inline(always)]
            || self.search.coarse.look(frame.strip, usual_px),
        );
        let polarities =
            [self.gauge.polarity != Polarity::Dark, self.gauge.polarity != Polarity::Bright];
        let may_be_groove = self.gauge.edge != EdgeKind::Step;
        self.search.coarse.pairs(range, polarities, may_be_groove, &mut self.search.pairs);
        let pair = *self.search.pairs.first().ok_or(failed)?;
        self.check_prominence(&pair)?;
        self.check_rivals(&pair)?;
        Ok(pair)
    }

    /// Follows rough edges near two lines.
    pub fn fit_rough<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        pair: &LinePair,
    ) -> Result<[RoughFit; 2], Reject> {
        let failed = Reject::NoPair { got: 0.0, need: MIN_LINE_FRACTION };
        let scene = RoughInput {
            strip,
            lines: &self.rows.lines,
            noise: self.rows.noise.grey,
            width_px: pair.width_px(),
            bead_after: true,
            bright: pair.bright,
            edge: self.gauge.edge,
            table: self.blur_shapes.lens(),
        };
        let [left, right] = &mut self.rough;
        let right_scene = RoughInput { bead_after: false, ..scene };
        let both = vectors::widest(
            #[inline(always)]
            || {
                left.find(&scene, &pair.sides[0])?;
                right.find(&right_scene, &pair.sides[1])
            },
        );
        both.ok_or(failed)?;
        let (left_blur, right_blur) = (left.blur(), right.blur());
        let left_fit = left.locate(&scene, right_blur).ok_or(failed)?;
        let right_fit = right.locate(&right_scene, left_blur).ok_or(failed)?;
        let got = left_fit.rows_fraction.min(right_fit.rows_fraction);
        if got < MIN_LINE_FRACTION {
            return Err(Reject::NoPair { got, need: MIN_LINE_FRACTION });
        }
        uniformity::check_uniformity(&[left_fit, right_fit], uniformity::middle_grey(strip, pair))?;
        Ok([left_fit, right_fit])
    }

    /// [`Self::width_of_rough`], or a refusal where the pattern beside the bead is too strong;
    /// `pattern` is its standard deviation \[grey levels\].
    pub fn width_of_rough_beside<T: GreyPixel>(
        &mut self,
        pattern: f64,
        is_textured: bool,
        fits: &[RoughFit; 2],
        frame: &GaugeFrame<'_, T>,
    ) -> Outcome {
        check_pattern(pattern / fits[0].contrast.min(fits[1].contrast), is_textured)?;
        self.width_of_rough(fits, frame)
    }

    /// The width of the bead whose rough edges were found.
    pub fn width_of_rough<T: GreyPixel>(
        &mut self,
        fits: &[RoughFit; 2],
        frame: &GaugeFrame<'_, T>,
    ) -> Outcome {
        self.left_px.clear();
        self.right_px.clear();
        let [left, right] = fits.map(with_flank_variance);
        self.left.take_rough(&self.rough[0].lines, &left);
        self.right.take_rough(&self.rough[1].lines, &right);
        self.check_contrast()?;
        self.check_blur(MAX_ROUGH_BLUR_PX)?;
        self.check_ground(frame.strip, f64::min)?;
        self.check_boundary(frame.strip.across)?;
        self.width_on_surface(frame.view, frame.surface)
    }

    /// Refuses a pair that the bead's texture may have made.
    fn check_prominence(&self, pair: &LinePair) -> Checked {
        let [left, right] = pair.sides;
        let margin = TEXTURE_MARGIN_FRACTION * pair.width_px();
        let texture = self.search.coarse.texture_between(left.at + margin, right.at - margin);
        let got = f64::from(pair.strengths[0].min(pair.strengths[1]) / texture.max(f32::EPSILON));
        let need = MIN_TEXTURE_RATIO;
        if got < need { Err(Reject::Vague { got, need }) } else { Ok(()) }
    }

    /// Refuses a pair beside which another one fits as well that ends at a seam or a
    /// rib.
    fn check_rivals(&self, pair: &LinePair) -> Checked {
        let mut others = self.search.pairs.iter().skip(1);
        let rival = others.find(|other| self.search.coarse.are_rivals(pair, other));
        rival.map_or(Ok(()), |rival| Err(self.ambiguous(pair.width_px(), rival.width_px())))
    }
}

/// Adds to an edge's variance the uncertainty of a flank too wide to be read as a whole.
fn with_flank_variance(fit: RoughFit) -> RoughFit {
    let off_px = OFFSET_PER_BLUR * (fit.blur_px - MAX_CLEAR_BLUR_PX).max(0.0);
    RoughFit { variance: fit.variance + off_px * off_px, ..fit }
}

/// Whether a frame was refused for what hides its edges, which may be grains.
fn may_be_occluded(refused: &Reject) -> bool {
    matches!(refused, Reject::Scattered { .. } | Reject::Occluded { .. } | Reject::NoPair { .. })
}

/// Whether a frame that was refused as one with smooth edges may show a rough
/// bead.
pub fn may_be_rough(reject: &Reject) -> bool {
    matches!(
        reject,
        Reject::NoPair { .. }
            | Reject::LowContrast { .. }
            | Reject::WidthOutOfRange { .. }
            | Reject::Scattered { .. }
            | Reject::Occluded { .. }
            | Reject::Ambiguous { .. }
            | Reject::Patterned { .. }
    )
}
