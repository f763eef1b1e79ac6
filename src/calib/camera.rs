//! A pinhole camera with Brown–Conrady distortion, coefficients in OpenCV's
//! order (k1 k2 p1 p2 k3).

use nalgebra::{Matrix2, Point2, Point3, Vector2};

use crate::geometry::ImagePoint;

const UNDISTORT_STEPS: usize = 20;
const UNDISTORT_TOLERANCE: f64 = 1e-13;

/// Intrinsics and distortion of a camera. Camera axes: x right, y down, z
/// along the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Focal lengths along x and y \[px\].
    pub focal_px: [f64; 2],
    /// Principal point \[px\].
    pub centre_px: [f64; 2],
    /// k1 k2 p1 p2 k3.
    pub distortion: [f64; 5],
}

impl Camera {
    /// Projects a point in camera axes \[mm\] to the image \[px\]; `None`
    /// behind the camera.
    pub fn project(&self, p: Point3<f64>) -> Option<ImagePoint> {
        if p.z <= 0.0 {
            return None;
        }
        let (d, _) = self.distort(Point2::new(p.x / p.z, p.y / p.z));
        Some(Point2::new(
            self.focal_px[0] * d.x + self.centre_px[0],
            self.focal_px[1] * d.y + self.centre_px[1],
        ))
    }

    /// The ray of a pixel as its crossing with the plane z = 1, free of
    /// distortion. Newton's method on the distortion polynomial; `None` where
    /// the polynomial cannot be inverted, which is far outside the picture for
    /// a sound calibration.
    pub fn ray(&self, px: ImagePoint) -> Option<Point2<f64>> {
        let seen = Point2::new(
            (px.x - self.centre_px[0]) / self.focal_px[0],
            (px.y - self.centre_px[1]) / self.focal_px[1],
        );
        let mut ray = seen;
        for _ in 0..UNDISTORT_STEPS {
            let (distorted, slope) = self.distort(ray);
            let miss = distorted - seen;
            if miss.norm() < UNDISTORT_TOLERANCE {
                return Some(ray);
            }
            // A fold of the polynomial shows as a slope that turns over.
            if slope.determinant() <= 0.0 {
                return None;
            }
            ray -= slope.try_inverse()? * miss;
        }
        let (distorted, _) = self.distort(ray);
        ((distorted - seen).norm() < 1e-9).then_some(ray)
    }

    /// Brown–Conrady distortion of a normalised point, and its derivative.
    fn distort(&self, p: Point2<f64>) -> (Point2<f64>, Matrix2<f64>) {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (x, y) = (p.x, p.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let radial_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let tangential = Vector2::new(
            2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let cross = 2.0 * x * y * radial_slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let slope = Matrix2::new(
            radial + 2.0 * x * x * radial_slope + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            radial + 2.0 * y * y * radial_slope + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (Point2::new(x * radial, y * radial) + tangential, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LENS: Camera = Camera {
        focal_px: [532.8, 532.9],
        centre_px: [342.5, 233.9],
        distortion: [-0.28, 0.03, 0.0012, -0.0001, 0.1],
    };

    proptest! {
        #[test]
        fn a_ray_projects_back_to_its_pixel(x in 0.0..640.0, y in 0.0..480.0, z in 1.0..2000.0) {
            let px = Point2::new(x, y);
            let ray = LENS.ray(px).unwrap();
            let back = LENS.project(Point3::new(ray.x * z, ray.y * z, z)).unwrap();
            prop_assert!((back - px).norm() < 1e-8);
        }

        #[test]
        fn the_derivative_of_the_distortion_is_its_slope(x in -0.5..0.5, y in -0.4..0.4) {
            let h = 1e-6;
            let (_, slope) = LENS.distort(Point2::new(x, y));
            let dx = (LENS.distort(Point2::new(x + h, y)).0 - LENS.distort(Point2::new(x - h, y)).0) / (2.0 * h);
            let dy = (LENS.distort(Point2::new(x, y + h)).0 - LENS.distort(Point2::new(x, y - h)).0) / (2.0 * h);
            prop_assert!((slope - Matrix2::from_columns(&[dx, dy])).norm() < 1e-7);
        }
    }

    #[test]
    fn nothing_behind_the_camera_is_seen() {
        assert_eq!(LENS.project(Point3::new(0.0, 0.0, -1.0)), None);
    }
}
