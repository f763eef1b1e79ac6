//! The bed plane from boards that lay on it.

use nalgebra::{Point3, Rotation3, Vector3};

use super::bundle::{self, Guess};
use super::equations::{BoardPlacement, CameraModel, Correspondence, FreeParameters};
use super::solve;
use crate::core::{Mm, Pose};
use crate::numeric::number::to_f64;

/// Boards on the bed, in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct OnBed {
    /// Their poses; the axes are those of the first.
    pub place: BoardPlacement,
    /// Their corners.
    pub boards: Vec<Vec<Correspondence>>,
    /// Root mean square reprojection error \[px\].
    pub rms_px: f64,
    /// Largest distance from the plane of the middle of a board with a pose of its own \[mm\];
    /// 0 for a single board.
    pub off_mm: f64,
}

impl OnBed {
    /// Fits one plane to boards that a known camera sees. `None` without a board, or where the
    /// corners of one fit no pose.
    pub fn fit(model: &CameraModel, boards: Vec<Vec<Correspondence>>) -> Option<Self> {
        let poses: Vec<Pose> =
            boards.iter().map(|corners| solve::pose(model, corners)).collect::<Option<_>>()?;
        let (first, rest) = poses.split_first()?;
        let others = rest.iter().map(|pose| in_plane_of(first, pose)).collect();
        let start =
            Guess { model: *model, placements: vec![BoardPlacement { pose: *first, others }] };
        let all = [boards];
        let fit = bundle::fit(start, FreeParameters::PLACEMENTS, &all)?;
        let [boards] = all;
        let place = fit.placements.into_iter().next()?;
        let corners = to_f64(boards.iter().map(Vec::len).sum::<usize>().max(1));
        let off = poses.iter().zip(&boards).map(|(pose, corners)| {
            let middle = pose.apply(middle_of(corners));
            place.pose.apply_inverse(middle).z.abs()
        });
        let off_mm = if poses.len() > 1 { off.fold(0.0, f64::max) } else { 0.0 };
        Some(Self { place, boards, rms_px: (fit.sum_of_squares_px2 / corners).sqrt(), off_mm })
    }

    /// The bed's axes in the camera's, with the printed faces of the boards
    /// `thickness` above it.
    pub fn bed(&self, thickness: Mm) -> Pose {
        bed_from_board(&self.place.pose, thickness)
    }
}

/// Approximate position of a board in the plane of another.
fn in_plane_of(first: &Pose, other: &Pose) -> [f64; 3] {
    let origin = first.apply_inverse(Point3::from(other.translation_mm()));
    let along = first.turn_inverse(other.rotation() * Vector3::x());
    [origin.x, origin.y, along.y.atan2(along.x)]
}

fn middle_of(corners: &[Correspondence]) -> Point3<f64> {
    let count = to_f64(corners.len().max(1));
    let sum = corners.iter().map(|corner| corner.on_board.coords).sum::<nalgebra::Vector2<f64>>();
    Point3::new(sum.x / count, sum.y / count, 0.0)
}

/// The bed's axes in the camera's, from those of a board whose printed face lay
/// `thickness` above the bed.
///
/// Z of the bed points at the camera. A board whose Z points away from it, as
/// is usual with corners counted like the image's axes, is turned half round
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
    use crate::calibration::synthetic::{self, TRUTH, board};

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

    #[test]
    fn boards_on_one_plane_are_fitted_together() {
        let model = CameraModel { camera: TRUTH, bend_mm: [0.0; 2] };
        let pose = Pose::new(Vector3::from(TILT), Vector3::new(-70.0, -60.0, 420.0));
        let truth = BoardPlacement { pose, others: vec![[25.0, -14.0, 0.7], [-30.0, 22.0, -0.4]] };
        let seen = |i| board().correspondences(&synthetic::seen(&truth.of_board(i), || 0.0));
        let found = OnBed::fit(&model, (0..3).map(seen).collect()).unwrap();
        assert!(found.rms_px < 1e-9 && found.off_mm < 1e-6);
        let moved = found.place.pose.translation_mm() - pose.translation_mm();
        assert!(moved.norm() < 1e-6, "{moved}");
        for (other, true_other) in found.place.others.iter().zip(&truth.others) {
            for (a, b) in other.iter().zip(true_other) {
                assert!((a - b).abs() < 1e-6, "{other:?}");
            }
        }
        // One that lies 3 mm higher than the others shows.
        let up = Pose::from_parts(
            pose.rotation(),
            pose.translation_mm() - pose.rotation() * Vector3::z() * 3.0,
        );
        let high = board().correspondences(&synthetic::seen(&up, || 0.0));
        let found = OnBed::fit(&model, vec![seen(1), seen(2), high]).unwrap();
        assert!(found.off_mm > 0.5, "{}", found.off_mm);
        assert!(OnBed::fit(&model, vec![]).is_none());
    }
}
