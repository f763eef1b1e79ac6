//! A calibrated camera, and the residuals of each image.

use crate::calibration::Camera;
use crate::calibration::board::{Board, CornerObservation};
use crate::calibration::equations::{CameraModel, Correspondence, FreeParameters, SHARED};
use crate::calibration::lens_selection::LensTrial;
use crate::core::{ImagePoint, Pose};

/// One image in the solution.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardView {
    /// The image's name.
    pub name: String,
    /// The board's axes in the camera's.
    pub pose: Pose,
    /// Root mean square of the corners' reprojection errors \[px\].
    pub rms_px: f64,
    /// The largest of them \[px\].
    pub max_px: f64,
    /// The corners that were found.
    pub corners: Vec<CornerObservation>,
    /// Their reprojection errors \[px\].
    pub errors_px: Vec<nalgebra::Vector2<f64>>,
}

/// A calibrated camera, and the residuals of each image.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Intrinsics, distortion, and the bend of the board.
    pub model: CameraModel,
    /// What was fitted.
    pub free: FreeParameters,
    /// Standard deviations of the camera parameters, then of the bend \[mm\]; `None` where the
    /// images do not determine them.
    pub sigma: Option<[f64; SHARED]>,
    /// Size of the images \[px\].
    pub image_size_px: [u32; 2],
    /// Root mean square of all reprojection errors \[px\].
    pub rms_px: f64,
    /// Root mean square error of each image with the camera from the others \[px\]; `None`
    /// where the others do not determine it.
    pub cross_validation_px: Option<f64>,
    /// Standard deviation of a corner's position in one direction \[px\], from the residuals.
    pub noise_px: f64,
    /// Ratio of the parameters' variances to those for independent corners.
    pub design_effect: f64,
    /// All models that were tried.
    pub trials: Vec<LensTrial>,
    /// The images, in the order in which they were given.
    pub views: Vec<BoardView>,
}

impl Solution {
    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.model.camera
    }

    /// First and last column and row with corners \[px\]; `None` without a corner.
    pub fn seen_px(&self) -> Option<[ImagePoint; 2]> {
        let corners = || self.views.iter().flat_map(|view| view.corners.iter().map(|c| c.px));
        let (first, last) = (|a: ImagePoint, b| a.inf(&b), |a: ImagePoint, b| a.sup(&b));
        Some([corners().reduce(first)?, corners().reduce(last)?])
    }

    /// Lowest and highest corner of all boards above a bed \[mm\], to a tenth; `None`
    /// without a board.
    pub fn heights_mm(&self, board: &Board, bed: &Pose) -> Option<[f64; 2]> {
        let corners = board.corners_mm();
        let height = |pose: &Pose, i: usize| {
            let at = corners.get(i)?;
            Some(bed.apply_inverse(pose.apply(*at)).z)
        };
        let heights = || {
            self.views.iter().flat_map(|view| {
                view.corners.iter().filter_map(move |corner| height(&view.pose, corner.index))
            })
        };
        let round = |mm: f64| (mm * 10.0).round() / 10.0;
        Some([round(heights().reduce(f64::min)?), round(heights().reduce(f64::max)?)])
    }

    /// The corners of an image with their positions on the board.
    pub fn corners(&self, board: &Board, view: usize) -> Vec<Correspondence> {
        self.views.get(view).map_or_else(Vec::new, |view| board.correspondences(&view.corners))
    }
}
