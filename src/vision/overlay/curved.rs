//! Surroundings of an edge whose level changes along no straight line: shading
//! that falls off away from the edge, as under a lamp close by or in the hollow
//! beside a bead.

use super::StepFitter;
use super::shape::{SideShading, SideShape};
use super::step::SideInput;
use crate::numeric::normal_equations::NormalEquations;
use crate::vision::curve::MIN_BEND_SIGMAS;

/// Largest extent of a parabola beside an edge \[px\].
const MAX_EXTENT_PX: f64 = 32.0;
/// Pixels that show a parabola, before others are compared with it.
const MIN_START_PX: f64 = 8.0;
/// Pixels that it must hold for.
const MIN_EXTENT_PX: f64 = 12.0;
/// Slope at the far end of a parabola, as a fraction of that at the edge, from which on it
/// turns back: light that falls off does not, a rib beside the edge does.
const MAX_REVERSED_SLOPE: f64 = 0.3;
/// Unit of distances, so that the equations are well scaled \[px\].
const UNIT_PX: f64 = 10.0;

impl StepFitter<'_> {
    /// Extent of a side that follows a parabola, and the parabola; `None` where no bend is
    /// significant.
    #[cold]
    #[inline(never)]
    pub fn parabolic_side(&self, side: &SideInput<'_>) -> Option<SideShape> {
        let SideInput { noise, room, .. } = *side;
        let height = side.step.after - side.step.before;
        let first = 3.0 * side.step.blur;
        let mut normal = NormalEquations::<3>::default();
        let (mut end, mut rows) = (first, 0.0);
        while end + 2.0 <= room.min(MAX_EXTENT_PX) {
            let (mut position, mut miss, mut weight) = (0.0, 0.0, 0.0);
            self.each_beside(side, end, |away, off, rows| {
                position += rows * away;
                miss += rows * off;
                weight += rows;
            });
            if weight <= 0.0 {
                break;
            }
            let (position, miss) = (position / weight, miss / weight);
            if end >= first + MIN_START_PX {
                let solved = normal.solve()?;
                let row = terms(position);
                let expected: f64 =
                    row.iter().zip(solved.unknowns.iter()).map(|(a, b)| a * b).sum();
                let row = nalgebra::SVector::from(row);
                let variance = (row.transpose() * solved.covariance() * row)[0];
                let variance_of_miss = noise * noise * (variance + 1.0 / weight);
                if (miss - expected).abs() > 4.0 * variance_of_miss.sqrt() + 0.006 * height {
                    break;
                }
            }
            self.each_beside(side, end, |away, off, rows| {
                normal.add(terms(away), off, rows);
            });
            rows += weight;
            end += 2.0;
        }
        if end < first + MIN_EXTENT_PX {
            return None;
        }
        let solved = normal.solve()?;
        let covariance = solved.covariance() * noise * noise;
        let (slope, bend) = (solved.unknowns[1], solved.unknowns[2]);
        let slope_at_end = slope + 2.0 * bend * end / UNIT_PX;
        let turns_back = -slope_at_end * slope.signum() > MAX_REVERSED_SLOPE * slope.abs();
        let sure =
            bend * bend > MIN_BEND_SIGMAS * MIN_BEND_SIGMAS * covariance[(2, 2)] && !turns_back;
        sure.then(|| SideShape {
            extent: end,
            shading: SideShading { slope: slope / UNIT_PX, bend: bend / (UNIT_PX * UNIT_PX) },
            level_variance: (covariance[(0, 0)] - noise * noise / rows).max(0.0),
        })
    }
}

fn terms(away: f64) -> [f64; 3] {
    let away = away / UNIT_PX;
    [1.0, away, away * away]
}
