//! The path of a bead on the surface: straight, along an arc, or around a
//! corner.

use nalgebra::Vector2;

use crate::scenario::image;

/// Largest angle of an arc from the middle of the gauge \[rad\]: its edges are functions of the
/// position along the gauge's axis only below π/2.
const MAX_ARC_RAD: f64 = 1.2;

/// Converts distances along and across the bead to distances ahead and to the right of the middle
/// of the gauge \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BeadPath {
    /// A straight bead.
    Straight,
    /// An arc of a signed radius \[mm\], to the right if positive.
    Arc {
        /// Radius of the centre line \[mm\].
        radius_mm: f64,
    },
    /// A corner, symmetric about the line across the gauge's middle.
    Corner {
        /// Sine and cosine of half the angle.
        half: (f64, f64),
    },
}

impl BeadPath {
    /// The path of an image model.
    pub fn new(settings: &image::Bend) -> Self {
        if settings.radius_mm != 0.0 {
            Self::Arc { radius_mm: settings.radius_mm }
        } else if settings.corner_deg != 0.0 {
            Self::Corner { half: libm::sincos(0.5 * settings.corner_deg.to_radians()) }
        } else {
            Self::Straight
        }
    }

    /// Position ahead and to the right \[mm\] of a point along and across the bead. Points of one
    /// `across_mm` form a line parallel to the bead's axis, at that distance. `None` too far around
    /// an arc.
    pub fn position(self, along_mm: f64, across_mm: f64) -> Option<Vector2<f64>> {
        match self {
            Self::Straight => Some(Vector2::new(along_mm, across_mm)),
            Self::Arc { radius_mm } => {
                let (sin, cos) = libm::sincos(along_mm / radius_mm);
                let to_centre = radius_mm - across_mm;
                let near = (along_mm / radius_mm).abs() < MAX_ARC_RAD;
                near.then(|| Vector2::new(to_centre * sin, radius_mm - to_centre * cos))
            }
            // Edges parallel to the two halves meet on the symmetry line. Along it their distance
            // is 1/cos times the distance normal to a half.
            Self::Corner { half: (sin, cos) } => {
                Some(Vector2::new(along_mm * cos, along_mm.abs() * sin + across_mm / cos))
            }
        }
    }

    /// Distance along the bead of a point ahead and to the right \[mm\].
    pub fn along_mm(self, position: Vector2<f64>) -> f64 {
        match self {
            Self::Straight => position.x,
            Self::Arc { radius_mm } => {
                let sign = radius_mm.signum();
                radius_mm.abs() * libm::atan2(position.x, sign * (radius_mm - position.y))
            }
            Self::Corner { half: (_, cos) } => position.x / cos,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(radius_mm: f64) -> BeadPath {
        BeadPath::new(&image::Bend { radius_mm, corner_deg: 0.0 })
    }

    #[test]
    fn an_arc_keeps_its_distance_from_its_centre() {
        for radius_mm in [30.0, -30.0] {
            let bend = arc(radius_mm);
            let centre = Vector2::new(0.0, radius_mm);
            for (along, across) in [(0.0, 0.0), (5.0, 4.0), (-11.0, 4.0), (20.0, -6.0)] {
                let position = bend.position(along, across).unwrap();
                let distance = (position - centre).norm();
                // The right is towards the centre of a curve to the right.
                let expected = (radius_mm - across).abs();
                assert!((distance - expected).abs() < 1e-12);
                assert!((bend.along_mm(position) - along).abs() < 1e-12, "{along} {across}");
            }
            assert!(bend.position(10.0, 0.0).unwrap().y * radius_mm > 0.0);
        }
    }

    #[test]
    fn both_halves_of_a_corner_have_the_width_normal_to_themselves() {
        let bend = BeadPath::new(&image::Bend { radius_mm: 0.0, corner_deg: 40.0 });
        for sign in [1.0, -1.0] {
            let [a, b, c] = [(3.0, 2.0), (9.0, 2.0), (5.0, -2.0)]
                .map(|(along, across)| bend.position(sign * along, across).unwrap());
            let direction = (b - a).normalize();
            assert!((direction.y / direction.x.abs() - 20_f64.to_radians().tan()).abs() < 1e-12);
            let normal = Vector2::new(-direction.y, direction.x);
            assert!(((c - a).dot(&normal).abs() - 4.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_circle_is_not_gone_around() {
        assert!(arc(10.0).position(13.0, 0.0).is_none());
    }
}
