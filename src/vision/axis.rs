//! From edges in pixels to a width on the surface: the bead's axis is fitted
//! to the middles in millimetres, and each caliper's width is taken normal to
//! it.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::calib::SurfaceMap;
use crate::geometry::{ImagePoint, SurfacePoint};
use crate::units::Mm;

use super::gauge::Gauge;
use super::reject::Reject;
use super::strip::View;
use super::trace::Located;
use super::width::{Hints, WidthMeasurement};

/// Largest angle between the bead and the gauge's axis that is measured: the
/// 20 degrees of the contract and a little for the measurement's own noise.
const MAX_SLANT_RAD: f64 = 0.38;
/// Share of the gauge on either side of its middle from which the edge points
/// there are taken.
const MIDDLE_SHARE: f64 = 0.125;

/// The two edges of one caliper line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Caliper {
    /// Position along the bead \[px\].
    pub along: f64,
    /// Left edge.
    pub left: Located,
    /// Right edge.
    pub right: Located,
}

/// Width of the bead from its calipers, of which there could be `expected`.
/// `memory` is scratch.
pub fn width(
    (calipers, expected): (&[Caliper], usize),
    view: &View,
    surface: &SurfaceMap,
    gauge: &Gauge,
    hints: Hints,
    memory: &mut Vec<f64>,
) -> Result<WidthMeasurement, Reject> {
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    let (centre, reach) = ((view.along - 1) as f64 / 2.0, view.along as f64 / 2.0);
    let place = |along: f64| (along - centre) / reach;
    let slant_rad = slant(calipers, &place, reach)?;
    let axis = Midline::fit(calipers, &place, view, surface, memory)?;
    let mut sums = Sums { tilt_variance: axis.tilt_variance, ..Sums::default() };
    for caliper in calipers {
        let normal = axis.normal(place(caliper.along)).ok_or(Reject::OffSurface)?;
        let (left, right) = points(caliper, view, surface)?;
        sums.add(right - left, normal, caliper);
    }
    let middle_normal = axis.normal(0.0).ok_or(Reject::OffSurface)?;
    let left = edge_at_middle(calipers, &place, |caliper| caliper.left.at);
    let right = edge_at_middle(calipers, &place, |caliper| caliper.right.at);
    let (left, right) = (view.to_image(left, centre), view.to_image(right, centre));
    let across = view.to_image(1.0, 0.0) - view.to_image(0.0, 0.0);
    let scale_left = scale(surface, left, across, middle_normal).ok_or(Reject::OffSurface)?;
    let scale_right = scale(surface, right, across, middle_normal).ok_or(Reject::OffSurface)?;
    let result = sums.finish((scale_left, scale_right), expected);
    let (min, max) = gauge.width_range;
    if !(min.get()..=max.get()).contains(&result.mean) {
        return Err(Reject::WidthOutOfRange {
            got_mm: result.mean,
            min_mm: min.get(),
            max_mm: max.get(),
        });
    }
    let finite = |value: f64| Mm::new(value).map_err(|_| Reject::OffSurface);
    Ok(WidthMeasurement {
        width: finite(result.mean)?,
        sigma: finite(result.sigma)?,
        roughness: finite(result.roughness)?,
        left,
        right,
        slant_rad,
        hints: Hints { used_share: result.used_share, ..hints },
    })
}

/// Running sums over the calipers.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: f64,
    mean: f64,
    squares: f64,
    variance_left: f64,
    variance_right: f64,
    /// Mean of the part of the caliper lines that runs along the bead.
    oblique: f64,
    /// Variance of the axis' direction \[rad²\].
    tilt_variance: f64,
}

struct Averaged {
    mean: f64,
    sigma: f64,
    roughness: f64,
    used_share: f64,
}

impl Sums {
    /// Welford's update, so that a small scatter of wide beads is not lost.
    fn add(&mut self, across: Vector2<f64>, normal: Vector2<f64>, caliper: &Caliper) {
        let width = across.dot(&normal).abs();
        self.n += 1.0;
        self.oblique += (across.perp(&normal) - self.oblique) / self.n;
        let off = width - self.mean;
        self.mean += off / self.n;
        self.squares += off * (width - self.mean);
        self.variance_left += caliper.left.variance;
        self.variance_right += caliper.right.variance;
    }

