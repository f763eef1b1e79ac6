//! The calibration: from pixels to millimetres on a surface at a known height
//! above the bed. The one place in which pixels and millimetres meet.

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};

use super::Camera;
use super::uncertainty::{CalibrationUncertainty, PositionSlopes};
use crate::core::{ImagePoint, Mm, Pose, SurfacePoint};

/// Quality of a calibration, from its images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationQuality {
    /// Root mean square of the reprojection errors \[px\].
    pub reprojection_rms_px: f64,
    /// Relative standard deviation of a width due to the calibration; see
    /// [`super::relative_sigma::where_seen`]. Files may lack it.
    pub width_relative_sigma: Option<f64>,
    /// First column and row, last column and row between which boards were seen, and for which
    /// `width_relative_sigma` holds \[px\]. Files may lack it.
    pub seen_px: Option<[f64; 4]>,
    /// Lowest and highest corner of the boards above the bed \[mm\]. Files may lack it.
    pub heights_mm: Option<[f64; 2]>,
    /// Covariance of camera and bed plane, from which the standard deviation of a width follows
    /// wherever it is seen. Files may lack it; then `width_relative_sigma` applies everywhere.
    pub uncertainty: Option<CalibrationUncertainty>,
}

/// The calibration of a camera, from pixels to millimetres.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one, read once")]
pub enum Calibration {
    /// The single number of Shojaei Barjuei et al. 2022, section 4.3.1; it holds only at the height
    /// at which it was taken.
    Scale {
        /// Millimetres a pixel at the surface.
        mm_per_px: f64,
        /// Its standard deviation \[mm/px\], if known.
        sigma: Option<f64>,
    },
    /// Camera model and bed plane; holds at any height.
    Full {
        /// Size of the images that it was found with \[px\].
        image_size_px: [u32; 2],
        /// Intrinsics and distortion.
        camera: Camera,
        /// The bed's axes in the camera's: `p_camera = R · p_bed + t`, Z of
        /// the bed pointing at the camera.
        bed: Pose,
        /// The robot's z when the image that fixed the plane was taken.
        robot_z: Mm,
        /// Its quality, if known.
        quality: Option<CalibrationQuality>,
    },
}

impl Calibration {
    /// The map of one surface.
    ///
    /// `surface_height` is the height of the bead's top edges above the bed.
    /// `robot_z` is the robot's z of a camera on the flange, which rises with
    /// the nozzle; `None` for a camera that stands still or a robot that has
    /// stayed where it was calibrated.
    pub fn surface(&self, surface_height: Mm, robot_z: Option<Mm>) -> SurfaceMap {
        let kind = match self {
            Self::Scale { mm_per_px, .. } => Kind::Scale(*mm_per_px),
            Self::Full { camera, bed, robot_z: z_at_plane, .. } => {
                let rise = robot_z.map_or(Mm::ZERO, |z| z - *z_at_plane);
                let height_mm = (surface_height - rise).get();
                Kind::Plane { camera: *camera, bed: *bed, height_mm }
            }
        };
        SurfaceMap {
            kind,
            width_relative_sigma: self.width_relative_sigma(),
            uncertainty: self.uncertainty(),
            height_relative_sigma: None,
            image_size_px: self.image_size_px(),
        }
    }

    /// Covariance of camera and bed plane, if known.
    pub fn uncertainty(&self) -> Option<CalibrationUncertainty> {
        let Self::Full { quality, .. } = self else { return None };
        quality.as_ref()?.uncertainty
    }

    fn width_relative_sigma(&self) -> Option<f64> {
        match self {
            Self::Scale { mm_per_px, sigma } => sigma.map(|sigma| sigma / mm_per_px),
            Self::Full { quality, .. } => quality.as_ref()?.width_relative_sigma,
        }
    }

    /// Size of the images \[px\]; `None` if it does not matter.
    pub fn image_size_px(&self) -> Option<[u32; 2]> {
        let Self::Full { image_size_px, .. } = self else { return None };
        Some(*image_size_px)
    }
}

/// From pixels to millimetres on one surface, and back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceMap {
    kind: Kind,
    width_relative_sigma: Option<f64>,
    uncertainty: Option<CalibrationUncertainty>,
    /// Relative standard deviation of a width due to the height of the surface.
    height_relative_sigma: Option<f64>,
    image_size_px: Option<[u32; 2]>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Scale(f64),
    Plane { camera: Camera, bed: Pose, height_mm: f64 },
}

