//! Data of a camera fit: the corners of each image, and initial values.

use super::error::{MIN_VIEWS, SolveError};
use crate::calibration::board::Board;
use crate::calibration::board_observation::BoardObservation;
use crate::calibration::bundle::{BundleFit, Guess};
use crate::calibration::equations::Equations;
use crate::calibration::equations::{
    BoardPlacement, CameraModel, Correspondence, FreeParameters, SHARED, restrict_to_free,
};
use crate::calibration::factor::{Elimination, Factor};
use crate::calibration::homography;
use crate::numeric::number::to_f64;

/// Corners and initial values of a camera fit.
#[derive(Debug)]
pub struct CalibrationData {
    /// The corners of the one board of each image.
    pub boards: Vec<Vec<Vec<Correspondence>>>,
    /// Approximate camera and poses.
    pub start: Guess,
    /// Size of the images \[px\].
    pub size: [u32; 2],
}

impl CalibrationData {
    /// From images of one size.
    pub fn of(board: &Board, sightings: &[BoardObservation]) -> Result<Self, SolveError> {
        let Some(first) = sightings.first().filter(|_| sightings.len() >= MIN_VIEWS) else {
            return Err(SolveError::TooFew { found: sightings.len() });
        };
        let size = first.image_size_px;
        let boards: Vec<_> =
            sightings.iter().map(|s| vec![board.correspondences(&s.corners)]).collect();
        let map = |board: &Vec<Vec<Correspondence>>| {
            homography::homography(&homography::pairs(&board[0]))
        };
        let maps: Vec<_> = boards.iter().filter_map(map).collect();
        let camera = homography::pinhole(&maps, size);
        let model = CameraModel { camera, bend_mm: [0.0; 2] };
        let placement = |(sighting, corners): (&BoardObservation, &Vec<Vec<Correspondence>>)| {
            let pose = homography::board_pose(&camera, &corners[0]);
            let none = || SolveError::NoPose { name: sighting.name.clone() };
            pose.map(BoardPlacement::of_one).ok_or_else(none)
        };
        let placements = sightings.iter().zip(&boards).map(placement).collect::<Result<_, _>>()?;
        Ok(Self { boards, start: Guess { model, placements }, size })
    }

    /// Number of corners in all images.
    pub fn corners(&self) -> usize {
        self.boards.iter().flatten().map(Vec::len).sum()
    }

    /// Variance of a corner's position in one direction \[px²\], from the residuals; not a
    /// number with too few corners.
    pub fn noise_variance_px2(&self, fit: &BundleFit, free: FreeParameters) -> f64 {
        let numbers =
            free.count() + fit.placements.iter().map(BoardPlacement::numbers).sum::<usize>();
        let left = to_f64(2 * self.corners()) - to_f64(numbers);
        if left > 0.0 { fit.sum_of_squares_px2 / left } else { f64::NAN }
    }

    /// Standard deviations of the shared parameters for a noise of 1 px.
    pub fn unit_sigmas(&self, fit: &BundleFit, free: FreeParameters) -> Option<[f64; SHARED]> {
        let mut left = nalgebra::SMatrix::<f64, SHARED, SHARED>::zeros();
        for (position, boards) in fit.placements.iter().zip(&self.boards) {
            left += Elimination::of(&Equations::of(&fit.model, free, position, boards)?)?.reduced;
        }
        let variances = Factor::of_shared(&restrict_to_free(left, free))?.variances();
        Some(std::array::from_fn(|number| variances[number].sqrt()))
    }

    /// Root mean square distance of all corners for a sum of squares \[px\].
    pub fn rms_px(&self, squares_px2: f64) -> f64 {
        root_mean_square(squares_px2, self.corners())
    }
}

/// Root mean square of `count` numbers with a sum of squares.
pub fn root_mean_square(squares: f64, count: usize) -> f64 {
    (squares / to_f64(count.max(1))).sqrt()
}
