//! Dark quadrilaterals in an image, which may be markers.

use nalgebra::Point2;
use opencv::core::{Mat, Point, Vector};
use opencv::imgproc::{
    ADAPTIVE_THRESH_MEAN_C, CHAIN_APPROX_SIMPLE, RETR_LIST, THRESH_BINARY_INV, adaptive_threshold,
    approx_poly_dp, arc_length, contour_area, find_contours_def, is_contour_convex,
};

use super::{BridgeError, during, grey8_mat, prepare};
use crate::core::{Frame, ImagePoint};

/// Window sizes of the adaptive threshold \[px\], for borders of markers of different sizes. A
/// choice: factors of two.
const NEIGHBOURHOODS_PX: [i32; 4] = [11, 23, 47, 95];
/// Grey levels below the mean of the window that count as dark (the default of OpenCV's `ArUco`
/// detector).
const MIN_DARKNESS: f64 = 7.0;
/// Smallest perimeter of a quadrilateral \[px\]: a smaller marker cannot be read.
const MIN_PERIMETER_PX: f64 = 36.0;
/// Smallest area over that of a square of equal perimeter. A choice for inclined views.
const MIN_FULLNESS: f64 = 0.25;
/// Largest deviation of an outline from straight sides over its length. A choice.
const STRAIGHT_TOLERANCE: f64 = 0.04;

/// Corners of dark convex quadrilaterals \[px\], to about a pixel, clockwise in the image. A
/// quadrilateral may be found several times.
pub fn find_quads(frame: &Frame) -> Result<Vec<[ImagePoint; 4]>, BridgeError> {
    prepare();
    let image = grey8_mat(frame)?;
    let mut quads = Vec::new();
    for side in NEIGHBOURHOODS_PX {
        quads.extend(dark(&image, side).map_err(during("finding markers"))?);
    }
    Ok(quads)
}

fn dark(image: &Mat, neighbourhood: i32) -> opencv::Result<Vec<[ImagePoint; 4]>> {
    let mut mask = Mat::default();
    let (mean, inverse) = (ADAPTIVE_THRESH_MEAN_C, THRESH_BINARY_INV);
    adaptive_threshold(image, &mut mask, 255.0, mean, inverse, neighbourhood, MIN_DARKNESS)?;
    let mut outlines = Vector::<Vector<Point>>::new();
    find_contours_def(&mask, &mut outlines, RETR_LIST, CHAIN_APPROX_SIMPLE)?;
    let mut quads = Vec::new();
    for outline in outlines {
        let round = arc_length(&outline, true)?;
        if round < MIN_PERIMETER_PX {
            continue;
        }
        let mut corners = Vector::<Point>::new();
        approx_poly_dp(&outline, &mut corners, STRAIGHT_TOLERANCE * round, true)?;
        if corners.len() != 4 || !is_contour_convex(&corners)? {
            continue;
        }
        let area = contour_area(&corners, true)?;
        if area.abs() < MIN_FULLNESS * (round / 4.0).powi(2) {
            continue;
        }
        let at = |i: usize| corners.get(i).map(|p| Point2::new(f64::from(p.x), f64::from(p.y)));
        let order = if area > 0.0 { [0, 1, 2, 3] } else { [3, 2, 1, 0] };
        quads.push([at(order[0])?, at(order[1])?, at(order[2])?, at(order[3])?]);
    }
    Ok(quads)
}