impl SurfaceMap {
    /// A surface on which every pixel has the same size, which counts as exact.
    pub fn from_scale(mm_per_px: f64) -> Self {
        Self {
            kind: Kind::Scale(mm_per_px),
            width_relative_sigma: None,
            uncertainty: None,
            height_relative_sigma: None,
            image_size_px: None,
        }
    }

    /// Size of the images \[px\]; `None` if it does not matter.
    pub fn image_size_px(&self) -> Option<[u32; 2]> {
        self.image_size_px
    }

    /// The same map with an uncertain surface height: a height error Δh at the distance Z from
    /// the camera changes every width W by W·Δh/Z. A map of one scale for all pixels knows no
    /// height and stays as it is.
    pub fn with_height_sigma(self, sigma: Mm) -> Self {
        let Kind::Plane { bed, height_mm, .. } = &self.kind else { return self };
        let above = bed.apply_inverse(Point3::origin()).z - height_mm;
        let of_height = sigma.get() / above;
        if of_height <= 0.0 || !of_height.is_finite() {
            return self;
        }
        Self {
            height_relative_sigma: Some(self.height_relative_sigma.unwrap_or(0.0).hypot(of_height)),
            ..self
        }
    }

    /// Relative standard deviation of a width due to the calibration, the same error in every
    /// width; `None` if unknown. It is the largest one where boards were seen;
    /// [`Self::width_relative_sigma_of`] is that of one width.
    pub fn width_relative_sigma(&self) -> Option<f64> {
        self.with_height(self.width_relative_sigma)
    }

    /// Relative standard deviation of the distance between two points that are seen at these
    /// pixels, anywhere in the image and in any direction. Without a covariance it is
    /// [`Self::width_relative_sigma`]. `None` also off the surface.
    pub fn width_relative_sigma_of(&self, ends: [ImagePoint; 2]) -> Option<f64> {
        let (Some(uncertainty), Kind::Plane { camera, bed, height_mm }) =
            (&self.uncertainty, &self.kind)
        else {
            return self.width_relative_sigma();
        };
        let at = |px: ImagePoint| {
            let mm = self.to_mm(px)?;
            PositionSlopes::at(camera, bed, Point3::new(mm.x, mm.y, *height_mm))
        };
        let [first, last] = ends.map(at);
        self.with_height(Some(uncertainty.relative_sigma([&first?, &last?])?))
    }

    /// Covariance of camera and bed plane behind the map, if known.
    pub fn uncertainty(&self) -> Option<&CalibrationUncertainty> {
        self.uncertainty.as_ref()
    }

    fn with_height(&self, fraction: Option<f64>) -> Option<f64> {
        match (fraction, self.height_relative_sigma) {
            (Some(fraction), Some(of_height)) => Some(fraction.hypot(of_height)),
            (fraction, of_height) => fraction.or(of_height),
        }
    }

    /// Where the ray of a pixel meets the surface, in the bed's axes \[mm\]. The point is
    /// undistorted, never the image. `None` where the ray does not meet the surface.
    pub fn to_mm(&self, px: ImagePoint) -> Option<SurfacePoint> {
        match &self.kind {
            Kind::Scale(mm_per_px) => Some(px * *mm_per_px),
            Kind::Plane { camera, bed, height_mm } => {
                let ray = camera.ray(px)?;
                let camera_position = bed.apply_inverse(Point3::origin());
                let direction = bed.turn_inverse(Vector3::new(ray.x, ray.y, 1.0));
                let along = (height_mm - camera_position.z) / direction.z;
                if !along.is_finite() || along <= 0.0 {
                    return None;
                }
                let hit = camera_position + direction * along;
                Some(Point2::new(hit.x, hit.y))
            }
        }
    }

    /// Where a point of the surface, in the bed's axes \[mm\], is seen \[px\]. `None` behind
    /// the camera.
    pub fn to_px(&self, mm: SurfacePoint) -> Option<ImagePoint> {
        match &self.kind {
            Kind::Scale(mm_per_px) => Some(mm / *mm_per_px),
            Kind::Plane { camera, bed, height_mm } => {
                camera.project(bed.apply(Point3::new(mm.x, mm.y, *height_mm)))
            }
        }
    }

