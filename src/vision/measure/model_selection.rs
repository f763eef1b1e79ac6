//! Whether edges that were measured as blurred steps are better described as rough edges: with a
//! groove, with bays, or with a flank that is wider than any blur.

use std::ops::RangeInclusive;

use super::checks::{MAX_BLUR_PX, MAX_MOTION_BLUR_PX, MAX_STEP_MISFIT};
use super::rough_edges::MAX_ROUGH_BLUR_PX;
use super::work::{EdgeModel, MeasureState};
use crate::vision::reject::{Checked, Reject};
use crate::vision::rough::RoughFit;
use crate::vision::trace::EdgeTracer;
use crate::vision::width::WidthMeasurement;

/// Fraction of an edge's rows that may be rejected: more are bays, or grains.
const MAX_GAP_FRACTION: f64 = 0.06;
/// Fraction of rejected rows that noise does not explain: a single bay of 2 px in 200 rows.
const MAX_UNFIT_FRACTION: f64 = 0.01;
/// Narrowest bead whose level is read free of its flanks by rough edges \[px\].
const MAX_NARROW_WIDTH_PX: f32 = 40.0;
/// Ratio of a rough edge's contrast to that of the blurred step below which it is another edge:
/// with holes in the bead it is 0.8.
const MIN_CONTRAST_RATIO: f64 = 0.7;
/// Contrast of an edge as a fraction of the other's below which it may be a rib's.
const MIN_SIDES_CONTRAST_RATIO: f64 = 0.6;
/// Distance from which on a rough edge is not that of the blurred step \[px\]: a groove that blur
/// fills moves an edge by less.
const OTHER_EDGE_PX: f64 = 3.0;
/// Distance of a rough edge from one located line by line up to which both are the same \[px\].
const SAME_EDGE_PX: f64 = 0.25;
/// Difference of the levels outside the two edges, as a fraction of the higher contrast, from which
/// on the grounds differ and a narrow groove may lie beside one: a groove of 2 to 2.5 px that is a
/// little darker than the ground moves a blurred step by a third of a pixel and shows in nothing
/// else.
const MIN_GROUND_DIFFERENCE: f64 = 0.1;
/// Pattern beside both edges, as a fraction of the contrast, from which on a blurred step may have
/// parts of it in its flank: widths were up to 3 px off, seven times the sigma of steps.
const MIN_PATTERN: f64 = 0.2;
/// Factor of sigma where edges in such a pattern were located line by line: of 30,000 drawn widths
/// some were off by up to seven sigmas.
const PATTERN_SIGMA_FACTOR: f64 = 2.0;
/// Contrast of a step, as a fraction of the rough edge's, below which it is a part of a wide flank.
const MAX_PARTIAL_CONTRAST: f64 = 0.55;
/// Blur of a step from which on it may be such a part \[px\]: steps within the ramps of motions of
/// 15 px and more have 2.9 px, those beside a shadow have the lens's.
const MIN_PARTIAL_BLUR_PX: f64 = 2.5;
/// Contrast of a step, as a fraction of the difference of the levels a few pixels before and after
/// it, below which a ramp, a rib or a shadow may lie there.
const MIN_LEVEL_RATIO: f64 = 0.8;
/// Ratio of a step's contrast to the rough edge's that is a whole flank, where either is wide:
/// below it the rest of the flank was taken for shading, above it shading for the flank. Drawn
/// edges of up to 20 px of motion, or up to 6 px of blur, whose widths were right had 0.99 to
/// 1.056, those that were 0.5 px and more off up to 0.944 or 1.1.
const FULL_FLANK_CONTRAST: RangeInclusive<f64> = 0.97..=1.08;
/// Blur of a step from which on it may be a part of a flank \[px\].
const WIDE_BLUR_PX: f64 = 3.5;
/// How much farther out than a blurred step a rough edge may lie \[px\].
const MAX_OUTWARD_PX: f64 = 1.0;
/// Ratio of a rough edge's contrast to that of the blurred step from which on it is higher.
/// Measured: reference/accuracy.md, The sets: with sparks on 5 % of the bead (`spots`) it is 1.05
/// to 1.1.
const MAX_CONTRAST_RATIO: f64 = 1.04;
/// Fraction of odd pixels about an edge up to which it is bead and ground alone. Measured:
/// reference/accuracy.md, Drawn frames: `torn`, `holes` and `low-light` have up to 0.003; of 522
/// frames of `grooves` that were refused as occluded 11 have more, and grains that passed for bays
/// from 0.005 on.
const MAX_ODD_FRACTION: f64 = 0.004;
/// By how much the fraction of odd pixels about an edge exceeds that within the bead where grains
/// lie on it. Measured: reference/accuracy.md, The sets: concrete beads have up to 0.022, grains of
/// 6 and 12 px on a third of the rows (`grains-6-…`, `grains-12-…`) 0.027 to 0.14.
const GRAIN_ODD_FRACTION: f64 = 0.024;

