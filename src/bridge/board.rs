//! Inner corners of a checkerboard, to a fraction of a pixel.

use nalgebra::Point2;
use opencv::calib3d::{
    CALIB_CB_ACCURACY, CALIB_CB_ADAPTIVE_THRESH, CALIB_CB_EXHAUSTIVE, CALIB_CB_NORMALIZE_IMAGE,
    find_chessboard_corners, find_chessboard_corners_sb,
};
use opencv::core::{BORDER_DEFAULT, Mat, Point2f, Size, TermCriteria, TermCriteria_Type, Vector};
use opencv::imgproc::{corner_sub_pix, gaussian_blur};

use super::{BridgeError, during, grey8_mat, mat_of, prepare};
use crate::frame::{Frame, Pixels};
use crate::geometry::ImagePoint;

/// Half side of the window in which a corner is refined \[px\]: it must see the
/// edges that meet there, and none of the next squares'.
const SMALLEST_WINDOW: f64 = 3.0;
const LARGEST_WINDOW: f64 = 11.0;
/// Half side of the window over the distance of the nearest corner. On real
/// boards the error falls up to about 0.35 and rises steeply from 0.4 on, when
/// windows on tilted squares reach the next edges.
const WINDOW_OVER_SPACING: f64 = 0.25;
/// Standard deviation of the blur before the refinement \[px\], which takes
/// gradients between pixels and is biased where edges are as sharp as a pixel.
/// It halves the error on rendered boards.
const BLUR_PX: f64 = 1.0;
const REFINE_STEPS: i32 = 100;
const REFINE_PX: f64 = 1e-4;

