//! Widths of the bead along the gauge: sections normal to its local axis, on the
//! surface.

use nalgebra::Vector2;

use super::width_input::WidthInput;
use crate::core::SurfacePoint;
use crate::numeric::gauss_legendre::GAUSS_LEGENDRE_5;
use crate::vision::curve::EdgeCurve;

/// Step of the central differences for an edge's direction and bend on the surface, in halves of
/// the gauge.
const DIFFERENCE_STEP: f64 = 0.15;

/// An edge at a position t along the gauge: its point on the surface, and the first and second
/// derivatives by t \[mm\].
struct LocalEdge {
    at: SurfacePoint,
    slope: Vector2<f64>,
    bend: Vector2<f64>,
}

impl LocalEdge {
    fn of(scene: &WidthInput<'_>, curve: &EdgeCurve, t: f64) -> Option<Self> {
        let at = scene.on_surface(curve, t)?;
        let before = scene.on_surface(curve, t - DIFFERENCE_STEP)? - at;
        let after = scene.on_surface(curve, t + DIFFERENCE_STEP)? - at;
        let slope = (after - before) / (2.0 * DIFFERENCE_STEP);
        let bend = (after + before) / (DIFFERENCE_STEP * DIFFERENCE_STEP);
        Some(Self { at, slope, bend })
    }

    /// Point of the edge on the line through `from` normal to `along`, by Newton's method.
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
#[derive(Default)]
pub struct Sections {
    /// Mean over the gauge \[mm\].
    pub mean: f64,
    /// Widths as the first three Legendre coefficients over the gauge \[mm\].
    pub terms: [f64; 3],
    /// Component along the bead of the line from edge to edge across the gauge, mean \[mm\].
    pub oblique: f64,
    /// Mean of that component times the change of the axis' direction by a bend of 1 px, for a half
    /// gauge of 1 px.
    pub oblique_by_bend: f64,
    /// Millimetres normal to the bead per pixel across the gauge, at the left and the right edge.
    pub scales: [f64; 2],
}

impl Sections {
    /// Cuts the bead along the gauge; `None` where an edge has no point on the surface.
    pub fn cut(scene: &WidthInput<'_>, curves: &[EdgeCurve; 2]) -> Option<Self> {
        let mut sections = Self::default();
        for (t, weight) in GAUSS_LEGENDRE_5 {
            let left = LocalEdge::of(scene, &curves[0], t)?;
            let right = LocalEdge::of(scene, &curves[1], t)?;
            let axis = (left.slope + right.slope).try_normalize(1e-12)?;
            let middle = nalgebra::center(&left.at, &right.at);
            let across = right.crossing(middle, axis) - left.crossing(middle, axis);
            let width = across.norm();
            let fraction = 0.5 * weight;
            sections.mean += fraction * width;
            sections.terms[0] += fraction * width;
            sections.terms[1] += 3.0 * fraction * width * t;
            sections.terms[2] += 5.0 * fraction * width * (1.5 * t * t - 0.5);
            let oblique = fraction * (right.at - left.at).dot(&axis);
            sections.oblique += oblique;
            sections.oblique_by_bend += 3.0 * t * scene.cosine_squared(curves, t) * oblique;
        }
        sections.measure_scales(scene, curves)?;
        sections.mean.is_finite().then_some(sections)
    }

    fn measure_scales(&mut self, scene: &WidthInput<'_>, curves: &[EdgeCurve; 2]) -> Option<()> {
        let middles = [scene.on_surface(&curves[0], 0.0)?, scene.on_surface(&curves[1], 0.0)?];
        let across = (middles[1] - middles[0]).try_normalize(1e-12)?;
        let slope = |side: usize| -> Option<Vector2<f64>> {
            Some(
                scene.on_surface(&curves[side], DIFFERENCE_STEP)?
                    - scene.on_surface(&curves[side], -DIFFERENCE_STEP)?,
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

    /// Width at a position along the gauge \[mm\].
    pub fn at(&self, t: f64) -> f64 {
        self.terms[0] + self.terms[1] * t + self.terms[2] * (1.5 * t * t - 0.5)
    }
}
