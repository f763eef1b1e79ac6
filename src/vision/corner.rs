//! Whether an edge has a corner: two straight lines that meet.

use nalgebra::Vector3;

use super::curve::EdgePoint;
use crate::numeric::normal_equations::NormalEquations;

/// Positions along the gauge at which an edge may turn, evenly spaced: more cost time, fewer miss
/// the corner.
const CORNER_POSITIONS: u8 = 18;
/// Farthest of them from the middle of the gauge, in halves of it: beyond, one of the two lines has
/// too few points.
const MAX_CORNER_POSITION: f64 = 0.85;
/// Largest squared residual of two lines that meet, as a fraction of that of a parabola.
const MAX_RESIDUAL_RATIO: f64 = 0.5;
/// Smallest turn \[rad\]; what turns less is a bead's waviness.
const MIN_TURN_RAD: f64 = 0.14;

/// Angle by which an edge turns \[rad\], where two lines that meet fit its points much better than
/// a parabola; 0 where they do not. `about_parabola` is the parabola's mean squared residual
/// \[px²\], `reach_px` half the length of the gauge.
#[cold]
pub fn turn(
    points: &(impl Iterator<Item = EdgePoint> + Clone),
    about_parabola: f64,
    reach_px: f64,
) -> f64 {
    let apart = 2.0 * MAX_CORNER_POSITION / f64::from(CORNER_POSITIONS - 1);
    let corners = (0..CORNER_POSITIONS).map(|k| f64::from(k) * apart - MAX_CORNER_POSITION);
    let lines = corners.filter_map(|at| BrokenLine::fit(points.clone(), at));
    let best = lines.min_by(|one, other| one.mean_square.total_cmp(&other.mean_square));
    let best = best.filter(|lines| lines.mean_square < MAX_RESIDUAL_RATIO * about_parabola);
    best.map_or(0.0, |lines| {
        let [before, after] = lines.slopes().map(|slope| (slope / reach_px).atan());
        after - before
    })
}

/// Whether the turns of two edges \[rad\] are those of a corner: both turn, and the same way. An
/// edge that turns alone has a bump or a notch.
pub fn is_corner([one, other]: [f64; 2]) -> bool {
    one * other > 0.0 && one.abs().min(other.abs()) > MIN_TURN_RAD
}

/// Two lines that meet at a position along the gauge.
struct BrokenLine {
    at: f64,
    /// Position where they meet \[px\], slope before and its change \[px\].
    terms: Vector3<f64>,
    /// Mean square of the points' distances \[px²\].
    mean_square: f64,
}

impl BrokenLine {
    fn fit(points: impl Iterator<Item = EdgePoint> + Clone, at: f64) -> Option<Self> {
        let mut normal = NormalEquations::<3>::default();
        for point in points.clone() {
            normal.add(Self::terms_at(point.t - at), point.u, point.weight);
        }
        let mut lines = Self { at, terms: normal.solve()?.unknowns, mean_square: 0.0 };
        let (mut sum, mut n) = (0.0, 0.0);
        for point in points {
            let off = point.u - lines.terms.dot(&Vector3::from(Self::terms_at(point.t - lines.at)));
            sum += point.weight * off * off;
            n += point.weight;
        }
        lines.mean_square = sum / f64::max(n, 1e-9);
        Some(lines)
    }

    fn terms_at(ahead: f64) -> [f64; 3] {
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
    use crate::vision::curve::EdgeCurve;

    const REACH: f64 = 50.0;

    fn turn_of(of: impl Fn(f64) -> f64) -> f64 {
        let positions = (0..25u8).map(|k| (f64::from(k) + 0.5) / 12.5 - 1.0);
        let points: Vec<EdgePoint> =
            positions.map(|t| EdgePoint { t, u: of(t), weight: 1.0 }).collect();
        let curve = EdgeCurve::fit(points.iter().copied(), REACH).unwrap();
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
        assert!(turn_of(arc).abs() < MIN_TURN_RAD);
        for (size, waves) in [(0.8, 1.0), (0.8, 2.0), (2.0, 2.5), (3.0, 4.0)] {
            for phase in [0.0, 0.7, 1.4] {
                let wave = |t: f64| size * (std::f64::consts::PI * waves * t + phase).sin();
                assert!(turn_of(wave).abs() < MIN_TURN_RAD, "{size} {waves} {phase}");
            }
        }
    }
}
