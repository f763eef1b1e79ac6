//! From edges in pixels to a width on the surface: the curve of each edge along the gauge is mapped
//! to the surface, and widths are taken there normal to the line midway between the two, the bead's
//! local axis.

mod sections;
mod spread;
mod width_input;

use crate::core::Mm;

use super::corner;
use super::curve::{EdgeCurve, NOTABLE_SCATTER_PX};
use super::reject::Reject;
use super::width::{Hints, WidthMeasurement};
use crate::numeric::gauss_legendre::GAUSS_LEGENDRE_5;
use sections::Sections;
use spread::{CutBead, WidthUncertainty};
pub use width_input::{LocatedEdge, WidthInput, WidthScratch};

/// Largest angle between the bead and the gauge's axis that is measured: the 20 degrees of the
/// contract and a margin for noise.
const MAX_SLANT_RAD: f64 = 0.38;
/// Largest such angle at the ends of the gauge, where a bent bead is steeper; at a corner it is
/// steeper still.
const MAX_END_SLANT_RAD: f64 = 0.44;
/// Smallest radius of a bead's axis, in widths of the bead: a sharper bend is a corner.
const MIN_RADIUS_WIDTHS: f64 = 1.5;
/// Angle over half the gauge below which a bend is a bead's waviness.
const MIN_TURN_RAD: f64 = 0.25;
/// Fraction of the gauge on either side of its middle from which the edge points
/// there are taken.
const MIDDLE_FRACTION: f64 = 0.125;
/// Width of the bead on the surface, normal to its axis, or the reason for refusing.
pub fn width(
    scene: &WidthInput<'_>,
    hints: Hints,
    scratch: &mut WidthScratch,
) -> Result<WidthMeasurement, Reject> {
    let failed = Reject::NoPair { got: 0.0, need: 0.0 };
    let curve = |side: usize| EdgeCurve::fit(scene.points(side), scene.half_length()).ok_or(failed);
    let curves = [curve(0)?, curve(1)?];
    let slant_rad = scene.slant(&curves)?;
    let sections = Sections::cut(scene, &curves).ok_or(Reject::OffSurface)?;
    scene.check_width(sections.mean)?;
    for (side, (curve, off)) in curves.iter().zip(&mut scratch.off).enumerate() {
        scene.residuals_into(side, curve, off);
    }
    let spread =
        WidthUncertainty::of(&CutBead { scene, curves: &curves, sections: &sections }, scratch);
    let edge = |side: usize| {
        let at = curves[side].at(0.0) + scene.residual_at_middle(&scratch.off[side]);
        scene.view.to_image(at, scene.centre())
    };
    let finite = |value: f64| Mm::new(value).map_err(|_| Reject::OffSurface);
    Ok(WidthMeasurement {
        width: finite(sections.mean + spread.shortened)?,
        sigma: finite(spread.sigma)?,
        left: edge(0),
        right: edge(1),
        slant_rad,
        hints,
    })
}

impl WidthInput<'_> {
    /// Angle of the bead in the middle of the gauge \[rad\]; refuses beads that
    /// run too far off the gauge's axis there or at its ends.
    fn slant(&self, [left, right]: &[EdgeCurve; 2]) -> Result<f64, Reject> {
        let at =
            |t: f64| (f64::midpoint(left.slope(t), right.slope(t)) / self.half_length()).atan();
        let crooked = |got_rad: f64, limit_rad: f64| Reject::Crooked { got_rad, limit_rad };
        let middle = at(0.0);
        if middle.abs() > MAX_SLANT_RAD {
            return Err(crooked(middle, MAX_SLANT_RAD));
        }
        for end in [at(-1.0), at(1.0)] {
            if end.abs() > MAX_END_SLANT_RAD {
                return Err(crooked(end, MAX_END_SLANT_RAD));
            }
        }
        self.check_bend(left, right)?;
        Ok(middle)
    }

    /// Refuses corners.
    fn check_bend(&self, left: &EdgeCurve, right: &EdgeCurve) -> Result<(), Reject> {
        let turn = |side: usize, curve: &EdgeCurve| {
            let off = curve.about_parabola;
            let notable = off > NOTABLE_SCATTER_PX * NOTABLE_SCATTER_PX;
            if notable { corner::turn(&self.points(side), off, self.half_length()) } else { 0.0 }
        };
        let of_left = turn(0, left);
        if of_left != 0.0 && corner::is_corner([of_left, turn(1, right)]) {
            return Err(Reject::Corner { got_widths: 0.0, least_widths: MIN_RADIUS_WIDTHS });
        }
        let square = self.half_length() * self.half_length();
        // Near the ends a polynomial of low order follows waviness too closely.
        for (t, _) in &GAUSS_LEGENDRE_5[1..4] {
            let t = *t;
            let slope = f64::midpoint(left.slope(t), right.slope(t)) / self.half_length();
            let bend = f64::midpoint(left.bend(t), right.bend(t)).abs() / square;
            let length = 1.0 + slope * slope;
            // Radius of the axis and width normal to it [px].
            let radius = length * length.sqrt() / bend;
            let width = (right.at(t) - left.at(t)) / length.sqrt();
            let got_widths = radius / width;
            let turn = bend * self.half_length() / length;
            if got_widths < MIN_RADIUS_WIDTHS && turn > MIN_TURN_RAD {
                return Err(Reject::Corner { got_widths, least_widths: MIN_RADIUS_WIDTHS });
            }
        }
        Ok(())
    }

    fn check_width(&self, got_mm: f64) -> Result<(), Reject> {
        let range = self.gauge.width_range;
        let (min_mm, max_mm) = (range.min.get(), range.max.get());
        if (min_mm..=max_mm).contains(&got_mm) {
            Ok(())
        } else {
            Err(Reject::WidthOutOfRange { got_mm, min_mm, max_mm })
        }
    }

    /// Residual of each position from the curve of its edge \[px\].
    fn residuals_into(&self, side: usize, curve: &EdgeCurve, off: &mut Vec<Option<f64>>) {
        off.clear();
        let positions = self.sides[side].positions.iter().enumerate();
        off.extend(positions.map(|(band, located)| {
            located.as_ref().map(|located| located.at - curve.at(self.normalised_position(band)))
        }));
    }

    /// Mean residual near the middle of the gauge \[px\]; 0 where no position is there.
    fn residual_at_middle(&self, off: &[Option<f64>]) -> f64 {
        let near = |band: &usize| self.normalised_position(*band).abs() <= MIDDLE_FRACTION;
        let (mut sum, mut n) = (0.0, 0.0);
        for value in (0..off.len()).filter(near).filter_map(|band| off[band]) {
            sum += value;
            n += 1.0;
        }
        sum / f64::max(n, 1.0)
    }
}
