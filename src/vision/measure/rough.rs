//! Beads whose edges are no blurred steps: torn ones, grooves, texture.

use super::{NEED_SHARE, Work, even};
use crate::calib::SurfaceMap;
use crate::vision::coarse::LinePair;
use crate::vision::gauge::Polarity;
use crate::vision::reject::Reject;
use crate::vision::rough::{RoughFit, Scene};
use crate::vision::strip::{Grey, Strip, View};
use crate::vision::trace::Tracer;
use crate::vision::width::WidthMeasurement;

/// The search range allows 1.5 times too wide and too narrow single places; lines
/// are means over the gauge, and stay nearer.
const LINE_SLACK: f32 = 1.4;

/// Widest blur of a rough edge \[px\]: what lies outside is looked for within 20 px, and
/// a flank of three blurs must end before.
const WIDEST_ROUGH_PX: f64 = 6.3;
/// Share of an edge's rows that may be sorted out: more are bays, or grains.
const FEW_GAPS: f64 = 0.06;
/// Contrast of an edge as a fraction of the other's below which it may be a rib's, and
/// the distance at which another edge is not the same \[px\].
const LOPSIDED: f64 = 0.6;
const ELSEWHERE_PX: f64 = 3.0;
/// Contrast of a step, as a fraction of the rough edge's, below which it is a part of a
/// wide flank.
const PART_OF_FLANK: f64 = 0.5;
/// How much farther out than a blurred step a rough edge may lie \[px\].
const WIDER_PX: f64 = 1.0;
/// Contrast of a rough edge over that of the blurred step from which on it is higher: by
/// sparks on 5 % of the bead it is 1.05 to 1.1.
const HIGHER: f64 = 1.04;
/// Share of odd pixels about an edge up to which it is bead and ground alone: grains
/// and sparks have more.
const FEW_ODD: f64 = 0.01;
/// By how much the share of odd pixels about an edge exceeds that within the bead where
/// grains lie on it: concrete beads have up to 0.022, grains of 6 and 12 px on a third of
/// the rows 0.027 to 0.14.
const GRAINS: f64 = 0.024;
/// Strongest pattern beside rough edges, as a fraction of the contrast: beside beads of
/// real concrete, other beads and grooves have up to 0.464.
const STRONGEST_BESIDE_ROUGH: f64 = 0.48;
/// Part of the width beside either edge where its flank may be \[of the width\]: the
/// bead's texture is taken from between.
const TEXTURE_MARGIN: f32 = 0.15;
/// How much stronger than a typical line of texture an edge must be: on layers that
/// are seen from the side, whose lower edges fade into shadow, lines of texture were
/// taken for edges up to 4.8; the edges of concrete beads have 5 to 17.
const STANDS_OUT: f64 = 5.0;

impl Work {
    /// Measures a bead by where its rows pass half height. `refused` is why it was not
    /// measured by blurred steps.
    pub(super) fn measure_rough<T: Grey>(
        &mut self,
        refused: &Reject,
        strip: &Strip<'_, T>,
        range: (f32, f32),
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let pair = self.find_lines(strip, range)?;
        let pattern = self.ground_pattern(strip, &pair);
        if let Some(pattern) = pattern {
            let found = self.measure_patterned((&pair, pattern), strip, view, surface);
            if !matches!(found, Err(Reject::NoPair { .. })) {
                return found;
            }
        }
        let fits = self.fit_rough(strip, &pair)?;
        if is_covered(refused) && fits.iter().any(has_grains) {
            return Err(*refused);
        }
        check_pattern(pattern.unwrap_or(0.0), &fits)?;
        self.take_rough(&fits, strip, view, surface)
    }

