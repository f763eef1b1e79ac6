//! Inner corners of a checkerboard, to about a pixel.

use nalgebra::Point2;
use opencv::calib3d::{
    CALIB_CB_ACCURACY, CALIB_CB_ADAPTIVE_THRESH, CALIB_CB_EXHAUSTIVE, CALIB_CB_LARGER,
    CALIB_CB_NORMALIZE_IMAGE, find_chessboard_corners, find_chessboard_corners_sb,
    find_chessboard_corners_sb_with_meta,
};
use opencv::core::{Mat, MatTraitConst, Point2f, Size, Vector};

use super::{BridgeError, during, grey8_mat, prepare};
use crate::core::{Frame, GridSize, ImagePoint};

/// Finds a number of inner corners of a checkerboard, row by row \[px\]. `None` where the board
/// is not entirely in the image.
///
/// Squares in an adaptive threshold first; if these are not found, the slower search for saddle
/// points (Duda and Frese 2018), which tolerates blur and uneven light.
/// [`crate::calibration::corner`] refines the corners.
pub fn find_board(frame: &Frame, inner: GridSize) -> Result<Option<Vec<ImagePoint>>, BridgeError> {
    let GridSize { columns, rows } = inner;
    prepare();
    let (Ok(width), Ok(height)) = (i32::try_from(columns), i32::try_from(rows)) else {
        return Ok(None);
    };
    let pattern = Size::new(width, height);
    let image = grey8_mat(frame)?;
    let mut corners = Vector::<Point2f>::new();
    let found = search(&image, pattern, &mut corners).map_err(during("finding a board"))?;
    if !found || corners.len() != columns * rows {
        return Ok(None);
    }
    Ok(Some(corners.iter().map(|p| Point2::new(f64::from(p.x), f64::from(p.y))).collect()))
}

fn search(image: &Mat, pattern: Size, corners: &mut Vector<Point2f>) -> opencv::Result<bool> {
    let quads = CALIB_CB_ADAPTIVE_THRESH | CALIB_CB_NORMALIZE_IMAGE;
    if find_chessboard_corners(image, pattern, corners, quads)? {
        return Ok(true);
    }
    corners.clear();
    let saddles = CALIB_CB_NORMALIZE_IMAGE | CALIB_CB_EXHAUSTIVE | CALIB_CB_ACCURACY;
    find_chessboard_corners_sb(image, pattern, corners, saddles)
}

/// Number of inner corners of the largest board in an image. `None` where there is none of at
/// least 3 by 3.
pub fn find_any_board(frame: &Frame) -> Result<Option<GridSize>, BridgeError> {
    prepare();
    let image = grey8_mat(frame)?;
    let (mut corners, mut meta) = (Vector::<Point2f>::new(), Mat::default());
    let flags = CALIB_CB_NORMALIZE_IMAGE | CALIB_CB_LARGER;
    let smallest = Size::new(3, 3);
    let found =
        find_chessboard_corners_sb_with_meta(&image, smallest, &mut corners, flags, &mut meta)
            .map_err(during("finding a board of any size"))?;
    let side = |count: i32| usize::try_from(count).unwrap_or(0);
    Ok(found.then(|| GridSize::new(side(meta.cols()), side(meta.rows()))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Camera;
    use crate::calibration::board::Board;
    use crate::core::{self, Mm, Pixels, Pose, Stamp};
    use crate::sim::board_studio::{BoardStudio, Exposure};
    use nalgebra::Vector3;

    const SIZE: [u32; 2] = [400, 300];

    fn picture() -> Frame {
        let camera = Camera::pinhole([620.0, 622.0], [203.0, 148.0]);
        let board = Board::new(9, 6, Mm::constant(20.0)).unwrap();
        let pose = Pose::new(Vector3::new(0.35, -0.25, 0.1), Vector3::new(-80.0, -45.0, 420.0));
        BoardStudio::new(&camera, SIZE).take(&board, &pose, Exposure::SHARP, 1).unwrap()
    }

    /// With 10 bits of 16.
    fn ten_bits(eight: &Frame) -> Frame {
        let values = eight.to_grey8().iter().map(|&v| 60 + 3 * u16::from(v)).collect();
        Frame::new(0, Stamp::START, eight.size(), Pixels::Grey16(values)).unwrap()
    }

    #[test]
    fn all_corners_are_found_at_both_depths() {
        let eight = picture();
        let found = find_board(&eight, GridSize::new(9, 6)).unwrap().unwrap();
        let again = find_board(&ten_bits(&eight), GridSize::new(9, 6)).unwrap().unwrap();
        assert_eq!(found.len(), 54);
        for (a, b) in found.iter().zip(&again) {
            assert!((a - b).norm() < 0.5, "{a} {b}");
        }
    }

    #[test]
    fn no_board_and_another_board_are_none() {
        let empty = Frame::new(
            0,
            Stamp::START,
            core::Size::new(400, 300),
            Pixels::Grey8(vec![90; 400 * 300]),
        )
        .unwrap();
        assert_eq!(find_board(&empty, GridSize::new(9, 6)).unwrap(), None);
        assert_eq!(find_any_board(&empty).unwrap(), None);
        let other = picture();
        assert_eq!(find_board(&other, GridSize::new(11, 8)).unwrap(), None);
        let GridSize { columns, rows } = find_any_board(&other).unwrap().unwrap();
        assert_eq!((columns.max(rows), columns.min(rows)), (9, 6));
    }
}
