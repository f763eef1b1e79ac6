//! From edges in pixels to a width on the surface: the course of each edge
//! along the gauge is taken to the surface, and widths are taken there normal
//! to the line midway between the two, which is the bead's local axis.

use nalgebra::Vector2;

use crate::calib::SurfaceMap;
use crate::geometry::SurfacePoint;
use crate::units::Mm;

use super::corner;
use super::curve::{Curve, NOTABLE_PX, Point};
use super::gauge::Gauge;
use super::number::float;
use super::reject::Reject;
use super::scatter;
use super::strip::View;
use super::trace::Located;
use super::waviness::{CURVED, Evidence, Midline, ORDERS, legendre, norm};
use super::width::{Hints, WidthMeasurement};

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
/// Distance of the places from which an edge's direction and bend on the
/// surface are taken.
const BESIDE: f64 = 0.15;
/// Share of the rows from which on nothing but the bead itself is seen.
const ALL_BUT_FEW: f64 = 0.98;
/// Inflation of a variance that an edge's misfit may hide, and by how much more
/// for what it shows: a texture's shift of an edge hangs together over so many
/// rows.
const HIDDEN: f64 = 1.2;
const ALONG: f64 = 15.0;
/// Squared slopes of an axis, in variances of what waves make, that are none.
const OBLIQUE: f64 = 3.0;

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
        roughness: finite(spread.roughness)?,
        left: edge(0),
        right: edge(1),
        slant_rad,
        hints,
    })
}