    /// Looks for a bead with rough edges.
    #[cold]
    #[inline(never)]
    pub(super) fn find_rough<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        range: (f32, f32),
    ) -> Result<[RoughFit; 2], Reject> {
        let pair = self.find_lines(strip, range)?;
        self.fit_rough(strip, &pair)
    }

    /// Looks for the bead's edges as lines.
    pub(super) fn find_lines<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        range: (f32, f32),
    ) -> Result<LinePair, Reject> {
        let failed = Reject::NoPair { got: 0.0, need: NEED_SHARE };
        let range = (LINE_SLACK * range.0, range.1 / LINE_SLACK);
        self.coarse.look(strip, (range.0 * range.1).sqrt());
        let polarities =
            [self.gauge.polarity != Polarity::Dark, self.gauge.polarity != Polarity::Bright];
        self.coarse.pairs(range, polarities, &mut self.pairs);
        let pair = *self.pairs.first().ok_or(failed)?;
        self.check_stands_out(&pair)?;
        self.check_rivals(&pair)?;
        Ok(pair)
    }

    /// Follows rough edges near two lines.
    fn fit_rough<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        pair: &LinePair,
    ) -> Result<[RoughFit; 2], Reject> {
        let failed = Reject::NoPair { got: 0.0, need: NEED_SHARE };
        let scene = Scene {
            strip,
            lines: &self.lines,
            noise: self.noise,
            width_px: pair.width_px(),
            bead_after: true,
            bright: pair.bright,
        };
        let [left, right] = &mut self.rough;
        left.find(&scene, &pair.sides[0]).ok_or(failed)?;
        let right_scene = Scene { bead_after: false, ..scene };
        right.find(&right_scene, &pair.sides[1]).ok_or(failed)?;
        let (left_blur, right_blur) = (left.blur(), right.blur());
        let left_fit = left.locate(&scene, right_blur).ok_or(failed)?;
        let right_fit = right.locate(&right_scene, left_blur).ok_or(failed)?;
        let got = left_fit.rows_fraction.min(right_fit.rows_fraction);
        if got < NEED_SHARE {
            return Err(Reject::NoPair { got, need: NEED_SHARE });
        }
        even::check(&[left_fit, right_fit], even::middle_grey(strip, pair))?;
        Ok([left_fit, right_fit])
    }

    /// The width of the bead whose rough edges were found.
    pub(super) fn take_rough<T: Grey>(
        &mut self,
        [left_fit, right_fit]: &[RoughFit; 2],
        strip: &Strip<'_, T>,
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        self.left_px.clear();
        self.right_px.clear();
        self.left.take_rough(self.rough[0].lines(), left_fit);
        self.right.take_rough(self.rough[1].lines(), right_fit);
        self.check_contrast()?;
        self.check_blur(WIDEST_ROUGH_PX)?;
        self.check_ground(strip, f64::min)?;
        self.check_border(strip.across)?;
        self.width_on(view, surface)
    }
}

impl Work {
    /// Whether edges that were measured as blurred steps may be something else.
    pub(super) fn may_be_more_than_steps(&self) -> bool {
        self.is_refined || self.is_beside_groove || self.has_gaps() || self.is_lopsided()
    }

    /// Whether places of the edges were sorted out.
    fn has_gaps(&self) -> bool {
        has_gaps(&self.left) || has_gaps(&self.right)
    }

    /// Whether rough edges are not higher than the blurred steps: then what was sorted
    /// out shows ground. Dark grains beside an edge, sparks within and shading make rough
    /// edges higher; holes within make them lower.
    fn is_no_higher(&self, fits: &[RoughFit; 2]) -> bool {
        fits.iter().zip(self.contrasts).all(|(fit, step)| fit.contrast < HIGHER * step)
    }

    /// Whether the blurred steps are parts of flanks that are wider than any blur.
    fn are_parts_of_flanks(&self, fits: &[RoughFit; 2]) -> bool {
        let mut sides = fits.iter().zip(self.contrasts);
        let is_wide = self.is_refined && fits.iter().any(|fit| fit.blur_px > WIDEST_ROUGH_PX);
        is_wide || sides.all(|(fit, step)| step < PART_OF_FLANK * fit.contrast)
    }

    /// Whether one edge is much fainter than the other, as a rib's is.
    fn is_lopsided(&self) -> bool {
        let [left, right] = self.contrasts;
        left.min(right) < LOPSIDED * left.max(right)
    }

