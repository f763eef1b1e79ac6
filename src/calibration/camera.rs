//! A pinhole camera with Brown–Conrady distortion, coefficients in OpenCV's
//! order (k1 k2 p1 p2 k3 k4 k5 k6).

use nalgebra::{Matrix2, Matrix2x3, Point2, Point3, SMatrix, Vector2};

use crate::core::ImagePoint;

/// Limit of Newton's steps, which converge quadratically away from a fold of the distortion.
const UNDISTORT_STEPS: usize = 20;
/// Residual of the undistorted ray on the plane z = 1. Derived: 2e-10 px for a focal length of
/// 2000 px.
const UNDISTORT_TOLERANCE: f64 = 1e-13;
/// Grid of pixels at which the distortion is checked for monotonicity, and steps along the ray
/// to each. A choice: the corners of the image are among them.
const MONOTONIC_GRID: (u32, u32) = (32, 24);
const MONOTONIC_STEPS: u32 = 16;

/// Number of distortion coefficients. By definition of OpenCV's rational model: five of Brown
/// 1971 and three of the denominator.
pub const COEFFICIENTS: usize = 8;
/// Numbers of a camera: fx, fy, cx, cy, and the coefficients.
pub const NUMBERS: usize = 4 + COEFFICIENTS;

/// Intrinsics and distortion of a camera. Camera axes: x right, y down, z
/// along the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Focal lengths along x and y \[px\].
    pub focal_px: [f64; 2],
    /// Principal point \[px\].
    pub centre_px: [f64; 2],
    /// k1 k2 p1 p2 k3, and of the rational model k4 k5 k6; all 0 without a lens.
    pub distortion: [f64; COEFFICIENTS],
}

/// Projection of a point and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// Projected position \[px\].
    pub at: ImagePoint,
    /// Derivative with the point in camera axes \[px/mm\].
    pub of_point: Matrix2x3<f64>,
    /// Derivative with the camera's [`NUMBERS`] parameters, in their order and units.
    pub of_camera: SMatrix<f64, 2, NUMBERS>,
}

/// The radial part of the distortion at one squared distance from the axis.
#[derive(Debug, Clone, Copy)]
struct Radial {
    /// Factor on the point.
    factor: f64,
    /// Its derivative with the squared distance.
    slope: f64,
    /// Denominator of the rational model.
    divisor: f64,
}

impl Camera {
    /// A camera without distortion.
    pub fn pinhole(focal_px: [f64; 2], centre_px: [f64; 2]) -> Self {
        Self { focal_px, centre_px, distortion: [0.0; COEFFICIENTS] }
    }

    /// With five coefficients of distortion, k1 k2 p1 p2 k3.
    pub fn with_five(self, five: [f64; 5]) -> Self {
        let mut distortion = [0.0; COEFFICIENTS];
        distortion[..5].copy_from_slice(&five);
        Self { distortion, ..self }
    }

    /// All its numbers, in the order fx, fy, cx, cy, k1 ….
    pub fn numbers(&self) -> [f64; NUMBERS] {
        let mut numbers = [0.0; NUMBERS];
        numbers[..2].copy_from_slice(&self.focal_px);
        numbers[2..4].copy_from_slice(&self.centre_px);
        numbers[4..].copy_from_slice(&self.distortion);
        numbers
    }

    /// The camera that has these numbers.
    pub fn from_numbers(numbers: [f64; NUMBERS]) -> Self {
        let [fx, fy, cx, cy, distortion @ ..] = numbers;
        Self { focal_px: [fx, fy], centre_px: [cx, cy], distortion }
    }

