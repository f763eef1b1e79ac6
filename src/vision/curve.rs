//! Position of an edge along the gauge as a polynomial of low order: its mean, direction and bend.

use crate::numeric::number::to_f64;
use nalgebra::{SMatrix, SVector};

/// Terms of a curve at most. By definition those up to t⁴.
const MAX_TERMS: usize = 5;
/// Terms of a straight bead. By definition those up to t.
const LINE_TERMS: usize = 2;
/// Terms of a bead that is evenly bent. By definition those up to t².
const PARABOLA_TERMS: usize = 3;
/// Bend, in its standard deviations, from which on it is accepted. Derived: noise alone exceeds 4
/// in 6 of 100,000 frames, and a false bend turns the normals of the whole gauge.
pub const MIN_BEND_SIGMAS: f64 = 4.0;
/// Spread about a parabola from which on more terms are tried \[px\].
pub const NOTABLE_SCATTER_PX: f64 = 0.25;
/// Fraction of the squared spread that more terms must explain to be used.
const MIN_EXPLAINED: f64 = 0.8;
/// Largest fraction of it that more terms leave on an evenly bent bead: a torn edge's waves leave
/// more.
const MAX_UNEXPLAINED: f64 = 0.02;
/// Largest correlation from point to point that is accepted.
const MAX_CORRELATION: f64 = 0.95;
/// Iterations in which slope and bend in the middle converge beside the higher orders.
const ARC_PASSES: usize = 3;

/// A point of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgePoint {
    /// Position along the gauge: −1 at its first row, 1 at its last.
    pub t: f64,
    /// Position across it \[px\].
    pub u: f64,
    /// Rows that it comes from, as a fraction of its band.
    pub weight: f64,
}

/// A sum of Legendre polynomials, so that the first coefficient is the mean
/// over the whole gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeCurve {
    terms: [f64; MAX_TERMS],
    /// Number of its terms.
    pub count: usize,
    /// Variance of the mean over the gauge, for points of weight 1 and
    /// variance 1.
    pub mean_variance: f64,
    /// Variance of the second coefficient, the direction, likewise.
    pub slope_variance: f64,
    /// Variance of the third, the bend; 0 of a straight line.
    pub bend_variance: f64,
    /// Mean square of the points' distances from a parabola \[px²\].
    pub about_parabola: f64,
}

impl EdgeCurve {
    /// Fits points; `reach_px` is half the length of the gauge. `None` where there are too few
    /// points or they lie too close together.
    pub fn fit(points: impl Iterator<Item = EdgePoint> + Clone, reach_px: f64) -> Option<Self> {
        let sums = CurveSums::<PARABOLA_TERMS>::of(points.clone());
        let (straight, _) = sums.curve::<LINE_TERMS>()?;
        let Some((few, off)) = sums.curve::<PARABOLA_TERMS>() else { return Some(straight) };
        let with_scatter = |curve: Self| Some(Self { about_parabola: off, ..curve });
        // An uncertain bend would give wrong positions beyond the gauge's ends, where the normals
        // of a slanted bead may cross it.
        let notable = off > NOTABLE_SCATTER_PX * NOTABLE_SCATTER_PX;
        let more = (notable && sums.weight >= 4.0 * to_f64(MAX_TERMS))
            .then(|| CurveSums::<MAX_TERMS>::of(points.clone()).curve::<MAX_TERMS>())
            .flatten();
        let left = more.map_or(1.0, |(_, rest)| rest / off);
        // What more terms fit nearly exactly is the shape of the bead; else it is waves of its
        // edge.
        let waves = notable && left > MAX_UNEXPLAINED;
        let apart = if waves { few.design_effect(points) } else { 1.0 };
        if few.terms[2] * few.terms[2]
            < MIN_BEND_SIGMAS * MIN_BEND_SIGMAS * off * apart * few.bend_variance
        {
            return with_scatter(straight);
        }
        if let Some((more, _)) = more.filter(|_| left < 1.0 - MIN_EXPLAINED) {
            return with_scatter(more);
        }
        with_scatter(few.as_arc(reach_px))
    }

