//! From edges in pixels to a width on the surface: the course of each edge
//! along the gauge is taken to the surface, and widths are taken there normal
//! to the line midway between the two, which is the bead's local axis.

mod sections;
mod spread;

use crate::calibration::SurfaceMap;
use crate::core::geometry::SurfacePoint;
use crate::core::units::Mm;

use super::corner;
use super::curve::{Curve, NOTABLE_PX, Point};
use super::gauge::Gauge;
use super::reject::Reject;
use super::strip::View;
use super::trace::Located;
use super::width::{Hints, WidthMeasurement};
use sections::Sections;
use spread::Spread;

/// Largest angle between the bead and the gauge's axis that is measured: the
/// 20 degrees of the contract and a little for the measurement's own noise.
const MAX_SLANT_RAD: f64 = 0.38;
/// The same at the ends of the gauge, where a bent bead is steeper and a
/// corner shows as one that is steeper still.
const MAX_END_SLANT_RAD: f64 = 0.44;
/// Smallest radius of a bead's axis in its widths: what bends more sharply is
/// a corner.
const LEAST_RADIUS: f64 = 1.5;
/// Angle over half the gauge below which a bend is a bead's waviness.
const LEAST_TURN_RAD: f64 = 0.25;
/// Share of the gauge on either side of its middle from which the edge points
/// there are taken.
const MIDDLE_SHARE: f64 = 0.125;
/// Places and weights of the Gauss–Legendre rule by which the mean over the
/// gauge is taken.
const NODES: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189),
    (-0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.0, 0.568_888_888_888_889),
    (0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.906_179_845_938_664, 0.236_926_885_056_189),
];

/// One edge as it was found.
#[derive(Debug, Clone, Copy)]
pub struct Side<'a> {
    /// Its places, band by band.
    pub places: &'a [Option<Located>],
    /// Variance of the whole edge's position that all places share \[px²\].
    pub common_variance: f64,
    /// What a row leaves of the step that it is held against, in standard
    /// deviations of its noise; infinite where it was not held against one.
    pub misfit: f64,
    /// Variance of the mean position over the gauge \[px²\], where it is known
    /// without looking at how far the places lie off their course.
    pub mean_variance: Option<f64>,
}

/// What a width is taken from.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The gauge over the image.
    pub view: &'a View,
    /// From pixels to millimetres.
    pub surface: &'a SurfaceMap,
    /// What is expected.
    pub gauge: &'a Gauge,
    /// Middles of the bands along the bead \[px\].
    pub middles: &'a [f64],
    /// Left and right edge.
    pub sides: [Side<'a>; 2],
}

/// Memory that is kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    off: [Vec<Option<f64>>; 2],
    values: Vec<f64>,
}