    /// Camera matrix without skew, row by row.
    pub fn matrix(&self) -> [f64; 9] {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.centre_px);
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    }

    /// The coefficients that are written: five, or the eight of the rational model.
    pub fn coefficients(&self) -> &[f64] {
        let five = self.distortion[5..].iter().all(|&k| k == 0.0);
        &self.distortion[..if five { 5 } else { COEFFICIENTS }]
    }

    /// Whether the distortion can be inverted in the middle of an image of this size \[px\], as
    /// for any sound camera.
    pub fn reaches_middle(&self, size: [u32; 2]) -> bool {
        let middle = size.map(|side| (f64::from(side) - 1.0) / 2.0);
        self.ray(Point2::from(middle)).is_some()
    }

    /// Projects a point in camera axes \[mm\] to the image \[px\]; `None`
    /// behind the camera.
    pub fn project(&self, p: Point3<f64>) -> Option<ImagePoint> {
        if p.z <= 0.0 {
            return None;
        }
        let (d, _) = self.distort(Point2::new(p.x / p.z, p.y / p.z));
        Some(self.on_sensor(d))
    }

    /// [`Self::project`] with the derivatives. `None` behind the camera.
    pub fn project_with_slopes(&self, p: Point3<f64>) -> Option<Projection> {
        if p.z <= 0.0 {
            return None;
        }
        let (x, y) = (p.x / p.z, p.y / p.z);
        let (seen, slope) = self.distort(Point2::new(x, y));
        let [fx, fy] = self.focal_px;
        let scale = Matrix2::new(fx, 0.0, 0.0, fy);
        let on_plane = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / p.z;
        let mut of_camera = SMatrix::<f64, 2, NUMBERS>::zeros();
        of_camera[(0, 0)] = seen.x;
        of_camera[(1, 1)] = seen.y;
        of_camera[(0, 2)] = 1.0;
        of_camera[(1, 3)] = 1.0;
        let r2 = x * x + y * y;
        let radial = self.radial(r2);
        let by_power = [r2, r2 * r2, r2 * r2 * r2].map(|power| power / radial.divisor);
        // k1 k2 k3 stand in the numerator, k4 k5 k6 in the denominator.
        for (power, number) in by_power.into_iter().zip([4, 5, 8]) {
            of_camera[(0, number)] = fx * x * power;
            of_camera[(1, number)] = fy * y * power;
        }
        for (power, number) in by_power.into_iter().zip([9, 10, 11]) {
            of_camera[(0, number)] = -fx * x * power * radial.factor;
            of_camera[(1, number)] = -fy * y * power * radial.factor;
        }
        of_camera[(0, 6)] = fx * 2.0 * x * y;
        of_camera[(1, 6)] = fy * (r2 + 2.0 * y * y);
        of_camera[(0, 7)] = fx * (r2 + 2.0 * x * x);
        of_camera[(1, 7)] = fy * 2.0 * x * y;
        Some(Projection { at: self.on_sensor(seen), of_point: scale * slope * on_plane, of_camera })
    }

    fn on_sensor(&self, p: Point2<f64>) -> ImagePoint {
        Point2::new(
            self.focal_px[0] * p.x + self.centre_px[0],
            self.focal_px[1] * p.y + self.centre_px[1],
        )
    }

    /// The ray of a pixel as its intersection with the plane z = 1, free of distortion, by
    /// Newton's method. `None` where the distortion cannot be inverted, which is far outside
    /// the image for a sound calibration.
    pub fn ray(&self, px: ImagePoint) -> Option<Point2<f64>> {
        let seen = Point2::new(
            (px.x - self.centre_px[0]) / self.focal_px[0],
            (px.y - self.centre_px[1]) / self.focal_px[1],
        );
        let mut ray = seen;
        for _ in 0..UNDISTORT_STEPS {
            let (distorted, jacobian) = self.distort(ray);
            let residual = distorted - seen;
            if residual.norm() < UNDISTORT_TOLERANCE {
                return Some(ray);
            }
            // The distortion folds where the determinant of its Jacobian is not positive.
            if jacobian.determinant() <= 0.0 {
                return None;
            }
            ray -= jacobian.try_inverse()? * residual;
        }
        let (distorted, _) = self.distort(ray);
        ((distorted - seen).norm() < 1e-9).then_some(ray)
    }

    /// The first pixel of a grid over the image, its boundary included, whose ray passes a
    /// region in which the distortion is not monotonic: nothing can be measured there. `None`
    /// for a sound lens.
    pub fn non_monotonic_at(&self, image_size_px: [u32; 2]) -> Option<ImagePoint> {
        let [right, bottom] = image_size_px.map(|side| f64::from(side) - 1.0);
        let (columns, rows) = MONOTONIC_GRID;
        let along = |i: u32, count: u32, end: f64| f64::from(i) / f64::from(count) * end;
        (0..(columns + 1) * (rows + 1))
            .map(|i| (i % (columns + 1), i / (columns + 1)))
            .map(|(x, y)| Point2::new(along(x, columns, right), along(y, rows, bottom)))
            .find(|&px| !self.ray(px).is_some_and(|ray| self.is_monotonic_to(ray)))
    }

    /// Whether the distortion is monotonic from the axis to a ray.
    fn is_monotonic_to(&self, ray: Point2<f64>) -> bool {
        (1..=MONOTONIC_STEPS).all(|step| {
            let part = f64::from(step) / f64::from(MONOTONIC_STEPS);
            self.distort(ray * part).1.determinant() > 0.0
        })
    }

    fn radial(&self, r2: f64) -> Radial {
        let [k1, k2, _, _, k3, k4, k5, k6] = self.distortion;
        let divisor = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        let factor = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / divisor;
        let above = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let below = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
        Radial { factor, slope: (above - factor * below) / divisor, divisor }
    }

    /// Brown–Conrady distortion of a normalised point, and its derivative.
    fn distort(&self, p: Point2<f64>) -> (Point2<f64>, Matrix2<f64>) {
        let [_, _, p1, p2, ..] = self.distortion;
        let (x, y) = (p.x, p.y);
        let r2 = x * x + y * y;
        let Radial { factor, slope, .. } = self.radial(r2);
        let tangential = Vector2::new(
            2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let slope = Matrix2::new(
            factor + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            factor + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        );
        (Point2::new(x * factor, y * factor) + tangential, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LENS: Camera = Camera {
        focal_px: [532.8, 532.9],
        centre_px: [342.5, 233.9],
        distortion: [-0.28, 0.03, 0.0012, -0.0001, 0.1, 0.02, -0.05, 0.03],
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

        #[test]
        fn slopes_are_the_derivatives_of_what_is_seen(x in -150.0..150.0, y in -120.0..120.0) {
            let p = Point3::new(x, y, 300.0);
            let seen = LENS.project_with_slopes(p).unwrap();
            prop_assert!((seen.at - LENS.project(p).unwrap()).norm() < 1e-12);
            for axis in 0..3 {
                let mut step = nalgebra::Vector3::zeros();
                step[axis] = 1e-3;
                let by = (LENS.project(p + step).unwrap() - LENS.project(p - step).unwrap()) / 2e-3;
                prop_assert!((by - seen.of_point.column(axis)).norm() < 1e-6);
            }
            for number in 0..NUMBERS {
                let with = |by: f64| {
                    let mut numbers = LENS.numbers();
                    numbers[number] += by;
                    Camera::from_numbers(numbers).project(p).unwrap()
                };
                let by = (with(1e-5) - with(-1e-5)) / 2e-5;
                prop_assert!((by - seen.of_camera.column(number)).norm() < 1e-5, "{number}");
            }
        }
    }

    #[test]
    fn a_lens_that_is_not_monotonic_within_the_image_is_detected_everywhere() {
        assert_eq!(LENS.non_monotonic_at([640, 480]), None);
        assert_eq!(Camera::pinhole([500.0; 2], [320.0, 240.0]).non_monotonic_at([640, 480]), None);
        // r(1 + k1 r²) is not monotonic at r = 1/√(-3 k1), where it reaches two thirds of that:
        // at 0.6 that is 0.4, 200 px from the centre of this camera.
        let k1 = -1.0 / (3.0 * 0.36);
        let fish = Camera::pinhole([500.0; 2], [320.0, 240.0]).with_five([k1, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(fish.non_monotonic_at([640, 480]), Some(Point2::new(0.0, 0.0)));
        // An image from the middle of that one is sound.
        let centred = Camera { centre_px: [120.0, 120.0], ..fish };
        assert_eq!(centred.non_monotonic_at([241, 241]), None);
        let wider = Camera { centre_px: [150.0, 150.0], ..fish };
        assert!(wider.non_monotonic_at([301, 301]).is_some());
        // Turns back further out: there are rays at the border, but not without a fold
        // on the way.
        let ring = fish.with_five([-1.5, 0.0, 0.0, 0.0, 1.5]);
        assert!(ring.non_monotonic_at([640, 480]).is_some());
    }

    #[test]
    fn nothing_behind_the_camera_is_seen() {
        assert_eq!(LENS.project(Point3::new(0.0, 0.0, -1.0)), None);
        assert_eq!(LENS.project_with_slopes(Point3::new(0.0, 0.0, -1.0)), None);
    }
}