    /// Derivative of [`Self::to_mm`] at a pixel \[mm/px\], by central
    /// differences over a pixel.
    pub fn mm_per_px(&self, px: ImagePoint) -> Option<Matrix2<f64>> {
        if let Kind::Scale(mm_per_px) = self.kind {
            return Some(Matrix2::from_diagonal_element(mm_per_px));
        }
        let half = 0.5;
        let dx =
            self.to_mm(px + Vector2::new(half, 0.0))? - self.to_mm(px - Vector2::new(half, 0.0))?;
        let dy =
            self.to_mm(px + Vector2::new(0.0, half))? - self.to_mm(px - Vector2::new(0.0, half))?;
        Some(Matrix2::from_columns(&[dx, dy]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks straight down from 400 mm; the file of `contract`'s example.
    fn straight_down() -> Calibration {
        Calibration::Full {
            image_size_px: [720, 540],
            camera: Camera {
                focal_px: [2500.0, 2500.0],
                centre_px: [359.5, 269.5],
                distortion: [0.0; 8],
            },
            bed: Pose::new(
                Vector3::new(std::f64::consts::PI, 0.0, 0.0),
                Vector3::new(0.0, 0.0, 400.0),
            ),
            robot_z: Mm::constant(100.0),
            quality: None,
        }
    }

    fn width_of_100_px(map: &SurfaceMap) -> f64 {
        let left = map.to_mm(Point2::new(300.0, 200.0)).unwrap();
        let right = map.to_mm(Point2::new(400.0, 200.0)).unwrap();
        (right - left).norm()
    }

    #[test]
    fn a_pixel_shrinks_with_the_height_of_the_surface() {
        let calibration = straight_down();
        let on_bed = calibration.surface(Mm::ZERO, None);
        let above = calibration.surface(Mm::constant(20.0), None);
        assert!((width_of_100_px(&on_bed) - 100.0 * 400.0 / 2500.0).abs() < 1e-9);
        assert!((width_of_100_px(&above) - 100.0 * 380.0 / 2500.0).abs() < 1e-9);
    }

    #[test]
    fn a_height_that_is_not_known_well_covers_the_error_that_it_makes() {
        let calibration = straight_down();
        let believed = calibration.surface(Mm::constant(20.0), None);
        let sigma = believed.with_height_sigma(Mm::constant(1.0)).width_relative_sigma().unwrap();
        let width = width_of_100_px(&believed);
        for wrong in [19.0, 21.0] {
            let truth = width_of_100_px(&calibration.surface(Mm::constant(wrong), None));
            let error = (width - truth).abs() / width;
            assert!((error / sigma - 1.0).abs() < 1e-6, "{error} {sigma}");
        }
        assert_eq!(believed.with_height_sigma(Mm::ZERO), believed);
        let single = SurfaceMap::from_scale(0.1);
        assert_eq!(single.with_height_sigma(Mm::constant(1.0)), single);
    }

    #[test]
    fn a_camera_on_the_flange_rises_with_the_layers() {
        let calibration = straight_down();
        let third_layer = calibration.surface(Mm::constant(60.0), Some(Mm::constant(140.0)));
        let first_layer = calibration.surface(Mm::constant(20.0), Some(Mm::constant(100.0)));
        assert!((width_of_100_px(&third_layer) - width_of_100_px(&first_layer)).abs() < 1e-9);
    }

    #[test]
    fn the_way_to_the_surface_and_back_is_the_identity() {
        let Calibration::Full { mut camera, .. } = straight_down() else { unreachable!() };
        camera.distortion[..4].copy_from_slice(&[-0.2, 0.05, 1e-3, -5e-4]);
        let tilted = Calibration::Full {
            image_size_px: [720, 540],
            camera,
            bed: Pose::new(Vector3::new(2.9, 0.1, -0.05), Vector3::new(12.0, -7.0, 395.0)),
            robot_z: Mm::ZERO,
            quality: None,
        };
        let map = tilted.surface(Mm::constant(20.0), None);
        for (x, y) in [(0.0, 0.0), (719.0, 0.0), (360.0, 270.0), (100.0, 539.0)] {
            let px = Point2::new(x, y);
            let back = map.to_px(map.to_mm(px).unwrap()).unwrap();
            assert!((back - px).norm() < 1e-8, "{px} came back as {back}");
        }
    }

    #[test]
    fn a_ray_that_never_comes_down_has_no_point() {
        let map = straight_down().surface(Mm::constant(500.0), None);
        assert_eq!(map.to_mm(Point2::new(360.0, 270.0)), None);
    }
}
