//! A board before a known camera, for the tests of what is found from it.

use nalgebra::{Point3, Vector3};

use super::Camera;
use super::board::{Board, CornerObservation, observe_all};
use super::board_observation::BoardObservation;
use crate::core::{ImagePoint, Mm, Pose};

pub const TRUTH: Camera = Camera {
    focal_px: [1210.0, 1215.0],
    centre_px: [352.0, 263.0],
    distortion: [-0.22, 0.11, 8e-4, -5e-4, 0.0, 0.0, 0.0, 0.0],
};
pub const SIZE: [u32; 2] = [720, 540];

pub fn board() -> Board {
    Board::new(9, 6, Mm::constant(20.0)).unwrap()
}

/// A dozen poses of the board around the image, tilted to all sides.
pub fn poses() -> Vec<Pose> {
    (0..12_u32)
        .map(|i| {
            let turn = f64::from(i) * 0.55;
            let tilt = 0.15 + 0.04 * f64::from(i);
            let rotation = Vector3::new(tilt * turn.cos(), tilt * turn.sin(), 0.1 * turn);
            let position =
                Vector3::new(-80.0 + 25.0 * turn.cos(), -50.0 + 18.0 * turn.sin(), 420.0);
            Pose::new(rotation, position)
        })
        .collect()
}

/// Where the true camera sees the corners of a board \[px\], each coordinate
/// off by what `off` gives.
pub fn corners(pose: &Pose, mut off: impl FnMut() -> f64) -> Vec<ImagePoint> {
    let seen = |corner: Point3<f64>| TRUTH.project(pose.apply(corner)).unwrap();
    let board_mm = board().corners_mm();
    board_mm.into_iter().map(seen).map(|p| ImagePoint::new(p.x + off(), p.y + off())).collect()
}

/// Those corners as observations.
pub fn seen(pose: &Pose, off: impl FnMut() -> f64) -> Vec<CornerObservation> {
    observe_all(&corners(pose, off))
}

/// The observation of those corners in an image.
pub fn sighting(name: &str, pose: &Pose, off: impl FnMut() -> f64) -> BoardObservation {
    BoardObservation {
        name: name.to_owned(),
        image_size_px: SIZE,
        corners: seen(pose, off),
        focus: None,
    }
}
