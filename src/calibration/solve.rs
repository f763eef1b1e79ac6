//! The camera model from images of a board.

pub mod data;
mod error;
mod solution;

pub use error::{MIN_VIEWS, SolveError};
pub use solution::{BoardView, Solution};

use super::board::Board;
use super::board_observation::BoardObservation;
use super::bundle::{self, BundleFit, Guess};
use super::equations::{BoardPlacement, CameraModel, Correspondence, FreeParameters, SHARED};
use super::homography;
#[cfg(test)]
use super::lens::Lens;
use super::lens_selection::{self, LensTrial};
use super::view_information::{self, ViewInformation};
use crate::core::{ImagePoint, Pose};
use data::{CalibrationData, root_mean_square};
use error::MAX_RMS_PX;

/// Fits the camera to images of one size, with the lens model and the bend of the board of
/// least cross-validation error.
pub fn solve(board: &Board, sightings: &[BoardObservation]) -> Result<Solution, SolveError> {
    let views = CalibrationData::of(board, sightings)?;
    let (fit, free, trials) = lens_selection::best(&views)
        .ok_or(SolveError::NoCamera { focal_px: views.start.model.camera.focal_px })?;
    solution(&views, sightings, &fit, free, trials)
}

/// Fits the camera with a given lens, on a flat board.
#[cfg(test)]
pub fn solve_with(
    board: &Board,
    sightings: &[BoardObservation],
    lens: Lens,
) -> Result<Solution, SolveError> {
    let views = CalibrationData::of(board, sightings)?;
    let trial = lens_selection::up_to(&views, lens)
        .ok_or(SolveError::NoCamera { focal_px: views.start.model.camera.focal_px })?;
    let free = FreeParameters { lens: Some(lens), bend: false };
    solution(&views, sightings, &trial.0, free, vec![trial.1])
}

fn solution(
    views: &CalibrationData,
    sightings: &[BoardObservation],
    fit: &BundleFit,
    free: FreeParameters,
    trials: Vec<LensTrial>,
) -> Result<Solution, SolveError> {
    let focal_px = fit.model.camera.focal_px;
    if focal_px.iter().any(|&f| f <= 0.0) {
        return Err(SolveError::NoCamera { focal_px });
    }
    let rms_px = root_mean_square(fit.sum_of_squares_px2, views.corners());
    if rms_px > MAX_RMS_PX {
        return Err(SolveError::NoFit { rms_px });
    }
    let noise_px = views.noise_variance_px2(fit, free).sqrt();
    let design_effect = ViewInformation::all(views, fit, free)
        .and_then(|pulls| view_information::design_effect(&pulls, free, noise_px * noise_px))
        .unwrap_or(1.0);
    let of_numbers_px = noise_px * design_effect.sqrt();
    let spreads = views.unit_sigmas(fit, free).filter(|_| of_numbers_px.is_finite());
    let each = sightings.iter().zip(fit.placements.iter().zip(&views.boards));
    let each = each.map(|(sighting, (position, boards))| {
        view(&fit.model, sighting, position.pose, &boards[0])
    });
    let used = trials.iter().find(|trial| trial.free == free);
    let cross_validation_px = used.and_then(|trial| trial.cross_validation_px);
    Ok(Solution {
        model: fit.model,
        free,
        sigma: spreads.map(|spreads| spreads.map(|spread| spread * of_numbers_px)),
        image_size_px: views.size,
        rms_px,
        cross_validation_px,
        noise_px,
        design_effect,
        trials,
        views: each.collect(),
    })
}

/// Pose of a board before a known camera. `None` where the corners fit none.
pub fn pose(model: &CameraModel, corners: &[Correspondence]) -> Option<Pose> {
    let start = homography::board_pose(&model.camera, corners)?;
    let fit = bundle::fit(
        Guess { model: *model, placements: vec![BoardPlacement::of_one(start)] },
        FreeParameters::PLACEMENTS,
        &[vec![corners.to_vec()]],
    )?;
    fit.placements.first().map(|position| position.pose)
}

/// Reprojection errors of one image by the camera model that measures later; a corner that
/// cannot be projected counts as infinitely far.
fn view(
    model: &CameraModel,
    sighting: &BoardObservation,
    pose: Pose,
    corners: &[Correspondence],
) -> BoardView {
    let far = nalgebra::Vector2::repeat(f64::INFINITY);
    let error_px = |corner: &Correspondence| {
        let expected = model.camera.project(pose.apply(model.on_board(corner)));
        expected.map_or(far, |px: ImagePoint| corner.observed - px)
    };
    let errors_px: Vec<_> = corners.iter().map(error_px).collect();
    let squares = errors_px.iter().map(nalgebra::Vector2::norm_squared).sum();
    BoardView {
        name: sighting.name.clone(),
        pose,
        rms_px: root_mean_square(squares, errors_px.len()),
        max_px: errors_px.iter().map(nalgebra::Vector2::norm).fold(0.0, f64::max),
        corners: sighting.corners.clone(),
        errors_px,
    }
}

/// Names of the shared parameters, in order.
#[rustfmt::skip]
pub const SHARED_NAMES: [&str; SHARED] = [
    "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6",
    "bend along rows", "bend along columns",
];

#[cfg(test)]
mod tests;