    fn finish(&self, (scale_left, scale_right): (f64, f64), expected: usize) -> Averaged {
        let noise = scale_left * scale_left * self.variance_left
            + scale_right * scale_right * self.variance_right;
        let scatter = self.squares / (self.n - 1.0).max(1.0);
        let roughness = (scatter - noise / self.n).max(0.0).sqrt();
        #[expect(clippy::cast_precision_loss, reason = "a share needs no more")]
        let used_share = self.n / expected.max(1) as f64;
        // The lines that are missing hide bead that counts; its waviness is
        // an error then.
        let hidden = roughness * roughness * (1.0 - used_share).max(0.0) / self.n;
        // Where the caliper lines run obliquely to the bead, an axis that is
        // off in direction takes them for longer or shorter.
        let tilt = self.oblique * self.oblique * self.tilt_variance;
        let sigma = (noise / (self.n * self.n) + hidden + tilt).sqrt();
        Averaged { mean: self.mean, sigma, roughness, used_share }
    }
}

fn points(
    caliper: &Caliper,
    view: &View,
    surface: &SurfaceMap,
) -> Result<(SurfacePoint, SurfacePoint), Reject> {
    let left = surface.to_mm(view.to_image(caliper.left.at, caliper.along));
    let right = surface.to_mm(view.to_image(caliper.right.at, caliper.along));
    left.zip(right).ok_or(Reject::OffSurface)
}

/// Millimetres normal to the bead for each pixel across the gauge.
fn scale(
    surface: &SurfaceMap,
    at: ImagePoint,
    across: Vector2<f64>,
    normal: Vector2<f64>,
) -> Option<f64> {
    Some((surface.mm_per_px(at)? * across).dot(&normal).abs())
}

/// Angle of the bead's middle line to the gauge's axis \[rad\].
fn slant(calipers: &[Caliper], place: &impl Fn(f64) -> f64, reach: f64) -> Result<f64, Reject> {
    let middles = calipers.iter().map(|caliper| {
        (place(caliper.along), Vector2::new(f64::midpoint(caliper.left.at, caliper.right.at), 0.0))
    });
    let fit = Parabola::fit(middles).ok_or(Reject::NoPair { got: 0.0, need: 0.0 })?;
    let got_rad = (fit.linear.x / reach).atan();
    if got_rad.abs() > MAX_SLANT_RAD {
        return Err(Reject::Crooked { got_rad, limit_rad: MAX_SLANT_RAD });
    }
    Ok(got_rad)
}

/// Where an edge crosses the middle of the gauge: a line through the calipers
/// about it, or through the nearest ones where the middle is hidden.
fn edge_at_middle(
    calipers: &[Caliper],
    place: &impl Fn(f64) -> f64,
    at: impl Fn(&Caliper) -> f64,
) -> f64 {
    let mut share = MIDDLE_SHARE;
    while share < 4.0 {
        let near = || calipers.iter().filter(|caliper| place(caliper.along).abs() <= share);
        if near().count() >= 5 {
            let (mut n, mut sum_p, mut sum_u, mut sum_pp, mut sum_pu) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for caliper in near() {
                let (p, u) = (place(caliper.along), at(caliper));
                n += 1.0;
                sum_p += p;
                sum_u += u;
                sum_pp += p * p;
                sum_pu += p * u;
            }
            let under = n * sum_pp - sum_p * sum_p;
            if under > 0.0 {
                return (sum_pp * sum_u - sum_p * sum_pu) / under;
            }
        }
        share *= 2.0;
    }
    let sum: f64 = calipers.iter().map(&at).sum();
    #[expect(clippy::cast_precision_loss, reason = "there are few calipers")]
    let n = calipers.len().max(1) as f64;
    sum / n
}

/// The bead's middle line on the surface, as a parabola over the place along
/// the gauge, so that a curved bead has a local axis.
struct Midline {
    line: Parabola,
    /// Variance of the direction in the middle \[rad²\], from how far the
    /// middles lie from the line and over how many calipers that is correlated.
    tilt_variance: f64,
}