    /// By how much the variance of a mean grows because neighbouring points lie off the
    /// curve together, as along a torn edge: (1 + r)/(1 − r) for a correlation r from
    /// point to point.
    fn design_effect(&self, points: impl Iterator<Item = EdgePoint>) -> f64 {
        let (mut squares, mut products) = (0.0, 0.0);
        let mut last = 0.0;
        for point in points {
            let off = point.u - self.at(point.t);
            squares += off * off;
            products += off * last;
            last = off;
        }
        let correlation =
            (products / f64::max(squares, f64::MIN_POSITIVE)).clamp(0.0, MAX_CORRELATION);
        (1.0 + correlation) / (1.0 - correlation)
    }

    /// Adds the third and fourth order of the arc with the parabola's slope and bend in the middle:
    /// u‴ = 3u′u″²/(1 + u′²) and u⁗ = 3u″³(1 + 5u′²)/(1 + u′²)². An evenly bent bead is an arc;
    /// without these orders its axis is off and widths are taken obliquely.
    fn as_arc(mut self, reach_px: f64) -> Self {
        for _ in 0..ARC_PASSES {
            let (slope, bend) = (self.slope(0.0), self.bend(0.0));
            let tangent = slope / reach_px;
            let length = 1.0 + tangent * tangent;
            let per_px = bend / reach_px;
            let third = 3.0 * tangent * bend * per_px / length;
            let bent = 1.0 + 5.0 * tangent * tangent;
            let fourth = 3.0 * bend * per_px * per_px * bent / (length * length);
            // t³ is ⅖P₃ and t⁴ is 8/35 P₄, beside lower orders that were fitted.
            self.terms[3] = 0.4 * third / 6.0;
            self.terms[4] = 8.0 / 35.0 * fourth / 24.0;
        }
        self
    }

    /// Legendre coefficient of an order \[px\]; 0 beyond its terms.
    pub fn coefficient(&self, order: usize) -> f64 {
        self.terms.get(order).copied().unwrap_or(0.0)
    }

    /// Position across the bead at a position along it \[px\].
    pub fn at(&self, t: f64) -> f64 {
        let values = legendre(t);
        (0..MAX_TERMS).map(|k| self.terms[k] * values[k]).sum()
    }

    /// Slope at a position: the change of the position across for a step of 1 in t \[px\].
    pub fn slope(&self, t: f64) -> f64 {
        let terms = &self.terms;
        let square = t * t;
        terms[1]
            + 3.0 * terms[2] * t
            + 1.5 * terms[3] * (5.0 * square - 1.0)
            + 2.5 * terms[4] * t * (7.0 * square - 3.0)
    }

    /// Second derivative by t at a position \[px\].
    pub fn bend(&self, t: f64) -> f64 {
        let [_, _, c, d, e] = self.terms;
        3.0 * c + 15.0 * d * t + 7.5 * e * (7.0 * t * t - 1.0)
    }
}

/// Sums over points for curves of up to `N` terms.
struct CurveSums<const N: usize> {
    matrix: SMatrix<f64, N, N>,
    vector: SVector<f64, N>,
    square: f64,
    weight: f64,
    /// Position that all others are taken from \[px\].
    from: f64,
}

impl<const N: usize> CurveSums<N> {
    fn of(points: impl Iterator<Item = EdgePoint>) -> Self {
        let mut points = points.peekable();
        let from = points.peek().map_or(0.0, |point| point.u);
        let (matrix, vector) = (SMatrix::zeros(), SVector::zeros());
        let mut sums = Self { matrix, vector, square: 0.0, weight: 0.0, from };
        for point in points {
            let (values, u) = (legendre(point.t), point.u - from);
            sums.weight += point.weight;
            sums.square += point.weight * u * u;
            for i in 0..N {
                let weighted = point.weight * values[i];
                sums.vector[i] += weighted * u;
                for (j, value) in values.iter().take(i + 1).enumerate() {
                    sums.matrix[(i, j)] += weighted * value;
                }
            }
        }
        sums.matrix.fill_upper_triangle_with_lower_triangle();
        sums
    }

