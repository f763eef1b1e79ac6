//! Whether an edge turns at once: two straight lines that meet.

use nalgebra::Vector3;

use super::curve::Point;
use crate::numeric::normal_equations::Normal;

/// Places along the gauge at which an edge may turn, −1 to 1: so many, this far
/// from its middle at most.
const PLACES: u8 = 18;
const FARTHEST: f64 = 0.85;
/// Part of the squared distances from a parabola that two lines may leave.
const LEFT: f64 = 0.5;
/// Smallest turn \[rad\]; what turns less is a bead's waviness.
const LEAST_RAD: f64 = 0.14;

/// By how much an edge turns \[rad\], where two lines that meet follow its points
/// much better than a parabola, which leaves them so far off in the mean square
/// \[px²\]; 0 where they do not. Half the gauge is so long \[px\].
#[cold]
pub fn turn(
    points: &(impl Iterator<Item = Point> + Clone),
    about_parabola: f64,
    reach_px: f64,
) -> f64 {
    let apart = 2.0 * FARTHEST / f64::from(PLACES - 1);
    let corners = (0..PLACES).map(|k| f64::from(k) * apart - FARTHEST);
    let lines = corners.filter_map(|at| Lines::fit(points.clone(), at));
    let best = lines.min_by(|one, other| one.scatter.total_cmp(&other.scatter));
    let best = best.filter(|lines| lines.scatter < LEFT * about_parabola);
    best.map_or(0.0, |lines| {
        let [before, after] = lines.slopes().map(|slope| (slope / reach_px).atan());
        after - before
    })
}

/// Whether two edges that turn so much \[rad\] are those of a corner: both turn,
/// and the same way. One alone has a bump or a notch.
pub fn is_corner([one, other]: [f64; 2]) -> bool {
    one * other > 0.0 && one.abs().min(other.abs()) > LEAST_RAD
}

/// Two lines that meet at a place along the gauge.
struct Lines {
    at: f64,
    /// Position where they meet \[px\], slope before and its change \[px\].
    terms: Vector3<f64>,
    /// Mean square of the points' distances \[px²\].
    scatter: f64,
}

impl Lines {
    fn fit(points: impl Iterator<Item = Point> + Clone, at: f64) -> Option<Self> {
        let mut normal = Normal::<3>::default();
        for point in points.clone() {
            normal.add(Self::shares(point.t - at), point.u, point.weight);
        }
        let mut lines = Self { at, terms: normal.solve()?.unknowns, scatter: 0.0 };
        let (mut sum, mut n) = (0.0, 0.0);
        for point in points {
            let off = point.u - lines.terms.dot(&Vector3::from(Self::shares(point.t - lines.at)));
            sum += point.weight * off * off;
            n += point.weight;
        }
        lines.scatter = sum / f64::max(n, 1e-9);
        Some(lines)
    }

    fn shares(ahead: f64) -> [f64; 3] {
        [1.0, ahead, ahead.max(0.0)]
    }

    /// Change of the position before and after the corner, for a step of 1 in t
    /// \[px\].
    fn slopes(&self) -> [f64; 2] {
        [self.terms[1], self.terms[1] + self.terms[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::curve::Curve;

    const REACH: f64 = 50.0;

    fn turn_of(of: impl Fn(f64) -> f64) -> f64 {
        let places = (0..25u8).map(|k| (f64::from(k) + 0.5) / 12.5 - 1.0);
        let points: Vec<Point> = places.map(|t| Point { t, u: of(t), weight: 1.0 }).collect();
        let curve = Curve::fit(points.iter().copied(), REACH).unwrap();
        turn(&points.iter().copied(), curve.about_parabola, REACH)
    }

    #[test]
    fn lines_that_meet_are_a_corner_wherever_that_is() {
        for degrees in [10.0f64, 20.0, 40.0] {
            for at in [-0.65, -0.25, 0.05, 0.55] {
                let slope = degrees.to_radians().tan() * REACH;
                let turn = turn_of(|t| 100.0 + slope * f64::max(t - at, 0.0));
                assert!((turn / degrees.to_radians() - 1.0).abs() < 0.15, "{degrees} {at} {turn}");
                assert!(is_corner([turn, turn]) && !is_corner([turn, 0.0]));
                assert!(!is_corner([turn, -turn]));
            }
        }
    }

    #[test]
    fn arcs_and_waves_are_none() {
        let arc = |t: f64| 300.0 - (300.0f64.powi(2) - (REACH * t).powi(2)).sqrt();
        assert!(turn_of(arc).abs() < LEAST_RAD);
        for (size, waves) in [(0.8, 1.0), (0.8, 2.0), (2.0, 2.5), (3.0, 4.0)] {
            for phase in [0.0, 0.7, 1.4] {
                let wave = |t: f64| size * (std::f64::consts::PI * waves * t + phase).sin();
                assert!(turn_of(wave).abs() < LEAST_RAD, "{size} {waves} {phase}");
            }
        }
    }
}