impl Midline {
    fn fit(
        calipers: &[Caliper],
        place: &impl Fn(f64) -> f64,
        view: &View,
        surface: &SurfaceMap,
        memory: &mut Vec<f64>,
    ) -> Result<Self, Reject> {
        let middle = |caliper: &Caliper| -> Result<(f64, Vector2<f64>), Reject> {
            let (left, right) = points(caliper, view, surface)?;
            Ok((place(caliper.along), nalgebra::center(&left, &right).coords))
        };
        let mut fit = ParabolaFit::default();
        for caliper in calipers {
            let (place, at) = middle(caliper)?;
            fit.add(place, at);
        }
        let failed = Reject::NoPair { got: 0.0, need: 0.0 };
        let mut axis = Self { line: fit.solve().ok_or(failed)?, tilt_variance: 0.0 };
        memory.clear();
        for caliper in calipers {
            let (place, at) = middle(caliper)?;
            let normal = axis.normal(place).ok_or(Reject::OffSurface)?;
            memory.push((at - axis.line.at(place)).dot(&normal));
        }
        let per_place = fit.slope_variance().ok_or(failed)?;
        axis.tilt_variance =
            per_place * correlated_variance(memory) / axis.line.linear.norm_squared();
        Ok(axis)
    }

    /// Unit normal of the line at a place; `None` where the line has no
    /// direction.
    fn normal(&self, place: f64) -> Option<Vector2<f64>> {
        let along = self.line.linear + self.line.bend * (2.0 * place);
        Vector2::new(-along.y, along.x).try_normalize(1e-12)
    }
}

/// Variance of values about zero, times the number of neighbours over which
/// they are correlated (the integrated autocorrelation up to its first zero),
/// so that it may be used as if they were independent.
fn correlated_variance(values: &[f64]) -> f64 {
    let square: f64 = values.iter().map(|value| value * value).sum();
    if square <= 0.0 {
        return 0.0;
    }
    let mut time = 1.0;
    for lag in 1..values.len() / 2 {
        let product: f64 = values.iter().zip(&values[lag..]).map(|(a, b)| a * b).sum();
        if product <= 0.0 {
            break;
        }
        time += 2.0 * product / square;
    }
    #[expect(clippy::cast_precision_loss, reason = "there are few calipers")]
    let freedom = (values.len() as f64 - 3.0).max(1.0);
    square / freedom * time
}

/// p₀ + p₁·t + p₂·t² in two coordinates.
struct Parabola {
    start: Vector2<f64>,
    linear: Vector2<f64>,
    bend: Vector2<f64>,
}

impl Parabola {
    fn at(&self, place: f64) -> Vector2<f64> {
        self.start + (self.linear + self.bend * place) * place
    }

    fn fit(samples: impl Iterator<Item = (f64, Vector2<f64>)>) -> Option<Self> {
        let mut fit = ParabolaFit::default();
        for (place, value) in samples {
            fit.add(place, value);
        }
        fit.solve()
    }
}

/// Normal equations of a parabola.
#[derive(Default)]
struct ParabolaFit {
    matrix: Matrix3<f64>,
    x: Vector3<f64>,
    y: Vector3<f64>,
}

impl ParabolaFit {
    fn add(&mut self, place: f64, value: Vector2<f64>) {
        let row = Vector3::new(1.0, place, place * place);
        self.matrix += row * row.transpose();
        self.x += row * value.x;
        self.y += row * value.y;
    }

    /// Variance of the slope in the middle for values of variance 1.
    fn slope_variance(&self) -> Option<f64> {
        Some(self.matrix.cholesky()?.inverse().m22)
    }

    fn solve(&self) -> Option<Parabola> {
        let solver = self.matrix.cholesky()?;
        let (x, y) = (solver.solve(&self.x), solver.solve(&self.y));
        let start = Vector2::new(x.x, y.x);
        Some(Parabola { start, linear: Vector2::new(x.y, y.y), bend: Vector2::new(x.z, y.z) })
    }
}
