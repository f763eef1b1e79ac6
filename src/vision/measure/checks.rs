//! Checks of two located edges: consistency, contrast, blur, pattern, occlusion, boundary.

use super::pattern_limits::{MAX_PATTERN, MAX_PATTERN_LINE_BY_LINE};
use super::work::{EdgeModel, MeasureState};
use crate::numeric::normal_distribution::ROOT_TWO_PI;
use crate::numeric::number::to_f64;
use crate::numeric::rank;
use crate::vision::gauge::EdgeKind;
use crate::vision::ground::{EdgePosition, EdgeSide};
use crate::vision::outlier;
use crate::vision::reject::{Checked, Reject};
use crate::vision::row_range::RowRange;
use crate::vision::strip::{GaugeRows, GreyPixel};
use crate::vision::trace::EdgeTracer;
use crate::vision::width::WidthMeasurement;

/// Fraction of the rows from which each edge must come.
const MIN_ROW_FRACTION: f64 = 0.4;
/// Fraction of the rows from which an occluded edge must come; each is known to be clear.
const MIN_CLEAR_ROW_FRACTION: f64 = 0.16;
/// Misfit of a blurred step above which, if both edges exceed it, they are located line by line:
/// one alone is more likely occluded than no blurred step.
pub(super) const MAX_STEP_MISFIT: f64 = 2.0;
/// Misfit of one edge alone above which both are located line by line.
const MAX_SINGLE_MISFIT: f64 = 8.0;
/// Largest standard deviation of a width whose edges are occluded in part \[px\]: beyond it, the
/// clear rows do not show where an edge runs.
const MAX_OCCLUDED_SIGMA_PX: f64 = 0.185;
/// Largest standard deviation of a width where an occluded edge seems to wind \[px\]: rows that
/// wind aside look occluded too, and too few are left.
const MAX_WINDING_SIGMA_PX: f64 = 0.08;
/// Fraction of clear rows from which on an occluded edge is certain enough.
const MIN_SURE_CLEAR_FRACTION: f64 = 0.6;
/// Distance from the boundary of the gauge that an edge needs, in its blurs: a step that is cut
/// short there seems to lie farther inside. Derived: beyond 3 blurs 1.3·10⁻³ of a step is left, 1 −
/// Φ(3).
const BOUNDARY_BLURS: f64 = 3.0;
/// Smallest distance from the boundary of the gauge that an edge needs \[px\].
const MIN_BOUNDARY_PX: f64 = 3.0;
/// Fraction of an edge's positions that may be nearer to the boundary.
const MAX_NEAR_BOUNDARY_FRACTION: f64 = 0.05;
/// Largest spread of an edge's positions about their neighbours \[px\]: more is noise.
const MAX_SCATTER_PX: f64 = 1.5;
/// Largest spread where both edges show in all rows but for a few sparks \[px\]: then they are as
/// rough as they look, and what spreads more is no bead.
const MAX_COMPLETE_SCATTER_PX: f64 = 4.0;
/// Fraction of the rows that counts as all of them.
pub(super) const COMPLETE_FRACTION: f64 = 0.95;
/// Largest spread where one edge was hidden and had to be located line by line \[px\].
const MAX_LOST_SCATTER_PX: f64 = 0.5;

/// Fraction of a pattern beside an edge that counts for its position: at the edge the bead hides
/// half of it, and the widths of drawn beads show a little less.
const PATTERN_WEIGHT: f64 = 0.46;
/// Pattern, as a fraction of the contrast, below which weights for the texture account for all of
/// it: with a variance besides, z of compressed images of a quality above 65 is 0.86.
const MAX_FAINT_PATTERN: f64 = 0.1;
/// Widest blur of an edge that is measured \[px\]: rendered motion, a box of 20.8 px,
/// is measured without fault up to 7.4 px of blur, and was off by some pixels from
/// 7.5 px on.
pub(super) const MAX_BLUR_PX: f64 = 7.4;
/// Widest blur of a box of even motion with a lens's blur \[px\]. Derived: √(15.8²/12 + 1.5²) px,
/// for a motion of 15.8 px with a blur of 1.5 px. Flanks of longer motions were taken for shading
/// once in some hundred frames, and the width was 1 px off.
pub(super) const MAX_MOTION_BLUR_PX: f64 = 4.8;

impl MeasureState {
    /// Whether one edge alone is hidden: then it is occluded, rather than no blurred step.
    pub fn one_is_lost(&self) -> bool {
        let lost = |side: &EdgeTracer| side.is_lost() && side.misfit_of_a_row() > MAX_STEP_MISFIT;
        lost(&self.left) != lost(&self.right)
    }

