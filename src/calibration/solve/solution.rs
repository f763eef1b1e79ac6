//! A camera that was found, and how well each picture agrees with it.

use crate::calibration::Camera;
use crate::calibration::board::{Board, CornerObservation};
use crate::calibration::equations::{CameraModel, Correspondence, FreeParameters, SHARED};
use crate::calibration::lens_selection::LensTrial;
use crate::core::geometry::{ImagePoint, Pose};

/// One picture in the solution.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardView {
    /// The picture's name.
    pub name: String,
    /// The board's axes in the camera's.
    pub pose: Pose,
    /// Root mean square of the corners' reprojection errors \[px\].
    pub rms_px: f64,
    /// The largest of them \[px\].
    pub max_px: f64,
    /// The corners that were found.
    pub corners: Vec<CornerObservation>,
    /// What each of them is off the place at which the model expects it \[px\].
    pub errors_px: Vec<nalgebra::Vector2<f64>>,
}

/// The camera, and how well each picture agrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Intrinsics, distortion, and the bend of the board.
    pub model: CameraModel,
    /// What was fitted.
    pub free: FreeParameters,
    /// Standard deviations of the camera's numbers, then of the bend \[mm\]; `None`
    /// where the pictures do not tell the numbers apart.
    pub sigma: Option<[f64; SHARED]>,
    /// Size of the pictures \[px\].
    pub image_size_px: [u32; 2],
    /// Root mean square of all reprojection errors \[px\].
    pub rms_px: f64,
    /// The same of pictures that took no part in fitting the camera, each left out
    /// once \[px\]; `None` where the others do not settle it.
    pub cross_validation_px: Option<f64>,
    /// Standard deviation of a corner's place in one direction \[px\], from what the
    /// fit leaves.
    pub noise_px: f64,
    /// How many times larger the numbers' variances are than if every corner were off by
    /// itself.
    pub design_effect: f64,
    /// All that was tried.
    pub trials: Vec<LensTrial>,
    /// The pictures, in the order in which they were given.
    pub views: Vec<BoardView>,
}

impl Solution {
    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.model.camera
    }

    /// First and last column and row between which all corners were seen \[px\]; `None`
    /// without a corner.
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

    /// The corners of a picture on the board.
    pub fn corners(&self, board: &Board, view: usize) -> Vec<Correspondence> {
        self.views.get(view).map_or_else(Vec::new, |view| board.correspondences(&view.corners))
    }
}
