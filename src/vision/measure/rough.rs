//! Beads whose edges are no blurred steps: torn ones, grooves, texture.

use super::{NEED_SHARE, Work, even};
use crate::calib::SurfaceMap;
use crate::vision::coarse::LinePair;
use crate::vision::gauge::Polarity;
use crate::vision::number::float;
use crate::vision::reject::Reject;
use crate::vision::rough::{RoughFit, Scene};
use crate::vision::strip::{Grey, Strip, View};
use crate::vision::trace::Tracer;
use crate::vision::width::WidthMeasurement;

/// The search range allows 1.5 times too wide and too narrow single places; lines
/// are means over the gauge, and stay nearer.
const LINE_SLACK: f32 = 1.4;

/// Depth of a bay \[px\], also in standard deviations of its place, and the share of
/// caliper lines in bays from which on they count.
const BAY_PX: f64 = 1.0;
const BAY_SIGMAS: f64 = 5.0;
const FEW_BAYS: f64 = 0.015;
/// Share of odd pixels about an edge up to which it is bead and ground alone: grains
/// and sparks have more.
const FEW_ODD: f64 = 0.01;
/// Part of the width beside either edge where its flank may be \[of the width\]: the
/// bead's texture is taken from between.
const TEXTURE_MARGIN: f32 = 0.15;
/// How much stronger than a typical line of texture an edge must be: on layers that
/// are seen from the side, whose lower edges fade into shadow, lines of texture were
/// taken for edges up to 4.8; the edges of concrete beads have 5 to 17.
const STANDS_OUT: f64 = 5.0;

impl Work {
    /// Measures a bead by where its rows pass half height.
    pub(super) fn measure_rough<T: Grey>(
        &mut self,
        strip: &Strip<'_, T>,
        range: (f32, f32),
        view: &View,
        surface: &SurfaceMap,
    ) -> Result<WidthMeasurement, Reject> {
        let fits = self.find_rough(strip, range)?;
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
        let failed = Reject::NoPair { got: 0.0, need: NEED_SHARE };
        let range = (LINE_SLACK * range.0, range.1 / LINE_SLACK);
        self.coarse.look(strip, (range.0 * range.1).sqrt());
        let polarities =
            [self.gauge.polarity != Polarity::Dark, self.gauge.polarity != Polarity::Bright];
        self.coarse.pairs(range, polarities, &mut self.pairs);
        let pair = *self.pairs.first().ok_or(failed)?;
        self.check_stands_out(&pair)?;
        self.check_rivals(&pair)?;
        let scene = Scene {
            strip,
            lines: &self.lines,
            noise: self.noise,
            width_px: pair.width_px(),
            bead_after: true,
            bright: pair.bright,
        };
        let [left, right] = &mut self.rough;
        let left_fit = left.find(&scene, &pair.sides[0]).ok_or(failed)?;
        let right_scene = Scene { bead_after: false, ..scene };
        let right_fit = right.find(&right_scene, &pair.sides[1]).ok_or(failed)?;
        let got = left_fit.rows_fraction.min(right_fit.rows_fraction);
        if got < NEED_SHARE {
            return Err(Reject::NoPair { got, need: NEED_SHARE });
        }
        even::check(&[left_fit, right_fit], even::middle_grey(strip, &pair))?;
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
        self.check_blur()?;
        self.check_ground(strip, f64::min)?;
        self.check_border(strip.across)?;
        self.width_on(view, surface)
    }
}

impl Work {
    /// Whether edges that were measured as blurred steps may be something else.
    pub(super) fn may_be_more_than_steps(&self) -> bool {
        let lost = |side: &Tracer| side.edges().iter().any(Option::is_none);
        self.is_refined || self.is_beside_groove || lost(&self.left) || lost(&self.right)
    }

    /// Whether rough edges explain more than blurred steps do: a groove that no step
    /// is, or bays in an edge that were sorted out as grains.
    pub(super) fn explains_more(&self, fits: &[RoughFit; 2]) -> bool {
        let hidden = fits.iter().any(|fit| fit.is_narrow_groove);
        let grooved = hidden || fits.iter().any(|fit| fit.is_groove);
        let two_levels = fits.iter().all(|fit| fit.odd_share < FEW_ODD);
        if self.is_refined { grooved } else { hidden || two_levels && self.lost_bays() }
    }

    /// Whether places that were sorted out lie in bays of the edges.
    fn lost_bays(&self) -> bool {
        let sides = [(&self.left, &self.rough[0]), (&self.right, &self.rough[1])];
        let bays = sides.map(|(side, rough)| {
            let (mut bays, mut lines) = (0, 0);
            let mut last: Option<f64> = None;
            for (edge, place) in side.edges().iter().zip(rough.lines()) {
                lines += 1;
                last = edge.map(|edge| edge.at).or(last);
                if let (None, Some(place), Some(last)) = (edge, place, last) {
                    let clear = BAY_PX.max(BAY_SIGMAS * place.variance.sqrt());
                    bays += usize::from((place.at - last).abs() > clear);
                }
            }
            float(bays) / float(lines.max(1))
        });
        bays.iter().any(|&share| share > FEW_BAYS)
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
