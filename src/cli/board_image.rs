//! A board in an image file.

use std::path::Path;

use crate::calibration::board::Board;
use crate::calibration::board_observation;
use crate::calibration::board_observation::BoardObservation;
use crate::calibration::rejection::BoardRejection;
use crate::core::frame::Channel;
use crate::core::time::Stamp;
use crate::io::image_file;

/// Looks for the board in an image file.
pub fn find_board(
    board: &Board,
    name: &str,
    path: &Path,
) -> Result<BoardObservation, BoardRejection> {
    let frame = image_file::read(path, Channel::Grey, 0, Stamp::START)
        .map_err(|error| BoardRejection::Unreadable(error.to_string()))?;
    board_observation::observe(board, name, &frame)
}

/// Fails for a picture that is not of the size that a calibration is for.
pub fn check_size(sighting: &BoardObservation, expected: [u32; 2]) -> anyhow::Result<()> {
    let ([width, height], [right, bottom]) = (sighting.image_size_px, expected);
    anyhow::ensure!(
        sighting.image_size_px == expected,
        "{}: {width}x{height} px, but the calibration is for {right}x{bottom} px: take the \
         image as the camera was calibrated, or calibrate anew",
        sighting.name
    );
    Ok(())
}
