//! What is not believed: edges that disagree with themselves or with each other,
//! and steps that are too low.

use super::pattern_limits::{STRONGEST_OF_LINES, STRONGEST_PATTERN};
use super::work::{Way, Work};
use crate::numeric::normal_distribution::ROOT_TWO_PI;
use crate::numeric::number::float;
use crate::numeric::rank;
use crate::vision::gauge::EdgeKind;
use crate::vision::ground::{Place, Side};
use crate::vision::outlier;
use crate::vision::reject::Reject;
use crate::vision::row_range::RowRange;
use crate::vision::strip::{Grey, Strip};
use crate::vision::trace::Tracer;
use crate::vision::width::WidthMeasurement;

/// Share of the rows from which each edge must come.
const NEED_ROWS: f64 = 0.4;
/// The same where each row is known to be clear.
const NEED_CLEAR_ROWS: f64 = 0.16;
/// Misfit of a blurred step from which on, if both have it, edges are located
/// line by line: one alone is more likely covered than of another kind.
pub(super) const STRANGE: f64 = 2.0;
/// The same for one edge alone.
const VERY_STRANGE: f64 = 8.0;
/// Largest standard deviation of a width whose edges are covered in part
/// \[px\]: beyond it, what is left of an edge does not tell its course.
const COVERED_SIGMA_PX: f64 = 0.185;
/// The same where a covered edge seems to wind: what winds aside looks covered as
/// well, so that too little is left of such an edge.
const WINDING_SIGMA_PX: f64 = 0.08;
/// Share of clear rows from which on an edge's course is sure enough.
const PLENTY_CLEAR: f64 = 0.6;
/// Distance from the border of the gauge that an edge needs, in its blurs and at
/// least \[px\]: a step that is cut short there seems to lie farther inside.
const BORDER_BLURS: f64 = 3.0;
const BORDER_PX: f64 = 3.0;
/// Share of an edge's places that may be nearer.
const NEARER: f64 = 0.05;
/// Largest scatter of neighbouring edges about each other \[px\] that still is
/// an edge, not noise.
const MAX_SCATTER_PX: f64 = 1.5;
/// The same where both edges show in all rows but for a few sparks: then they are
/// as rough as they look, and what scatters more is no bead.
const WHOLE_SCATTER_PX: f64 = 4.0;
/// Share of the rows that counts as all.
pub(super) const WHOLE_SHARE: f64 = 0.95;
/// The same where one edge was hidden and had to be located line by line.
const LOST_SCATTER_PX: f64 = 0.5;

/// Share of a pattern beside an edge that counts for its place: at the edge it is half
/// covered by the bead, and the widths of drawn beads tell a little less.
const PATTERN_SHARE: f64 = 0.46;
/// Pattern as a fraction of the contrast below which weights that know the texture leave
/// nothing else of it: with both, z of compressed images of a quality above 65 is 0.86.
const FAINT_PATTERN: f64 = 0.1;
/// Widest blur of an edge that is measured \[px\]: rendered motion, a box of 20.8 px,
/// is measured without fault up to 7.4 px of blur, and was off by some pixels from
/// 7.5 px on.
pub(super) const WIDEST_BLUR_PX: f64 = 7.4;
/// The same of a box of even motion with a lens's blur: motion of 15.8 px. Flanks of longer
/// ones were taken for shading once in some hundred frames, and the width was 1 px off.
pub(super) const WIDEST_MOTION_PX: f64 = 4.8;

impl Work {
    /// Whether one edge alone is hidden: then it is covered, not of another kind
    /// than the other one.
    pub(super) fn one_is_lost(&self) -> bool {
        let lost = |side: &Tracer| side.is_hidden() && side.misfit_of_a_row() > STRANGE;
        lost(&self.left) != lost(&self.right)
    }

