//! The images for the bed plane, and the plane.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::arguments::CalibrateArgs;
use super::images::CalibrationImages;
use crate::calibration::board::{Board, CornerObservation};
use crate::calibration::board_observation::Observations;
use crate::calibration::charuco::MarkerError;
use crate::calibration::rejection::BoardRejection;
use crate::calibration::solve::Solution;
use crate::cli::arguments::WrongArguments;
use crate::cli::bed_plane::{BedPlane, BoardsOnBed, find_corners};

/// Accepted reprojection error (RMS) of corners on the bed, as a multiple of that of the other
/// images. Above it the images are of another camera, or the boards did not lie on a plane.
const MAX_RMS_RATIO: f64 = 4.0;
/// Reprojection error (RMS) that is always accepted \[px\]: a very good calibration must not
/// refuse a usual image.
const MIN_ACCEPTED_RMS_PX: f64 = 0.3;

/// Finds a mistyped image name before the long work.
pub fn check(planes: &[PathBuf], files: &[PathBuf]) -> Result<(), WrongArguments> {
    match planes.iter().find(|path| !path.is_file() && index_of(path, files).is_none()) {
        Some(path) => {
            Err(wrong!("--plane {}: no such image in the folder, and no such file", path.display()))
        }
        None => Ok(()),
    }
}

/// Index of the image in the folder: by path, or by name alone if there is no such file.
fn index_of(plane: &Path, files: &[PathBuf]) -> Option<usize> {
    let by_name = !plane.is_file() && plane.parent().is_none_or(|p| p.as_os_str().is_empty());
    let is_same = |file: &PathBuf| {
        (by_name && file.file_name() == plane.file_name())
            || plane.canonicalize().is_ok_and(|p| file.canonicalize().is_ok_and(|f| f == p))
    };
    files.iter().position(is_same)
}

/// Fits the bed plane to the boards in the named images, otherwise to the last board that was
/// found.
pub fn find(
    args: &CalibrateArgs,
    board: &Board,
    solution: &Solution,
    images: &CalibrationImages,
) -> anyhow::Result<BedPlane> {
    let CalibrationImages { files, found, on_bed: named } = images;
    let mut boards = BoardsOnBed::of(board);
    let mut passed_over = Vec::new();
    if named.is_empty() {
        let (last, later) = last_with_board(solution, found).context("no image shows the board")?;
        boards.add(last.to_owned(), corners_of(solution, last).unwrap_or_default())?;
        passed_over = later;
    }
    for path in named {
        let (image, corners) = on_bed(path, board, solution, (files, found))?;
        boards.add(image, corners)?;
    }
    let max_px = (MAX_RMS_RATIO * solution.rms_px).max(MIN_ACCEPTED_RMS_PX);
    let other = format!("the other images have {:.2} px", solution.rms_px);
    let (images, on_bed) = boards.fit(&solution.model, max_px, &other)?;
    Ok(BedPlane {
        images,
        assumed: named.is_empty(),
        passed_over,
        on_bed,
        thickness: args.board_thickness_mm,
        robot_z: args.robot_z_mm,
    })
}

/// The last image that shows a board, or its duplicate at the same position; and the images after
/// it that show a board, but were rejected.
fn last_with_board<'a>(
    solution: &'a Solution,
    found: &'a Observations,
) -> Option<(&'a str, Vec<String>)> {
    let mut later = Vec::new();
    for (name, board) in found.iter().rev() {
        match board {
            Ok(_) if solution.views.iter().any(|view| view.name == *name) => {
                return Some((name, later));
            }
            Err(BoardRejection::Duplicate { of, .. }) => return Some((of, later)),
            Ok(_)
            | Err(
                BoardRejection::Unreadable(_)
                | BoardRejection::NoBoard(_)
                | BoardRejection::NoMarkers(MarkerError::None { .. }),
            ) => {}
            Err(_) => later.push(name.clone()),
        }
    }
    None
}

fn corners_of(solution: &Solution, name: &str) -> Option<Vec<CornerObservation>> {
    solution.views.iter().find(|view| view.name == name).map(|view| view.corners.clone())
}

/// The board's corners in a named image: those of the calibration if it was used there, otherwise
/// detected again.
fn on_bed(
    path: &Path,
    board: &Board,
    solution: &Solution,
    (files, found): (&[PathBuf], &Observations),
) -> anyhow::Result<(String, Vec<CornerObservation>)> {
    if let Some((file, (name, observed))) =
        index_of(path, files).and_then(|index| Some((files.get(index)?, found.get(index)?)))
    {
        return match observed {
            Ok(_) => corners_of(solution, name)
                .map(|corners| (name.clone(), corners))
                .with_context(|| format!("--plane {name}: not used")),
            // A duplicate of another position is still a board on the bed.
            Err(BoardRejection::Duplicate { .. }) => {
                find_corners(file, board, solution.image_size_px)
            }
            Err(refusal) => {
                bail!("--plane {name}: {refusal}; name an image that shows the board")
            }
        };
    }
    find_corners(path, board, solution.image_size_px)
}