/// Width of the bead.
pub fn width(
    scene: &Scene<'_>,
    hints: Hints,
    memory: &mut Memory,
) -> Result<WidthMeasurement, Reject> {
    let failed = Reject::NoPair { got: 0.0, need: 0.0 };
    let curve = |side: usize| Curve::fit(scene.points(side), scene.reach()).ok_or(failed);
    let curves = [curve(0)?, curve(1)?];
    let slant_rad = scene.slant(&curves)?;
    let sections = Sections::cut(scene, &curves).ok_or(Reject::OffSurface)?;
    scene.check_width(sections.mean)?;
    for (side, (curve, off)) in curves.iter().zip(&mut memory.off).enumerate() {
        scene.lay_off(side, curve, off);
    }
    let spread = Spread::of(scene, &curves, &sections, memory);
    let edge = |side: usize| {
        let at = curves[side].at(0.0) + scene.off_at_middle(&memory.off[side]);
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

impl Scene<'_> {
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    fn centre(&self) -> f64 {
        (self.view.along - 1) as f64 / 2.0
    }

    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    fn reach(&self) -> f64 {
        self.view.along as f64 / 2.0
    }

    /// Place of a band along the gauge, −1 to 1.
    fn place(&self, band: usize) -> f64 {
        (self.middles[band] - self.centre()) / self.reach()
    }

    fn points(&self, side: usize) -> impl Iterator<Item = Point> + Clone {
        let places = self.sides[side].places.iter().enumerate();
        places.filter_map(|(band, located)| {
            let located = (*located)?;
            Some(Point { t: self.place(band), u: located.at, weight: located.share })
        })
    }

    /// Angle of the bead in the middle of the gauge \[rad\]; refuses beads that
    /// run too far off the gauge's axis there or at its ends.
    fn slant(&self, [left, right]: &[Curve; 2]) -> Result<f64, Reject> {
        let at = |t: f64| (f64::midpoint(left.slope(t), right.slope(t)) / self.reach()).atan();
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
    fn check_bend(&self, left: &Curve, right: &Curve) -> Result<(), Reject> {
        let turn = |side: usize, curve: &Curve| {
            let off = curve.about_parabola;
            let notable = off > NOTABLE_PX * NOTABLE_PX;
            if notable { corner::turn(&self.points(side), off, self.reach()) } else { 0.0 }
        };
        let of_left = turn(0, left);
        if of_left != 0.0 && corner::is_corner([of_left, turn(1, right)]) {
            return Err(Reject::Corner { got_widths: 0.0, least_widths: LEAST_RADIUS });
        }
        let square = self.reach() * self.reach();
        // Towards the ends a short polynomial follows waviness too eagerly.
        for (t, _) in &NODES[1..4] {
            let t = *t;
            let slope = f64::midpoint(left.slope(t), right.slope(t)) / self.reach();
            let bend = f64::midpoint(left.bend(t), right.bend(t)).abs() / square;
            let length = 1.0 + slope * slope;
            // Radius and width normal to the axis, of which there are so many.
            let radius = length * length.sqrt() / bend;
            let width = (right.at(t) - left.at(t)) / length.sqrt();
            let got_widths = radius / width;
            let turn = bend * self.reach() / length;
            if got_widths < LEAST_RADIUS && turn > LEAST_TURN_RAD {
                return Err(Reject::Corner { got_widths, least_widths: LEAST_RADIUS });
            }
        }
        Ok(())
    }

    /// Square of the cosine between the bead and the gauge's axis at a place.
    fn cosine_squared(&self, curves: &[Curve; 2], t: f64) -> f64 {
        let slope = f64::midpoint(curves[0].slope(t), curves[1].slope(t)) / self.reach();
        1.0 / (1.0 + slope * slope)
    }

    fn check_width(&self, got_mm: f64) -> Result<(), Reject> {
        let (min_mm, max_mm) = (self.gauge.width_range.0.get(), self.gauge.width_range.1.get());
        if (min_mm..=max_mm).contains(&got_mm) {
            Ok(())
        } else {
            Err(Reject::WidthOutOfRange { got_mm, min_mm, max_mm })
        }
    }

    /// The point of an edge on the surface.
    fn on_surface(&self, curve: &Curve, t: f64) -> Option<SurfacePoint> {
        let v = self.centre() + t * self.reach();
        self.surface.to_mm(self.view.to_image(curve.at(t), v))
    }

    /// How far each place lies off the course of its edge \[px\].
    fn lay_off(&self, side: usize, curve: &Curve, off: &mut Vec<Option<f64>>) {
        off.clear();
        let places = self.sides[side].places.iter().enumerate();
        off.extend(places.map(|(band, located)| {
            located.as_ref().map(|located| located.at - curve.at(self.place(band)))
        }));
    }

    /// Mean distance from the course near the middle of the gauge \[px\].
    fn off_at_middle(&self, off: &[Option<f64>]) -> f64 {
        let near = |band: &usize| self.place(*band).abs() <= MIDDLE_SHARE;
        let (mut sum, mut n) = (0.0, 0.0);
        for value in (0..off.len()).filter(near).filter_map(|band| off[band]) {
            sum += value;
            n += 1.0;
        }
        sum / f64::max(n, 1.0)
    }
}