impl Side<'_> {
    /// By how much places with gaps between them scatter more than noise
    /// explains.
    fn inflation_with_gaps(&self, off: &[Option<f64>], curve: &Curve, per_place: f64) -> f64 {
        let places = off.iter().zip(self.places);
        let places = places.filter_map(|(off, located)| Some(((*off)?, located.as_ref()?.share)));
        scatter::inflation_with_gaps(places, per_place, curve.count)
    }

    /// Most that neighbouring places can hang together: what moves an edge,
    /// unless it is the bead itself, leaves a misfit. Edges that are covered
    /// here and there may hide anything.
    fn most_inflation(&self) -> f64 {
        let seen: f64 = self.places.iter().flatten().map(|located| located.share).sum();
        if seen < ALL_BUT_FEW * float(self.places.len()) {
            return f64::INFINITY;
        }
        HIDDEN + ALONG * (self.misfit * self.misfit - 1.0).max(0.0)
    }
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
        if corner::is_corner([turn(0, left), turn(1, right)]) {
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

    /// How much of the midline's coefficients of the orders 1 to 4 is the
    /// waviness of the two edges \[px²\]; `None` where there is none to speak
    /// of. The width's course tells, and of the midline what is no straight or
    /// evenly bent axis.
    fn waves(
        &self,
        curves: &[Curve; 2],
        sections: &Sections,
        memory: &Memory,
    ) -> Option<[f64; CURVED]> {
        let mut off = [[0.0; ORDERS]; 2];
        let mut bands = [0.0f64; 2];
        for (band, places) in memory.off[0].iter().zip(&memory.off[1]).enumerate() {
            let values = legendre(self.place(band));
            for (side, place) in [places.0, places.1].into_iter().enumerate() {
                let Some(place) = place else { continue };
                bands[side] += 1.0;
                for (sum, value) in off[side].iter_mut().zip(values) {
                    *sum += place * value;
                }
            }
        }
        let scale = f64::midpoint(sections.scales[0], sections.scales[1]);
        let per_place = self.sides.iter().map(|side| mean_variance(side.places)).sum::<f64>();
        let mut evidence = Evidence::default();
        for order in 1..=ORDERS {
            let rest = |side: usize| norm(order) * off[side][order - 1] / bands[side].max(1.0);
            let all = |side: usize| curves[side].coefficient(order) + rest(side);
            let half_width = 0.5
                * match order {
                    1 | 2 => sections.terms[order] / scale + rest(1) - rest(0),
                    _ => all(1) - all(0),
                };
            let noise = norm(order) * per_place / (4.0 * bands[0].min(bands[1]).max(1.0));
            evidence.add(order, half_width, noise);
            if order == 3 || order > CURVED {
                evidence.add(order, f64::midpoint(all(0), all(1)), noise);
            }
        }
        evidence.waves()
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

/// An edge about a place, on the surface.
struct Local {
    at: SurfacePoint,
    slope: Vector2<f64>,
    bend: Vector2<f64>,
}

impl Local {
    fn of(scene: &Scene<'_>, curve: &Curve, t: f64) -> Option<Self> {
        let at = scene.on_surface(curve, t)?;
        let before = scene.on_surface(curve, t - BESIDE)? - at;
        let after = scene.on_surface(curve, t + BESIDE)? - at;
        let slope = (after - before) / (2.0 * BESIDE);
        let bend = (after + before) / (BESIDE * BESIDE);
        Some(Self { at, slope, bend })
    }

    /// Where the normal to a direction through a point crosses the edge.
    fn crossing(&self, from: SurfacePoint, along: Vector2<f64>) -> SurfacePoint {
        let ahead = (self.at - from).dot(&along);
        let (slope, bend) = (self.slope.dot(&along), self.bend.dot(&along));
        let mut moved = 0.0;
        for _ in 0..3 {
            let miss = ahead + moved * (slope + 0.5 * bend * moved);
            moved -= miss / (slope + bend * moved);
        }
        self.at + self.slope * moved + self.bend * (0.5 * moved * moved)
    }
}

/// Widths of the bead along the gauge, normal to its local axis.
struct Sections {
    /// Mean over the gauge \[mm\].
    mean: f64,
    /// Widths as the first three Legendre coefficients over the gauge \[mm\].
    terms: [f64; 3],
    /// Part of the lines across the gauge that runs along the bead, mean
    /// \[mm\].
    oblique: f64,
    /// The same times the direction that a bend of 1 px gives the axis there, for
    /// half a gauge of 1 px.
    oblique_by_bend: f64,
    /// Millimetres normal to the bead for a pixel across the gauge, left and
    /// right.
    scales: [f64; 2],
}

impl Sections {
    /// `None` where an edge has no point on the surface.
    fn cut(scene: &Scene<'_>, curves: &[Curve; 2]) -> Option<Self> {
        let mut sections = Self {
            mean: 0.0,
            terms: [0.0; 3],
            oblique: 0.0,
            oblique_by_bend: 0.0,
            scales: [0.0; 2],
        };
        for (t, weight) in NODES {
            let left = Local::of(scene, &curves[0], t)?;
            let right = Local::of(scene, &curves[1], t)?;
            let axis = (left.slope + right.slope).try_normalize(1e-12)?;
            let middle = nalgebra::center(&left.at, &right.at);
            let across = right.crossing(middle, axis) - left.crossing(middle, axis);
            let width = across.norm();
            let share = 0.5 * weight;
            sections.mean += share * width;
            sections.terms[0] += share * width;
            sections.terms[1] += 3.0 * share * width * t;
            sections.terms[2] += 5.0 * share * width * (1.5 * t * t - 0.5);
            let oblique = share * (right.at - left.at).dot(&axis);
            sections.oblique += oblique;
            sections.oblique_by_bend += 3.0 * t * scene.cosine_squared(curves, t) * oblique;
        }
        sections.measure_scales(scene, curves)?;
        sections.mean.is_finite().then_some(sections)
    }

    fn measure_scales(&mut self, scene: &Scene<'_>, curves: &[Curve; 2]) -> Option<()> {
        let middles = [scene.on_surface(&curves[0], 0.0)?, scene.on_surface(&curves[1], 0.0)?];
        let across = (middles[1] - middles[0]).try_normalize(1e-12)?;
        let slope = |side: usize| -> Option<Vector2<f64>> {
            Some(
                scene.on_surface(&curves[side], BESIDE)?
                    - scene.on_surface(&curves[side], -BESIDE)?,
            )
        };
        let axis = (slope(0)? + slope(1)?).try_normalize(1e-12)?;
        let normal = Vector2::new(-axis.y, axis.x);
        let normal = if normal.dot(&across) < 0.0 { -normal } else { normal };
        for (side, curve) in curves.iter().enumerate() {
            let (u, v) = (curve.at(0.0), scene.centre());
            let beside = scene.surface.to_mm(scene.view.to_image(u + 1.0, v))?;
            self.scales[side] = (beside - middles[side]).dot(&normal).abs();
        }
        Some(())
    }

    /// Width at a place along the gauge \[mm\].
    fn at(&self, t: f64) -> f64 {
        self.terms[0] + self.terms[1] * t + self.terms[2] * (1.5 * t * t - 0.5)
    }
}

/// How sure the width is, and how rough the bead.
struct Spread {
    sigma: f64,
    /// What the doubt about the axis' direction takes from the width in the
    /// mean: an axis that is off by an angle shows 1 − angle²/2 of it.
    shortened: f64,
    roughness: f64,
}

impl Spread {
    fn of(
        scene: &Scene<'_>,
        curves: &[Curve; 2],
        sections: &Sections,
        memory: &mut Memory,
    ) -> Self {
        let (mut variance, mut noise) = (0.0, 0.0);
        for (side, curve) in curves.iter().enumerate() {
            let per_place = mean_variance(scene.sides[side].places);
            let off = &memory.off[side];
            let inflation = scatter::inflation(off, per_place, &mut memory.values)
                .unwrap_or_else(|| scene.sides[side].inflation_with_gaps(off, curve, per_place))
                .min(scene.sides[side].most_inflation());
            let scale = sections.scales[side] * sections.scales[side];
            let of_mean = per_place * inflation * curve.mean_variance;
            variance += scale * (of_mean + scene.sides[side].common_variance);
            noise += scale * per_place * inflation;
        }
        let roughness = Self::roughness(scene, sections, memory, noise);
        variance += Self::hidden(scene, sections, roughness, memory);
        let (shortened, of_tilt) = Self::tilted(scene, curves, sections, memory);
        Self { sigma: (variance + of_tilt).sqrt(), shortened, roughness }
    }

    /// By how much the doubt about the axis' direction makes the width too
    /// short, and the variance that it leaves.
    fn tilted(
        scene: &Scene<'_>,
        curves: &[Curve; 2],
        sections: &Sections,
        memory: &mut Memory,
    ) -> (f64, f64) {
        let oblique = sections.oblique * sections.oblique;
        let Some(waves) = scene.waves(curves, sections, memory) else {
            let [tilt, bend] = Self::tilt_variances(scene, curves, memory);
            let shortened = 0.5 * sections.mean * tilt;
            let of_bend = sections.oblique_by_bend * sections.oblique_by_bend * bend;
            return (shortened, oblique * tilt + of_bend + 2.0 * shortened * shortened);
        };
        let midline = Midline::of(curves);
        let per_slope = scene.cosine_squared(curves, 0.0) / (scene.reach() * scene.reach());
        let first = per_slope * scene.cosine_squared(curves, 0.0) * waves[0];
        // Bends that waves explain are none of the axis.
        let bends = midline.bends_of(&waves);
        let per_bend = 0.5 * sections.mean * per_slope;
        // Waves make a slope of their own; only what is beyond them is that of
        // an axis, along which an error of the direction counts.
        let beyond = (oblique - OBLIQUE * sections.mean * sections.mean * first).max(0.0);
        let of_slope = 0.5 * sections.mean * first;
        let of_bends = per_bend * bends.doubt;
        // Along a bent bead the waves' bend is an error of the direction as well.
        let by_bend = sections.oblique_by_bend / scene.reach();
        let of_axis = beyond * first + bends.is_bent * by_bend * by_bend * waves[1];
        let variance = of_axis + of_slope * of_slope + of_bends * of_bends;
        (of_slope + per_bend * bends.of_waves, variance)
    }

    /// Standard deviation of the width along the gauge, without the noise of
    /// its places.
    fn roughness(scene: &Scene<'_>, sections: &Sections, memory: &Memory, noise: f64) -> f64 {
        let (mut square, mut n) = (0.0, 0.0);
        for (band, (left, right)) in memory.off[0].iter().zip(&memory.off[1]).enumerate() {
            let (Some(left), Some(right)) = (left, right) else { continue };
            let off = sections.scales[1] * right - sections.scales[0] * left;
            let width = sections.at(scene.place(band)) + off - sections.mean;
            square += width * width;
            n += 1.0;
        }
        (square / f64::max(n - 1.0, 1.0) - noise).max(0.0).sqrt()
    }

    /// The bands that are missing hide bead that counts; its waviness is an error then,
    /// which hangs together over neighbouring bands. Each edge has half of it.
    fn hidden(scene: &Scene<'_>, sections: &Sections, roughness: f64, memory: &mut Memory) -> f64 {
        let mut variance = 0.0;
        for (number, side) in scene.sides.iter().enumerate() {
            let seen: f64 = side.places.iter().flatten().map(|located| located.share).sum();
            let missing = 1.0 - seen / float(side.places.len());
            if missing > 0.0 {
                memory.values.clear();
                memory.values.extend(memory.off[number].iter().flatten());
                let waves = scatter::correlated_variance(&memory.values);
                let waves = (waves - mean_variance(side.places)).max(0.0);
                let waves = waves * sections.scales[number] * sections.scales[number];
                variance += waves.max(0.5 * roughness * roughness) * missing / seen.max(1.0);
            }
        }
        variance
    }

    /// Variances of the axis' direction in the middle \[rad²\] and of its bend in
    /// halves of the gauge: where lines across the gauge run obliquely to the bead,
    /// an axis that is off takes them for longer or shorter. From how far the
    /// middles lie off their course, and over how many bands that hangs together.
    fn tilt_variances(scene: &Scene<'_>, curves: &[Curve; 2], memory: &mut Memory) -> [f64; 2] {
        let Memory { off: [left, right], values } = memory;
        values.clear();
        let both = left.iter().zip(right.iter());
        values.extend(both.filter_map(|(left, right)| Some(f64::midpoint((*left)?, (*right)?))));
        let per_place = scatter::correlated_variance(values);
        let slope = f64::midpoint(curves[0].slope_variance, curves[1].slope_variance);
        let bend = f64::midpoint(curves[0].bend_variance, curves[1].bend_variance);
        let cosine = scene.cosine_squared(curves, 0.0);
        let per_term = per_place / (scene.reach() * scene.reach());
        [slope * per_term * cosine * cosine, bend * per_term]
    }
}

/// Mean variance of an edge's places, for a place of all of a band's rows.
fn mean_variance(places: &[Option<Located>]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for located in places.iter().flatten() {
        sum += located.variance * located.share;
        n += 1.0;
    }
    sum / f64::max(n, 1.0)
}