    /// Removes positions that disagree with their neighbours; refuses edges that are too rough or
    /// show in too few rows.
    pub fn reject_outliers(&mut self, bright: bool) -> Checked {
        self.drop_inconsistent(bright);
        let mut worst: f64 = 0.0;
        for side in [&mut self.left, &mut self.right] {
            if side.is_occluded() {
                side.drop_strays(self.both.min_outlier_px);
            }
            let (least_px, scratch) = (self.both.min_outlier_px, &mut self.scratch.wide);
            worst = worst.max(outlier::remove_outliers(&mut side.edges, least_px, scratch));
        }
        let got = self.left.used_fraction().min(self.right.used_fraction());
        let sides = [&self.left, &self.right];
        let enough = sides.iter().all(|side| side.used_fraction() >= min_row_fraction(side));
        let limit = self.scatter_limit();
        if worst > limit {
            return Err(Reject::Scattered { got_px: worst, limit_px: limit });
        }
        if !enough {
            let need = f64::max(min_row_fraction(sides[0]), min_row_fraction(sides[1]));
            return Err(Reject::NoPair { got, need });
        }
        Ok(())
    }

    /// Takes out positions that step the wrong way for the bead's polarity, and lines
    /// whose two edges cross.
    fn drop_inconsistent(&mut self, bright: bool) {
        let sides = [(&mut self.left, bright), (&mut self.right, !bright)];
        for (side, steps_up) in sides {
            for edge in &mut side.edges {
                *edge = edge.take_if(|edge| (edge.height > 0.0) == steps_up);
            }
        }
        let (left, right) = (&mut self.left.edges, &mut self.right.edges);
        for (left, right) in left.iter_mut().zip(right) {
            if let (Some(one), Some(other)) = (&left, &right)
                && one.at >= other.at
            {
                (*left, *right) = (None, None);
            }
        }
    }

    /// Refuses edges whose flanks are wider than a lens's blur: a shutter that is open
    /// while the bead moves leaves another shape, and with it another width.
    pub fn check_blur(&self, limit_px: f64) -> Checked {
        let got_px = self.left.blur_px.max(self.right.blur_px);
        if got_px > limit_px { Err(Reject::Blurred { got_px, limit_px }) } else { Ok(()) }
    }