impl MeasureState {
    /// Whether edges that were measured as blurred steps may be something else. Not for saturated
    /// edges: rows do not show their half height.
    pub fn may_not_be_steps(&self) -> bool {
        if self.both.model == EdgeModel::Clipped {
            return false;
        }
        let is_other = self.is_refined() || self.both.is_beside_groove || self.is_wide();
        is_other || self.has_gaps() || self.has_two_grounds() || self.has_low_step()
    }

    /// Whether a step is much lower than the difference of the levels on either side: it may lie
    /// within a ramp, most of which was taken for shading, or beside a rib.
    fn has_low_step(&self) -> bool {
        is_part(&self.left, self.both.contrasts[0]) || is_part(&self.right, self.both.contrasts[1])
    }

    /// Whether edges were located line by line.
    fn is_refined(&self) -> bool {
        self.both.model == EdgeModel::LineByLine
    }

    /// Whether the flanks are so wide that rows alone do not show bays in them.
    fn is_wide(&self) -> bool {
        self.left.blur_px.max(self.right.blur_px) > WIDE_BLUR_PX
    }

    /// Whether the bead is too narrow for its level to be read free of its flanks.
    fn is_narrow(&self) -> bool {
        self.width_px <= MAX_NARROW_WIDTH_PX
    }

    /// Whether more than a few positions of an edge were rejected, or some that noise does not
    /// explain.
    pub fn has_gaps(&self) -> bool {
        let used = self.left.used_fraction().min(self.right.used_fraction());
        used < 1.0 - MAX_GAP_FRACTION
            || self.left.unfit_fraction.max(self.right.unfit_fraction) > MAX_UNFIT_FRACTION
    }

    /// Whether rough edges have no more contrast than the blurred steps: then the rejected rows
    /// show ground. Dark grains beside an edge, sparks within and shading raise the contrast of
    /// rough edges; holes within lower it.
    fn is_no_higher(&self, fits: &[RoughFit; 2]) -> bool {
        fits.iter()
            .zip(self.both.contrasts)
            .all(|(fit, step)| fit.contrast < MAX_CONTRAST_RATIO * step)
    }

    /// Whether grains may hide the edges of a frame whose blurred steps were refused: as occluded,
    /// with rough edges of more contrast because grains pass for ground, or with many odd pixels.
    pub fn may_be_grains(&self, refused: &Reject, fits: &[RoughFit; 2]) -> bool {
        let is_higher = matches!(refused, Reject::Occluded { .. }) && !self.is_no_higher(fits);
        is_higher || fits.iter().any(|fit| fit.exceeds_texture(MAX_ODD_FRACTION))
    }

    /// Whether a rough edge is so much fainter than the blurred step that it is another.
    fn is_fainter(&self, fits: &[RoughFit; 2]) -> bool {
        fits.iter()
            .zip(self.both.contrasts)
            .any(|(fit, step)| fit.contrast < MIN_CONTRAST_RATIO * step)
    }

