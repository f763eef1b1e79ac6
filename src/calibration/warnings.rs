//! Warnings about a calibration. A small residual is not quality: images that are too few, too
//! similar or too much in the middle fit well and contain little information.

use nalgebra::Vector3;

use super::coverage::{Coverage, PARTS};
use super::solve::{BoardView, Solution};
use crate::numeric::rank;

/// A warning, and what to do about it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Warning {
    /// Few images.
    #[error("only {found} images show the board; {MIN_VIEWS} or more average errors better")]
    FewViews {
        /// Images that show it.
        found: usize,
    },
    /// Parts of the image without corners.
    #[error(
        "the boards cover {covered} of {PARTS} parts of the image; distortion is a guess in \
         the others, so bring the board into the corners too"
    )]
    Coverage {
        /// Parts with a corner.
        covered: usize,
    },
    /// No board is tilted.
    #[error(
        "no board is tilted by more than {tilt_deg:.0} degrees; distance and focal length are \
         hard to tell apart, so tilt it by 20 to 45 degrees to several sides"
    )]
    NoTilt {
        /// The largest tilt against the view \[degrees\].
        tilt_deg: f64,
    },
    /// The model does not fit.
    #[error(
        "the reprojection error is {rms_px:.2} px, a sharp image of a flat board gives less \
         than {MAX_RMS_PX}: look for blur, a bent board, or a wrong corner count"
    )]
    HighError {
        /// Root mean square over all corners \[px\].
        rms_px: f64,
    },
    /// One image is much worse than the rest.
    #[error("{name} fits {times:.1} times worse than the others; look at it, or leave it out")]
    Outlier {
        /// The image's name.
        name: String,
        /// Its error over the median error.
        times: f64,
    },
    /// The distortion polynomial is not monotonic within the image.
    #[error(
        "the lens model is not monotonic before pixel ({x:.0}, {y:.0}), and nothing can be measured \
         there; bring the board into the corners of the image"
    )]
    NonMonotonic {
        /// Column \[px\].
        x: f64,
        /// Row \[px\].
        y: f64,
    },
    /// The focal length is uncertain.
    #[error("uncertainty of the focal length {percent:.1} % (1 sigma); more tilted images help")]
    UncertainFocal {
        /// Standard deviation over value.
        percent: f64,
    },
}

/// Number of images below which a warning is given. A choice: errors average as one over its
/// root.
const MIN_VIEWS: usize = 8;
/// Parts of the image with corners below which a warning is given, of [`PARTS`].
const MIN_CELLS: usize = 12;
/// Largest tilt below which a warning is given \[degrees\]: the focal length follows from
/// tilted boards only.
const MIN_TILT_DEG: f64 = 15.0;
/// Reprojection error above which a warning is given \[px\]. A choice: several times that of
/// sharp images.
const MAX_RMS_PX: f64 = 0.5;
/// Reprojection error of an image over the median above which a warning is given.
const OUTLIER_RATIO: f64 = 3.0;
/// Relative standard deviation of the focal length above which a warning is given \[%\].
const MAX_FOCAL_PERCENT: f64 = 1.0;

/// All warnings about a solution.
pub fn warnings(solution: &Solution) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let found = solution.views.len();
    if found < MIN_VIEWS {
        warnings.push(Warning::FewViews { found });
    }
    let covered = Coverage::of(solution).count();
    if covered < MIN_CELLS {
        warnings.push(Warning::Coverage { covered });
    }
    let tilt_deg = solution.views.iter().map(tilt_deg).fold(0.0, f64::max);
    if tilt_deg < MIN_TILT_DEG {
        warnings.push(Warning::NoTilt { tilt_deg });
    }
    if solution.rms_px > MAX_RMS_PX {
        warnings.push(Warning::HighError { rms_px: solution.rms_px });
    }
    let focal_sigma = solution.sigma.map_or(f64::INFINITY, |sigma| sigma[0]);
    let percent = 100.0 * focal_sigma / solution.camera().focal_px[0];
    if percent > MAX_FOCAL_PERCENT {
        warnings.push(Warning::UncertainFocal { percent });
    }
    if let Some(px) = solution.camera().non_monotonic_at(solution.image_size_px) {
        warnings.push(Warning::NonMonotonic { x: px.x, y: px.y });
    }
    warnings.extend(outliers(&solution.views));
    warnings
}