    /// Takes out calipers that disagree with their neighbours, on either edge.
    pub(super) fn sort_out(&mut self, bright: bool) -> Result<(), Reject> {
        self.drop_contradictions(bright);
        let mut worst: f64 = 0.0;
        for side in [&mut self.left, &mut self.right] {
            if side.is_covered() {
                side.drop_strays(self.least_off_px);
            }
            let edges = side.edges_mut();
            worst = worst.max(outlier::sort_out(edges, self.least_off_px, &mut self.scatter));
        }
        let got = self.left.used_share().min(self.right.used_share());
        let enough =
            [&self.left, &self.right].iter().all(|side| side.used_share() >= need_of(side));
        let limit = self.scatter_limit();
        if worst > limit {
            return Err(Reject::Scattered { got_px: worst, limit_px: limit });
        }
        if !enough {
            let need = f64::max(need_of(&self.left), need_of(&self.right));
            return Err(Reject::NoPair { got, need });
        }
        Ok(())
    }

    /// Takes out places that step the wrong way for the bead's polarity, and lines
    /// whose two edges cross.
    fn drop_contradictions(&mut self, bright: bool) {
        let sides = [(&mut self.left, bright), (&mut self.right, !bright)];
        for (side, steps_up) in sides {
            for edge in side.edges_mut() {
                *edge = edge.take_if(|edge| (edge.height > 0.0) == steps_up);
            }
        }
        let (left, right) = (self.left.edges_mut(), self.right.edges_mut());
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
    pub(super) fn check_blur(&self, limit_px: f64) -> Result<(), Reject> {
        let got_px = self.left.blur_px.max(self.right.blur_px);
        if got_px > limit_px { Err(Reject::Blurred { got_px, limit_px }) } else { Ok(()) }
    }

    /// Looks at the pattern beside the bead: adds to the edges' variance what it may
    /// move them by, and refuses one that is as strong as an edge.
    pub(super) fn check_ground<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        of_both: fn(f64, f64) -> f64,
    ) -> Result<(), Reject> {
        let noise = f64::from(self.noise.grey);
        self.is_beside_groove = self.gauge.edge == EdgeKind::Groove;
        let mut strengths = [0.0_f64; 2];
        let sides = [(&mut self.left, -1.0), (&mut self.right, 1.0)];
        for (((tracer, outwards), contrast), strength) in
            sides.into_iter().zip(self.contrasts).zip(&mut strengths)
        {
            tracer.uncertainty.ground_variance = 0.0;
            if !tracer.is_on_ground {
                continue;
            }
            place(tracer, &self.lines, &mut self.places);
            let blur_px = tracer.blur_px;
            let side = Side { places: &self.places, outwards, blur_px, room_px: f64::INFINITY };
            if self.gauge.edge == EdgeKind::Auto {
                self.is_beside_groove |= tracer.is_beside_groove(outwards > 0.0, noise / contrast);
            }
            let Some(pattern) = self.ground.pattern(strip, &side, noise) else { continue };
            *strength = pattern.size_grey / contrast;
            // Rough edges know what the ground beside them leaves open, weights that know a
            // texture what a faint one does.
            let is_in_weights = tracer.knows_texture() && *strength < FAINT_PATTERN;
            if tracer.uncertainty.mean_variance.is_none() && !is_in_weights {
                let px_per_grey = PATTERN_SHARE * ROOT_TWO_PI * tracer.blur_px / contrast;
                tracer.uncertainty.ground_variance =
                    pattern.mean_variance * px_per_grey * px_per_grey;
            }
        }
        self.pattern_share = strengths[0].min(strengths[1]);
        let (got, limit) = (of_both(strengths[0], strengths[1]), STRONGEST_PATTERN);
        if got > limit { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
    }

    /// Refuses edges in a pattern that were located line by line: parts of it were taken for
    /// them.
    pub(super) fn check_lines_in_pattern(&self) -> Result<(), Reject> {
        let (got, limit) = (self.pattern_share, STRONGEST_OF_LINES);
        let is_among = self.way == Way::Lines && got > limit;
        if is_among { Err(Reject::Patterned { got, limit }) } else { Ok(()) }
    }

    /// Scatter of an edge from which on it is noise \[px\].
    fn scatter_limit(&self) -> f64 {
        let sides = [&self.left, &self.right];
        let whole = |side: &&Tracer| side.is_clear() && side.used_share() > WHOLE_SHARE;
        if self.is_lost {
            LOST_SCATTER_PX
        } else if sides.iter().all(whole) {
            WHOLE_SCATTER_PX
        } else {
            MAX_SCATTER_PX
        }
    }

    pub(super) fn check_contrast(&mut self) -> Result<(), Reject> {
        let need = self.gauge.min_contrast_grey;
        self.contrasts = [self.contrast(true), self.contrast(false)];
        let got = self.contrasts[0].min(self.contrasts[1]);
        if got < need {
            return Err(self.too_much_light().unwrap_or(Reject::LowContrast { got, need }));
        }
        Ok(())
    }

    /// Median height of an edge's steps \[grey levels\].
    fn contrast(&mut self, left: bool) -> f64 {
        let side = if left { &self.left } else { &self.right };
        self.scatter.clear();
        self.scatter.extend(side.edges().iter().flatten().map(|edge| edge.height.abs()));
        rank::median(&mut self.scatter).unwrap_or(0.0)
    }

    /// Refuses a bead of whose edges too little is uncovered to tell where they
    /// run.
    pub(super) fn check_covered(&self, found: &WidthMeasurement) -> Result<(), Reject> {
        let got_px = found.sigma.get() / found.width.get() * f64::from(self.width_px);
        let sides = [&self.left, &self.right];
        let sparse = |side: &&Tracer| side.is_covered() && side.used_share() < PLENTY_CLEAR;
        let winding = |side: &&Tracer| side.is_covered() && side.seems_winding();
        let (limit, unsure) = if sides.iter().any(winding) {
            (WINDING_SIGMA_PX, true)
        } else {
            (COVERED_SIGMA_PX, sides.iter().any(sparse))
        };
        if unsure && got_px > limit {
            return Err(Reject::Occluded { got_px, limit_px: limit });
        }
        Ok(())
    }

    /// Refuses a bead whose edges the border of the gauge cuts short.
    pub(super) fn check_border(&self, across: usize) -> Result<(), Reject> {
        let last = float(across.saturating_sub(1));
        for side in [&self.left, &self.right] {
            let need_px = f64::max(BORDER_PX, BORDER_BLURS * side.blur_px);
            let places = side.edges().iter().flatten();
            let distances = places.map(|edge| edge.at.min(last - edge.at));
            let (mut near, mut all, mut got_px) = (0.0, 0.0, f64::INFINITY);
            for distance in distances {
                all += 1.0;
                if distance < need_px {
                    near += 1.0;
                    got_px = got_px.min(distance.max(0.0));
                }
            }
            if near > NEARER * all {
                return Err(Reject::Clipped { got_px, need_px });
            }
        }
        Ok(())
    }
}

/// Where an edge lies on the caliper lines that show it.
pub(super) fn place(tracer: &Tracer, lines: &[RowRange], places: &mut Vec<Place>) {
    let edges = tracer.edges().iter().zip(lines);
    places.clear();
    places.extend(edges.filter_map(|(edge, &rows)| Some(Place { rows, at: edge.as_ref()?.at })));
}

/// Share of the rows from which an edge must come.
fn need_of(side: &Tracer) -> f64 {
    if side.is_covered() { NEED_CLEAR_ROWS } else { NEED_ROWS }
}

/// Whether edges are no blurred steps, from their misfits.
pub fn is_strange(misfits: [f64; 2]) -> bool {
    misfits.iter().all(|&misfit| misfit > STRANGE)
        || misfits.iter().any(|&misfit| misfit > VERY_STRANGE)
}