    /// Adds to the edges' variance what a pattern beside the bead may move them by, and refuses one
    /// as strong as an edge; `of_both` combines the strengths of the two sides.
    pub fn check_ground<T: GreyPixel>(
        &mut self,
        strip: &GaugeRows<'_, T>,
        of_both: fn(f64, f64) -> f64,
    ) -> Checked {
        let noise = f64::from(self.rows.noise.grey);
        self.both.is_beside_groove = self.gauge.edge == EdgeKind::Groove;
        let mut strengths = [0.0_f64; 2];
        let sides = [(&mut self.left, -1.0), (&mut self.right, 1.0)];
        for (((tracer, outwards), contrast), strength) in
            sides.into_iter().zip(self.both.contrasts).zip(&mut strengths)
        {
            tracer.uncertainty.ground_variance = 0.0;
            if !tracer.is_on_ground {
                continue;
            }
            edge_positions(tracer, &self.rows.lines, &mut self.scratch.positions);
            let blur_px = tracer.blur_px;
            let (positions, room_px) = (&self.scratch.positions, f64::INFINITY);
            let side = EdgeSide { strip, noise, positions, outwards, blur_px, room_px };
            if self.gauge.edge == EdgeKind::Auto {
                self.both.is_beside_groove |=
                    tracer.is_beside_groove(outwards > 0.0, noise / contrast);
            }
            let Some(pattern) = self.scratch.ground.pattern(&side) else { continue };
            *strength = pattern.size_grey / contrast;
            // The variance of rough edges includes the ground beside them, and weights for a
            // texture include a faint pattern.
            let is_in_weights = tracer.is_textured() && *strength < MAX_FAINT_PATTERN;
            if tracer.uncertainty.mean_variance.is_none() && !is_in_weights {
                let px_per_grey = PATTERN_WEIGHT * ROOT_TWO_PI * tracer.blur_px / contrast;
                tracer.uncertainty.ground_variance =
                    pattern.mean_variance * px_per_grey * px_per_grey;
            }
        }
        self.both.pattern_ratio = strengths[0].min(strengths[1]);
        let (got, limit) = (of_both(strengths[0], strengths[1]), MAX_PATTERN);
        if got > limit { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
    }

    /// Refuses edges in a pattern that were located line by line: they may be parts of the pattern.
    pub fn check_lines_in_pattern(&self) -> Checked {
        let (got, limit) = (self.both.pattern_ratio, MAX_PATTERN_LINE_BY_LINE);
        let is_among = self.both.model == EdgeModel::LineByLine && got > limit;
        if is_among { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
    }

    /// Spread of an edge from which on it is noise \[px\].
    fn scatter_limit(&self) -> f64 {
        let sides = [&self.left, &self.right];
        let whole =
            |side: &&EdgeTracer| side.is_clear() && side.used_fraction() > COMPLETE_FRACTION;
        if self.both.is_lost {
            MAX_LOST_SCATTER_PX
        } else if sides.iter().all(whole) {
            MAX_COMPLETE_SCATTER_PX
        } else {
            MAX_SCATTER_PX
        }
    }

    pub fn check_contrast(&mut self) -> Checked {
        let need = self.gauge.min_contrast_grey;
        self.both.contrasts = [self.contrast(true), self.contrast(false)];
        let got = self.both.contrasts[0].min(self.both.contrasts[1]);
        if got < need {
            return Err(self.saturation().unwrap_or(Reject::LowContrast { got, need }));
        }
        Ok(())
    }

    /// Median height of an edge's steps \[grey levels\].
    fn contrast(&mut self, left: bool) -> f64 {
        let side = if left { &self.left } else { &self.right };
        self.scratch.wide.clear();
        self.scratch.wide.extend(side.edges.iter().flatten().map(|edge| edge.height.abs()));
        rank::median(&mut self.scratch.wide).unwrap_or(0.0)
    }

    /// Refuses a bead of whose edges too little is visible to show where they
    /// run.
    pub fn check_occlusion(&self, found: &WidthMeasurement) -> Checked {
        let got_px = found.sigma.get() / found.width.get() * f64::from(self.width_px);
        let sides = [&self.left, &self.right];
        let sparse = |side: &&EdgeTracer| {
            side.is_occluded() && side.used_fraction() < MIN_SURE_CLEAR_FRACTION
        };
        let winding = |side: &&EdgeTracer| side.is_occluded() && side.seems_winding();
        let (limit, unsure) = if sides.iter().any(winding) {
            (MAX_WINDING_SIGMA_PX, true)
        } else {
            (MAX_OCCLUDED_SIGMA_PX, sides.iter().any(sparse))
        };
        if unsure && got_px > limit {
            return Err(Reject::Occluded { got_px, limit_px: limit });
        }
        Ok(())
    }

    /// Refuses a bead whose edges lie too near the boundary of the gauge.
    pub fn check_boundary(&self, across: usize) -> Checked {
        let last = to_f64(across.saturating_sub(1));
        for side in [&self.left, &self.right] {
            let need_px = f64::max(MIN_BOUNDARY_PX, BOUNDARY_BLURS * side.blur_px);
            let places = side.edges.iter().flatten();
            let distances = places.map(|edge| edge.at.min(last - edge.at));
            let (mut near, mut all, mut got_px) = (0.0, 0.0, f64::INFINITY);
            for distance in distances {
                all += 1.0;
                if distance < need_px {
                    near += 1.0;
                    got_px = got_px.min(distance.max(0.0));
                }
            }
            if near > MAX_NEAR_BOUNDARY_FRACTION * all {
                return Err(Reject::Clipped { got_px, need_px });
            }
        }
        Ok(())
    }
}

/// Where an edge lies on the caliper lines that show it.
pub fn edge_positions(tracer: &EdgeTracer, lines: &[RowRange], places: &mut Vec<EdgePosition>) {
    let edges = tracer.edges.iter().zip(lines);
    places.clear();
    places.extend(
        edges.filter_map(|(edge, &rows)| Some(EdgePosition { rows, at: edge.as_ref()?.at })),
    );
}

/// Fraction of the rows from which an edge must come.
fn min_row_fraction(side: &EdgeTracer) -> f64 {
    if side.is_occluded() { MIN_CLEAR_ROW_FRACTION } else { MIN_ROW_FRACTION }
}

/// Whether edges are no blurred steps, from their misfits.
pub fn are_not_steps(misfits: [f64; 2]) -> bool {
    misfits.iter().all(|&misfit| misfit > MAX_STEP_MISFIT)
        || misfits.iter().any(|&misfit| misfit > MAX_SINGLE_MISFIT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_widest_motion_is_a_box_with_the_default_blur() {
        let blur = (15.8f64.powi(2) / 12.0 + 1.5 * 1.5).sqrt();
        assert!((MAX_MOTION_BLUR_PX - blur).abs() < 0.005, "{blur}");
    }
}
