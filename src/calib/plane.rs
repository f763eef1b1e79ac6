//! The bed plane from the pose of a board that lay on it.

use nalgebra::{Rotation3, Vector3};

use crate::geometry::Pose;
use crate::units::Mm;

/// The bed's axes in the camera's, from those of a board whose printed face lay
/// `thickness` above the bed.
///
/// Z of the bed points at the camera. A board whose Z points away from it, as
/// is usual with corners counted like the picture's axes, is turned half round
/// its x axis; its origin and x stay, y and z change sign.
pub fn bed_from_board(board: &Pose, thickness: Mm) -> Pose {
    let face = board.translation_mm();
    let away_from_camera = board.rotation() * Vector3::z();
    let turn = if away_from_camera.dot(&face) > 0.0 {
        Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    } else {
        Rotation3::identity()
    };
    let rotation = board.rotation() * turn;
    let up = rotation * Vector3::z();
    Pose::from_parts(rotation, face - up * thickness.get())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    const TILT: [f64; 3] = [0.2, -0.3, 0.1];

    #[test]
    fn the_bed_looks_at_the_camera_whichever_way_the_board_did() {
        let up = std::f64::consts::PI;
        for turn in [Vector3::from(TILT), Vector3::new(up, 0.1, 0.0)] {
            let board = Pose::new(turn, Vector3::new(10.0, -20.0, 400.0));
            let bed = bed_from_board(&board, Mm::ZERO);
            let camera = bed.apply_inverse(Point3::origin());
            assert!(camera.z > 300.0, "the camera is {} mm above the bed", camera.z);
            assert!((bed.rotation().matrix().determinant() - 1.0).abs() < 1e-12);
            // The same plane: points of the board have height 0.
            let corner = board.apply(Point3::new(160.0, 100.0, 0.0));
            assert!(bed.apply_inverse(corner).z.abs() < 1e-9);
        }
    }

    #[test]
    fn a_thick_board_lies_higher_than_the_bed() {
        let board = Pose::new(Vector3::from(TILT), Vector3::new(10.0, -20.0, 400.0));
        let bed = bed_from_board(&board, Mm::constant(5.0));
        let corner = bed.apply_inverse(board.apply(Point3::new(40.0, 60.0, 0.0)));
        assert!((corner - Point3::new(40.0, -60.0, 5.0)).norm() < 1e-9, "{corner}");
    }
}