    /// Whether the blurred steps are parts of flanks that are wider than any blur.
    fn are_parts_of_flanks(&self, fits: &[RoughFit; 2]) -> bool {
        let mut sides = fits.iter().zip(self.both.contrasts);
        let is_wide = self.is_refined() && fits.iter().any(|fit| fit.blur_px > MAX_ROUGH_BLUR_PX)
            || fits.iter().all(|fit| fit.blur_px > MAX_BLUR_PX);
        let may_be_part = self.left.blur_px.max(self.right.blur_px) > MIN_PARTIAL_BLUR_PX;
        is_wide
            || may_be_part && sides.all(|(fit, step)| step < MAX_PARTIAL_CONTRAST * fit.contrast)
    }

    /// Refuses wide steps of which one is less than its flank, or more.
    pub fn check_flanks(&self, fits: &[RoughFit; 2]) -> Checked {
        let mut sides = fits.iter().zip(self.both.contrasts);
        let is_whole =
            sides.all(|(fit, step)| FULL_FLANK_CONTRAST.contains(&(step / fit.contrast)));
        let (got_px, limit_px) = (fits[0].blur_px.max(fits[1].blur_px), MAX_MOTION_BLUR_PX);
        if self.is_wide() && !is_whole && got_px > limit_px {
            return Err(Reject::Blurred { got_px, limit_px });
        }
        Ok(())
    }

    /// Whether one edge has much less contrast than the other.
    fn have_unequal_contrast(&self) -> bool {
        let [left, right] = self.both.contrasts;
        left.min(right) < MIN_SIDES_CONTRAST_RATIO * left.max(right)
    }

    /// Whether the levels outside the two edges differ.
    fn has_two_grounds(&self) -> bool {
        let ([left, _], [_, right]) = (self.left.levels(), self.right.levels());
        let [one, other] = self.both.contrasts;
        (left - right).abs() > MIN_GROUND_DIFFERENCE * one.max(other)
    }

    /// How far rough edges lie from where edges were located before \[px\]: the farther of both.
    fn apart_px(&self) -> f64 {
        let sides = [(&self.left, &self.rough[0]), (&self.right, &self.rough[1])];
        let apart = sides.map(|(found, rough)| (found.middle() - rough.middle()).abs());
        apart[0].max(apart[1])
    }

    /// Whether rough edges lie elsewhere than the blurred steps.
    fn is_elsewhere(&self) -> bool {
        self.apart_px() > OTHER_EDGE_PX
    }

    /// Standard deviation of the width between rough edges, relative to that of the width that was
    /// found: below 1 where it is smaller.
    fn sigma_ratio(&self, fits: &[RoughFit; 2], found: &WidthMeasurement) -> f64 {
        let rough_px = fits.iter().map(|fit| fit.variance).sum::<f64>().sqrt();
        rough_px * self.mm_per_px / found.sigma.get()
    }

    /// A width between blurred steps, with the sigma of all rows where these are more reliable:
    /// where some were rejected and neither grains nor sparks are seen, so that the rest is a
    /// selection, as from a texture that was not recognised; beside a possible narrow groove, where
    /// the grounds differ; and in a pattern. Where a step is only a part of the levels' difference,
    /// or none fits and rows show a narrow groove, sigma includes the distance from the rows'
    /// edges. Nothing is added on narrow beads, whose level rows do not read free of the flanks.
    pub fn with_row_uncertainty(
        &self,
        fits: &[RoughFit; 2],
        found: WidthMeasurement,
    ) -> WidthMeasurement {
        if self.is_narrow() {
            return found;
        }
        let may_be_grooved = fits.iter().any(|fit| fit.is_narrow_groove);
        let is_uncertain = are_clean(fits, GRAIN_ODD_FRACTION)
            && (self.has_gaps() || may_be_grooved && self.has_two_grounds());
        let is_in_pattern = self.both.pattern_ratio > MIN_PATTERN;
        let sigma_factor = match self.both.model {
            EdgeModel::Steps if is_uncertain || is_in_pattern => {
                self.sigma_ratio(fits, &found).max(1.0)
            }
            EdgeModel::LineByLine if is_in_pattern => PATTERN_SIGMA_FACTOR,
            _ => 1.0,
        };
        let off = self.mm_per_px * self.row_offset_px(fits) / found.sigma.get();
        let sigma = found.sigma * (sigma_factor * sigma_factor + off * off).sqrt();
        WidthMeasurement { sigma, ..found }
    }