    /// Whether rough edges lie elsewhere than the blurred steps.
    fn is_elsewhere(&self) -> bool {
        let sides = [(&self.left, &self.rough[0]), (&self.right, &self.rough[1])];
        sides.iter().any(|(steps, rough)| (steps.middle() - rough.middle()).abs() > ELSEWHERE_PX)
    }

    /// Whether a rough edge lies farther out than its blurred step, with no narrow
    /// groove in between: bays take bead away, and what adds some is a shadow beside it.
    fn is_wider(&self, fits: &[RoughFit; 2]) -> bool {
        let sides = [(&self.left, &self.rough[0], -1.0), (&self.right, &self.rough[1], 1.0)];
        sides.iter().zip(fits).any(|((steps, rough, outwards), fit)| {
            let out = outwards * (rough.middle() - steps.middle());
            !fit.is_narrow_groove && out > WIDER_PX
        })
    }

    /// Whether rough edges explain more than blurred steps do: a groove that no step
    /// is, or bays in an edge that were sorted out as grains.
    pub(super) fn explains_more(&self, fits: &[RoughFit; 2]) -> bool {
        if self.is_lopsided() && self.is_elsewhere() || self.are_parts_of_flanks(fits) {
            return true;
        }
        if self.is_wider(fits) {
            return false;
        }
        let two_levels = are_two_levels(fits);
        // Texture that is known on both sides looks like a groove here and there.
        let knows_texture = self.left.knows_texture() && self.right.knows_texture();
        let hidden = !knows_texture && fits.iter().any(|fit| fit.is_narrow_groove);
        if self.is_refined {
            let has_grains = fits.iter().any(has_grains);
            let grooved = hidden || fits.iter().any(|fit| fit.is_groove);
            grooved && !has_grains && (two_levels || !self.is_lost)
        } else {
            // Grains here and there look like a groove in the mean over the gauge.
            let is_covered = self.left.is_covered() || self.right.is_covered();
            let bays = two_levels && self.has_gaps() && self.is_no_higher(fits);
            bays || hidden && !is_covered
        }
    }

    /// Refuses a pair that the bead's texture may have made.
    fn check_stands_out(&self, pair: &LinePair) -> Result<(), Reject> {
        let [left, right] = pair.sides;
        let margin = TEXTURE_MARGIN * pair.width_px();
        let texture = self.coarse.between(left.at + margin, right.at - margin);
        let got = f64::from(pair.strengths[0].min(pair.strengths[1]) / texture.max(f32::EPSILON));
        if got < STANDS_OUT { Err(Reject::Vague { got, need: STANDS_OUT }) } else { Ok(()) }
    }

    /// Refuses a pair beside which another one fits as well that ends at a seam or a
    /// rib.
    fn check_rivals(&self, pair: &LinePair) -> Result<(), Reject> {
        let rival = self.pairs.iter().skip(1).find(|other| self.coarse.are_rivals(pair, other));
        rival.map_or(Ok(()), |rival| Err(self.ambiguous(pair.width_px(), rival.width_px())))
    }
}

/// Whether edges show bead and what lies outside, and no grains.
fn are_two_levels(fits: &[RoughFit; 2]) -> bool {
    fits.iter().all(|fit| fit.odd_share < FEW_ODD)
}

/// Refuses a bead beside a pattern that is as strong as its edges. `pattern` is its
/// standard deviation \[grey levels\]: parts of it look like bead, and like grooves.
fn check_pattern(pattern: f64, fits: &[RoughFit; 2]) -> Result<(), Reject> {
    let got = pattern / fits[0].contrast.min(fits[1].contrast);
    let limit = STRONGEST_BESIDE_ROUGH;
    if got > limit { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
}

/// Whether more shows about an edge than bead with its texture and ground.
fn has_grains(fit: &RoughFit) -> bool {
    fit.odd_share > fit.odd_within_share + GRAINS
}

/// Whether a frame was refused for what hides its edges, which may be grains.
fn is_covered(refused: &Reject) -> bool {
    matches!(refused, Reject::Scattered { .. } | Reject::Occluded { .. } | Reject::NoPair { .. })
}

/// Whether places of an edge were sorted out.
fn has_gaps(steps: &Tracer) -> bool {
    steps.used_share() < 1.0 - FEW_GAPS
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