    /// The curve of the first `M` terms and the mean square of the points'
    /// distances from it \[px²\].
    fn curve<const M: usize>(&self) -> Option<(EdgeCurve, f64)> {
        let matrix = self.matrix.fixed_view::<M, M>(0, 0).into_owned();
        let vector = self.vector.fixed_rows::<M>(0).into_owned();
        let inverse = matrix.cholesky()?.inverse();
        let found = inverse * vector;
        let mut terms = [0.0; MAX_TERMS];
        terms[..M].copy_from_slice(found.as_slice());
        terms[0] += self.from;
        if !terms.iter().all(|term| term.is_finite()) {
            return None;
        }
        let variance = |k: usize| if k < M { inverse[(k, k)] } else { 0.0 };
        let curve = EdgeCurve {
            terms,
            count: M,
            mean_variance: variance(0),
            slope_variance: variance(1),
            bend_variance: variance(2),
            about_parabola: 0.0,
        };
        let rest = (self.square - found.dot(&vector)).max(0.0);
        Some((curve, rest / self.weight.max(1e-9)))
    }
}

fn legendre(t: f64) -> [f64; MAX_TERMS] {
    let s = t * t;
    [1.0, t, 1.5 * s - 0.5, t * (2.5 * s - 1.5), (35.0 * s - 30.0) * s / 8.0 + 0.375]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(of: impl Fn(f64) -> f64) -> Vec<EdgePoint> {
        (0..40u8)
            .map(|k| (f64::from(k) + 0.5) / 20.0 - 1.0)
            .map(|t| EdgePoint { t, u: of(t), weight: 1.0 })
            .collect()
    }

    #[test]
    fn a_parabola_comes_back_even_through_a_gap() {
        let of = |t: f64| 100.0 + 8.0 * t - 3.0 * t * t;
        let mut points = points(of);
        points.drain(10..22);
        let curve = EdgeCurve::fit(points.iter().copied(), 1e9).unwrap();
        for t in [-1.0, -0.3, 0.0, 0.9] {
            assert!((curve.at(t) - of(t)).abs() < 1e-9);
            assert!((curve.slope(t) - (8.0 - 6.0 * t)).abs() < 1e-8);
        }
        assert!((curve.terms[0] - 99.0).abs() < 1e-9);
    }

    #[test]
    fn what_bends_more_is_followed_when_that_explains_it() {
        let of = |t: f64| 100.0 + 6.0 * (t * t * t - t) + 4.0 * t.powi(4);
        let curve = EdgeCurve::fit(points(of).into_iter(), 1e9).unwrap();
        assert!((curve.at(0.4) - of(0.4)).abs() < 1e-9);
        let slope = (curve.at(0.4 + 1e-5) - curve.at(0.4 - 1e-5)) / 2e-5;
        assert!((curve.slope(0.4) - slope).abs() < 1e-6);
    }

    #[test]
    fn an_arc_is_followed_where_a_parabola_is_off() {
        let (radius, reach) = (300.0, 85.0);
        for degrees in [0.0f64, 10.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let of = |t: f64| {
                radius * cosine - (radius * radius - (radius * sine + t * reach).powi(2)).sqrt()
            };
            let curve = EdgeCurve::fit(points(of).into_iter(), reach).unwrap();
            let parabola = EdgeCurve::fit(points(of).into_iter(), 1e9).unwrap();
            let off = |curve: &EdgeCurve| {
                let off = |t: f64| (curve.at(t) - of(t)).abs();
                points(off).iter().fold(0.0, |most: f64, point| most.max(point.u))
            };
            assert!(off(&curve) < 0.15 * off(&parabola), "{} {}", off(&curve), off(&parabola));
        }
    }

    #[test]
    fn one_point_is_no_curve() {
        assert_eq!(EdgeCurve::fit(points(|t| t).into_iter().take(1), 1e9), None);
    }
}