    /// Distance of the edges from those of the rows \[px\], where a step is only a part of the
    /// levels' difference, or the rows show a narrow groove and no step fits, or not on all rows
    /// beside grounds that differ.
    fn row_offset_px(&self, fits: &[RoughFit; 2]) -> f64 {
        let sides = [(&self.left, &self.rough[0]), (&self.right, &self.rough[1])];
        let shows_two_grounds =
            self.has_gaps() && self.has_two_grounds() && are_clean(fits, GRAIN_ODD_FRACTION);
        let off = [0, 1].map(|k| {
            let (found, rough) = sides[k];
            let is_fit =
                self.both.model == EdgeModel::Steps && found.misfit_of_a_row() < MAX_STEP_MISFIT;
            let is_step = is_fit && !shows_two_grounds;
            let off = (rough.middle() - found.middle()).abs();
            let is_part = is_part(found, self.both.contrasts[k]) && off < MAX_OUTWARD_PX;
            if is_part || !is_step && fits[k].is_narrow_groove { off } else { 0.0 }
        });
        off[0] + off[1]
    }

    /// Whether a rough edge lies farther out than its blurred step, with no narrow groove in
    /// between: bays only take bead away; what adds to it is a shadow beside it.
    fn is_wider(&self, fits: &[RoughFit; 2]) -> bool {
        let sides = [(&self.left, &self.rough[0], -1.0), (&self.right, &self.rough[1], 1.0)];
        sides.iter().zip(fits).any(|((steps, rough, outwards), fit)| {
            let out = outwards * (rough.middle() - steps.middle());
            !fit.is_narrow_groove && out > MAX_OUTWARD_PX
        })
    }

    /// Whether rough edges explain more than blurred steps do: a groove, bays that were rejected as
    /// grains, or edges that no blurred step fits and that rows locate better than lines do.
    pub fn explains_more(&self, fits: &[RoughFit; 2], found: &WidthMeasurement) -> bool {
        if self.have_unequal_contrast() && self.is_elsewhere() || self.are_parts_of_flanks(fits) {
            return true;
        }
        if self.is_wider(fits) || self.is_elsewhere() && self.is_fainter(fits) {
            return false;
        }
        let two_levels = are_clean(fits, MAX_ODD_FRACTION);
        // Texture that is known on both sides looks like a groove here and there.
        let knows_texture = self.left.is_textured() && self.right.is_textured();
        let hidden = !knows_texture && fits.iter().any(|fit| fit.is_narrow_groove);
        if self.is_refined() {
            let has_grains = fits.iter().any(has_grains);
            let grooved = hidden || fits.iter().any(|fit| fit.is_groove);
            let is_rough =
                two_levels && self.apart_px() < SAME_EDGE_PX && self.sigma_ratio(fits, found) < 1.0;
            !has_grains && (is_rough || grooved && (two_levels || !self.both.is_lost))
        } else {
            // Grains here and there look like a groove in the mean over the gauge.
            let is_covered = self.left.is_occluded() || self.right.is_occluded();
            let has_bays =
                two_levels && !self.is_narrow() && self.has_gaps() && self.is_no_higher(fits);
            !self.is_wide() && (has_bays || hidden && !is_covered)
        }
    }
}

/// Whether a step is only a part of the difference of the levels on either side of it.
fn is_part(tracer: &EdgeTracer, step: f64) -> bool {
    let [before, after] = tracer.levels();
    step < MIN_LEVEL_RATIO * (after - before).abs()
}

/// Whether few pixels about either edge show neither bead nor ground: a fraction below a limit.
fn are_clean(fits: &[RoughFit; 2], max_odd_fraction: f64) -> bool {
    fits.iter().all(|fit| fit.odd_fraction < max_odd_fraction)
}

/// Whether more shows about an edge than bead with its texture and ground.
pub fn has_grains(fit: &RoughFit) -> bool {
    fit.exceeds_texture(GRAIN_ODD_FRACTION)
}
