//! Straight lines and arcs in the plane XY, which may climb.

use std::f64::consts::TAU;

use super::error::GcodeError;
use crate::plan::position::{Position, distance};

/// Tolerance of the radii at both ends of an arc, for rounded numbers: absolute \[mm\] and relative.
const ARC_TOLERANCE: (f64, f64) = (0.02, 1e-3);

/// A move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Move {
    /// A line.
    Line {
        /// From \[mm\].
        from: [f64; 3],
        /// To \[mm\].
        to: [f64; 3],
    },
    /// An arc about a centre.
    Arc {
        /// From \[mm\].
        from: [f64; 3],
        /// The centre in the plane \[mm\].
        centre: [f64; 2],
        /// Its angle \[rad\], positive counterclockwise.
        turn: f64,
        /// Its rise in Z \[mm\].
        climb: f64,
    },
}

/// Centre of an arc, as given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Centre {
    /// Relative to its start \[mm\].
    Offset([f64; 2]),
    /// By the radius \[mm\]; negative for the longer arc.
    Radius(f64),
}

impl Move {
    /// An arc between two positions \[mm\], counterclockwise (`left`) or clockwise.
    pub fn arc(
        line: usize,
        from: Position,
        to: Position,
        given: Centre,
        left: bool,
    ) -> Result<Self, GcodeError> {
        let centre = match given {
            Centre::Offset([i, j]) => [from[0] + i, from[1] + j],
            Centre::Radius(radius) => centre_by_radius(line, from, to, radius, left)?,
        };
        let arm = |p: [f64; 3]| (p[0] - centre[0], p[1] - centre[1]);
        let ((x0, y0), (x1, y1)) = (arm(from), arm(to));
        let (from_mm, to_mm) = (x0.hypot(y0), x1.hypot(y1));
        if from_mm <= 0.0 || (from_mm - to_mm).abs() > ARC_TOLERANCE.0 + ARC_TOLERANCE.1 * from_mm {
            return Err(GcodeError::Centre { line, from_mm, to_mm });
        }
        let angle = libm::atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1);
        // Angle in its sense; equal ends are a full circle.
        let closed = distance([x0, y0, 0.0], [x1, y1, 0.0]) < 1e-9;
        let turn = match (closed, left) {
            (true, true) => TAU,
            (true, false) => -TAU,
            (false, true) => angle.rem_euclid(TAU),
            (false, false) => -(-angle).rem_euclid(TAU),
        };
        Ok(Self::Arc { from, centre, turn, climb: to[2] - from[2] })
    }

    /// Its length \[mm\].
    pub fn length_mm(&self) -> f64 {
        match *self {
            Self::Line { from, to } => distance(from, to),
            Self::Arc { turn, climb, .. } => (self.radius_mm() * turn).hypot(climb),
        }
    }

    /// Its radius in the plane \[mm\]; infinite where it is straight.
    pub fn radius_mm(&self) -> f64 {
        match *self {
            Self::Line { .. } => f64::INFINITY,
            Self::Arc { from, centre, .. } => (from[0] - centre[0]).hypot(from[1] - centre[1]),
        }
    }

    /// Position at a fraction of it \[mm\].
    pub fn at(&self, fraction: f64) -> [f64; 3] {
        match *self {
            Self::Line { from, to } => {
                let between = |a: f64, b: f64| a + fraction * (b - a);
                [between(from[0], to[0]), between(from[1], to[1]), between(from[2], to[2])]
            }
            Self::Arc { from, centre, turn, climb } => {
                let (sin, cos) = libm::sincos(fraction * turn);
                let (x, y) = (from[0] - centre[0], from[1] - centre[1]);
                let z = from[2] + fraction * climb;
                [centre[0] + cos * x - sin * y, centre[1] + sin * x + cos * y, z]
            }
        }
    }

    /// Unit tangent at a fraction of it.
    pub fn direction(&self, fraction: f64) -> [f64; 3] {
        let length = self.length_mm();
        match *self {
            Self::Line { from, to } => {
                [0, 1, 2].map(|axis: usize| (to[axis] - from[axis]) / length)
            }
            Self::Arc { centre, turn, climb, .. } => {
                let here = self.at(fraction);
                let (x, y) = (here[0] - centre[0], here[1] - centre[1]);
                [-y * turn / length, x * turn / length, climb / length]
            }
        }
    }
}

fn centre_by_radius(
    line: usize,
    from: Position,
    to: Position,
    radius: f64,
    left: bool,
) -> Result<[f64; 2], GcodeError> {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let way_mm = dx.hypot(dy);
    let radius_mm = radius.abs();
    // The ends are too far apart by more than rounding.
    if way_mm <= 0.0 || 0.5 * way_mm > radius_mm + ARC_TOLERANCE.0 + ARC_TOLERANCE.1 * radius_mm {
        return Err(GcodeError::Radius { line, radius_mm, way_mm });
    }
    let aside = (radius_mm * radius_mm - 0.25 * way_mm * way_mm).max(0.0).sqrt() / way_mm;
    let aside = if left == (radius > 0.0) { aside } else { -aside };
    Ok([from[0] + 0.5 * dx - aside * dy, from[1] + 0.5 * dy + aside * dx])
}
