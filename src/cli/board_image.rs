//! Detection of a board in an image file.

use std::path::Path;

use crate::calibration::board::Board;
use crate::calibration::board_observation::{self, BoardObservation};
use crate::calibration::rejection::BoardRejection;
use crate::core::{Channel, Stamp};
use crate::io::image_file;

/// Detects the board in an image file.
pub fn find_board(
    board: &Board,
    name: &str,
    path: &Path,
) -> Result<BoardObservation, BoardRejection> {
    let frame = image_file::read(path, Channel::Grey, 0, Stamp::START)
        .map_err(|error| BoardRejection::Unreadable(error.to_string()))?;
    board_observation::observe(board, name, &frame)
}

/// Fails if the size of an image is not that of the calibration.
pub fn check_size(found: &BoardObservation, expected: [u32; 2]) -> anyhow::Result<()> {
    let ([width, height], [right, bottom]) = (found.image_size_px, expected);
    anyhow::ensure!(
        found.image_size_px == expected,
        "{}: {width}x{height} px, but the calibration is for {right}x{bottom} px: take the \
         image as the camera was calibrated, or calibrate anew",
        found.name
    );
    Ok(())
}