/// Whether the images determine the camera.
pub fn settles_camera(solution: &Solution) -> bool {
    let loose = |warning: &Warning| {
        matches!(warning, Warning::UncertainFocal { .. } | Warning::NoTilt { .. })
    };
    !warnings(solution).iter().any(loose)
}

fn outliers(views: &[BoardView]) -> impl Iterator<Item = Warning> {
    let typical = rank::median_of(views.iter().map(|view| view.rms_px)).unwrap_or(f64::INFINITY);
    let times = move |view: &BoardView| view.rms_px / typical;
    let worse = views.iter().filter(move |view| times(view) > OUTLIER_RATIO);
    worse.map(move |view| Warning::Outlier { name: view.name.clone(), times: times(view) })
}

/// Angle between the board's normal and the camera's view \[degrees\].
pub fn tilt_deg(view: &BoardView) -> f64 {
    let normal = view.pose.rotation() * Vector3::z();
    normal.z.abs().min(1.0).acos().to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Camera;
    use crate::calibration::board::observe_all;
    use crate::calibration::equations::{CameraModel, FreeParameters, SHARED};
    use crate::calibration::lens::Lens;
    use crate::core::{ImagePoint, Pose};
    use nalgebra::Vector2;

    fn view(name: &str, corner: ImagePoint, tilt_rad: f64, rms_px: f64) -> BoardView {
        let pose = Pose::new(Vector3::new(tilt_rad, 0.0, 0.0), Vector3::new(0.0, 0.0, 400.0));
        BoardView {
            name: name.into(),
            pose,
            rms_px,
            max_px: rms_px,
            corners: observe_all(&[corner]),
            errors_px: vec![Vector2::new(rms_px, 0.0)],
        }
    }

    fn solution(views: Vec<BoardView>) -> Solution {
        let camera = Camera::pinhole([1000.0; 2], [50.0; 2]);
        Solution {
            model: CameraModel { camera, bend_mm: [0.0; 2] },
            free: FreeParameters { lens: Some(Lens::Five), bend: false },
            sigma: Some([1.0; SHARED]),
            image_size_px: [100, 100],
            rms_px: 0.2,
            cross_validation_px: None,
            noise_px: 0.15,
            design_effect: 1.0,
            trials: vec![],
            views,
        }
    }

    /// Sixteen views that see a part of the image each.
    fn good() -> Vec<BoardView> {
        let at = |i: u32| ImagePoint::new(f64::from(i % 4) * 25.0 + 5.0, f64::from(i / 4) * 25.0);
        (0..16).map(|i| view(&i.to_string(), at(i), 0.03 * f64::from(i), 0.2)).collect()
    }

    #[test]
    fn many_tilted_views_all_over_the_image_raise_no_warning() {
        assert_eq!(warnings(&solution(good())), vec![]);
    }

    #[test]
    fn each_weakness_is_reported() {
        let mut odd = good();
        odd[4].rms_px = 0.9;
        let outlier = Warning::Outlier { name: "4".into(), times: 0.9 / 0.2 };
        assert_eq!(warnings(&solution(odd)), vec![outlier]);
        let same = |_| view("a", ImagePoint::new(50.0, 50.0), 0.1, 0.2);
        let reported = warnings(&solution((0..5).map(same).collect()));
        assert!(matches!(
            reported[..],
            [
                Warning::FewViews { found: 5 },
                Warning::Coverage { covered: 1 },
                Warning::NoTilt { .. }
            ]
        ));
        let mut folded = solution(good());
        folded.model.camera.distortion[0] = -200.0;
        assert_eq!(warnings(&folded), vec![Warning::NonMonotonic { x: 0.0, y: 0.0 }]);
        let loose = Solution { sigma: Some([20.0; SHARED]), rms_px: 0.8, ..solution(good()) };
        let reported = warnings(&loose);
        assert!(matches!(
            reported[..],
            [Warning::HighError { .. }, Warning::UncertainFocal { .. }]
        ));
    }
}