/// Finds the inner corners of a checkerboard, `columns` by `rows` of them, row
/// by row \[px\]. `None` where the whole board is not in the picture.
///
/// Quads in an adaptive threshold first; where these are not found, the slower
/// search for saddle points (Duda and Frese 2018), which sees through blur and
/// uneven light. Both are refined by the same gradient method.
pub fn find_board(
    frame: &Frame,
    (columns, rows): (usize, usize),
) -> Result<Option<Vec<ImagePoint>>, BridgeError> {
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
    refine(frame, columns, &mut corners)?;
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

/// Moves each corner to where the gradients around it are all at right angles
/// to the line from the corner. 16-bit values are used as they are.
fn refine(frame: &Frame, columns: usize, corners: &mut Vector<Point2f>) -> Result<(), BridgeError> {
    let exact: Vec<f32> = match frame.pixels() {
        Pixels::Grey8(values) => values.iter().map(|&v| f32::from(v)).collect(),
        Pixels::Grey16(values) => values.iter().map(|&v| f32::from(v)).collect(),
    };
    let (sharp, mut image) = (mat_of(frame, &exact)?, Mat::default());
    gaussian_blur(&sharp, &mut image, Size::new(0, 0), BLUR_PX, BLUR_PX, BORDER_DEFAULT)
        .map_err(during("refining the corners of a board"))?;
    let stop = TermCriteria {
        typ: TermCriteria_Type::COUNT as i32 | TermCriteria_Type::EPS as i32,
        max_count: REFINE_STEPS,
        epsilon: REFINE_PX,
    };
    let rough: Vec<Point2f> = corners.iter().collect();
    for (index, corner) in rough.iter().enumerate() {
        let half = half_window(&rough, columns, index);
        let mut one = Vector::from_slice(&[*corner]);
        corner_sub_pix(&image, &mut one, Size::new(half, half), Size::new(-1, -1), stop)
            .and_then(|()| corners.set(index, one.get(0)?))
            .map_err(during("refining the corners of a board"))?;
    }
    Ok(())
}

/// A window of its own for each corner, because on a tilted board near squares
/// are large and far ones small.
#[expect(clippy::cast_possible_truncation, reason = "clamped to a few pixels")]
fn half_window(corners: &[Point2f], columns: usize, index: usize) -> i32 {
    let (column, row) = (index % columns, index / columns);
    let beside = |a: usize, b: usize| a.abs_diff(b) <= 1;
    let here = corners[index];
    // The window is a square along the picture's axes, and so is its distance.
    let spacing = corners
        .iter()
        .enumerate()
        .filter(|(i, _)| *i != index && beside(i % columns, column) && beside(i / columns, row))
        .map(|(_, near)| f64::from((near.x - here.x).abs().max((near.y - here.y).abs())))
        .fold(f64::INFINITY, f64::min);
    (spacing * WINDOW_OVER_SPACING).clamp(SMALLEST_WINDOW, LARGEST_WINDOW) as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::board::Board;
    use crate::calib::{Calibration, Camera};
    use crate::geometry::Pose;
    use crate::time::Stamp;
    use crate::units::Mm;
    use nalgebra::{Point3, Vector3};

    const CAMERA: Camera = Camera {
        focal_px: [620.0, 622.0],
        centre_px: [203.0, 148.0],
        distortion: [-0.2, 0.05, 1e-3, -5e-4, 0.0],
    };
    const SIZE: (u32, u32) = (400, 300);

    fn pose() -> Pose {
        // The board's own axes: Z away from the camera.
        Pose::new(Vector3::new(0.35, -0.25, 0.1), Vector3::new(-80.0, -45.0, 420.0))
    }

    /// The share of a pixel that is white on a board with squares of 20 mm, by
    /// 8x8 samples.
    fn white_share(column: u32, row: u32, board: &Calibration) -> f64 {
        let map = board.surface(Mm::ZERO, None);
        let step = |i: u32| (f64::from(i) + 0.5) / 8.0 - 0.5;
        let is_white = |i: u32| {
            let px = Point2::new(f64::from(column) + step(i % 8), f64::from(row) + step(i / 8));
            let on_board = map.to_mm(px).unwrap() / 20.0;
            let outside = !(-1.0..9.0).contains(&on_board.x) || !(-1.0..6.0).contains(&on_board.y);
            let odd = (on_board.x.floor() + on_board.y.floor()).rem_euclid(2.0) > 0.5;
            outside || odd
        };
        f64::from(u8::try_from((0..64).filter(|&i| is_white(i)).count()).unwrap()) / 64.0
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
    fn picture(black: f64, white: f64) -> Vec<u16> {
        let board = Calibration::Full {
            image_size_px: [SIZE.0, SIZE.1],
            camera: CAMERA,
            bed: pose(),
            robot_z: Mm::ZERO,
            quality: None,
        };
        (0..SIZE.0 * SIZE.1)
            .map(|i| white_share(i % SIZE.0, i / SIZE.0, &board))
            .map(|share| (black + (white - black) * share).round() as u16)
            .collect()
    }

    fn frame(pixels: Pixels) -> Frame {
        Frame::new(0, Stamp::START, (SIZE.0 as usize, SIZE.1 as usize), pixels).unwrap()
    }

    /// Largest distance of a found corner from where it truly is \[px\].
    fn worst_corner(frame: &Frame) -> f64 {
        let board = Board::new(9, 6, Mm::constant(20.0)).unwrap();
        let found = board.order(find_board(frame, (9, 6)).unwrap().unwrap()).unwrap();
        let mut truth: Vec<ImagePoint> = board
            .corners_mm()
            .iter()
            .map(|p: &Point3<f64>| CAMERA.project(pose().apply(*p)).unwrap())
            .collect();
        if (truth[0] - found[0]).norm() > 20.0 {
            truth.reverse();
        }
        found.iter().zip(&truth).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn corners_are_found_to_a_few_hundredths_of_a_pixel_at_both_depths() {
        let ten_bit = picture(60.0, 900.0);
        assert!(worst_corner(&frame(Pixels::Grey16(ten_bit))) < 0.06);
        let eight_bit = picture(20.0, 230.0).iter().map(|v| v.to_le_bytes()[0]).collect();
        assert!(worst_corner(&frame(Pixels::Grey8(eight_bit))) < 0.06);
    }

    #[test]
    fn no_board_and_another_board_are_none() {
        let empty = frame(Pixels::Grey8(vec![90; 400 * 300]));
        assert_eq!(find_board(&empty, (9, 6)).unwrap(), None);
        let other = frame(Pixels::Grey16(picture(60.0, 900.0)));
        assert_eq!(find_board(&other, (11, 8)).unwrap(), None);
    }
}
