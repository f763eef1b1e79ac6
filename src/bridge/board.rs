//! Inner corners of a checkerboard, to a fraction of a pixel.

use nalgebra::Point2;
use opencv::calib3d::{
    CALIB_CB_ACCURACY, CALIB_CB_ADAPTIVE_THRESH, CALIB_CB_EXHAUSTIVE, CALIB_CB_NORMALIZE_IMAGE,
    find_chessboard_corners, find_chessboard_corners_sb,
};
use opencv::core::{Mat, Point2f, Size, TermCriteria, TermCriteria_Type, Vector};
use opencv::imgproc::corner_sub_pix;

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
    let image = match frame.pixels() {
        Pixels::Grey8(values) => mat_of(frame, values)?,
        Pixels::Grey16(values) => {
            let exact: Vec<f32> = values.iter().map(|&v| f32::from(v)).collect();
            mat_of(frame, &exact)?
        }
    };
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

#[expect(clippy::cast_possible_truncation, reason = "clamped to a few pixels")]
/// A window of its own for each corner, because on a tilted board near squares
/// are large and far ones small.
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
