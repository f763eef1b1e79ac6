//! Whether a calibration still holds: a board of known size on the bed is measured as a bead
//! would be.

use nalgebra::{Vector2, Vector3};

use super::board::{Board, CornerObservation};
use super::board_fit::BoardFit;
use super::equations::CameraModel;
use super::plane::bed_from_board;
use super::{Calibration, Camera, solve};
use crate::core::{Mm, Pose};
use crate::numeric::number::to_f64;

/// Distances are compared over at least this fraction of the board. A choice between noise and
/// resolution.
const MIN_PART: f64 = 0.3;
/// Standard deviations by which the noise of two corners may change their distance: some
/// hundred distances are compared.
const NOISE_SIGMAS: f64 = 4.0;

/// Result of the verification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Findings {
    /// Measured side of a square \[mm\].
    pub square_mm: f64,
    /// Measured over true side, less one.
    pub scale_error: f64,
    /// Relative error of the distance along a row or a column that exceeds the noise of the
    /// corners most, at least 0.3 of the board long.
    pub worst_error: f64,
    /// Part of it that the noise of the corners explains, as a fraction of the distance.
    pub noise: f64,
    /// Middle of that distance as column and row on the board, from 0, and its length \[mm\].
    pub worst_at: (f64, f64, f64),
    /// Root mean square distance of the corners from a board of the measured size \[mm\].
    pub rms_mm: f64,
    /// Height of the board's middle above its true position, from its apparent size \[mm\].
    pub height_mm: f64,
    /// Tilt against the bed \[degrees\].
    pub tilt_deg: f64,
    /// Root mean square reprojection error with the best pose of the board \[px\]: the lens
    /// alone, wherever the board is.
    pub reprojection_rms_px: f64,
}

impl Findings {
    /// Whether no width has a larger relative error than this, beyond the noise of the corners.
    pub fn holds(&self, tolerance: f64) -> bool {
        self.scale_error.abs() <= tolerance && self.worst_error.abs() - self.noise <= tolerance
    }
}

/// Why a board does not verify a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum VerifyError {
    /// A single number has no camera.
    #[error("the calibration is a single number; a board can be held against a camera only")]
    NoCamera,
    /// A corner's ray misses the bed.
    #[error("not all of the board is seen on the bed, as the calibration has it")]
    OffBed,
    /// Too small a part of a board with markers.
    #[error("too little of the board shows: {:.0} % of a row or a column are needed", 100.0 * MIN_PART)]
    TooLittle,
    /// No pose.
    #[error("the corners fit no board before the calibration's camera")]
    NoPose,
}

/// Measures a board whose printed face lies `thickness` above the bed.
pub fn verify(
    calibration: &Calibration,
    board: &Board,
    corners: &[CornerObservation],
    thickness: Mm,
) -> Result<Findings, VerifyError> {
    let Calibration::Full { camera, bed, .. } = calibration else {
        return Err(VerifyError::NoCamera);
    };
    let map = calibration.surface(thickness, None);
    let BoardFit { on_plane, scale, rms_mm, .. } =
        BoardFit::similar(&map, board, corners).ok_or(VerifyError::OffBed)?;
    let (height_mm, tilt_deg, reprojection_rms_px) =
        board_pose(camera, bed, board, corners, thickness).ok_or(VerifyError::NoPose)?;
    let (worst_error, noise, worst_at) =
        worst(board, corners, &on_plane, reprojection_rms_px).ok_or(VerifyError::TooLittle)?;
    Ok(Findings {
        square_mm: scale * board.square().get(),
        scale_error: scale - 1.0,
        worst_error,
        noise,
        worst_at,
        rms_mm,
        height_mm,
        tilt_deg,
        reprojection_rms_px,
    })
}

/// The relative error of a distance along a row or a column that exceeds its noise most, with
/// that noise and its position. `None` without two corners far enough apart.
fn worst(
    board: &Board,
    corners: &[CornerObservation],
    on_plane: &[Vector2<f64>],
    rms_px: f64,
) -> Option<(f64, f64, (f64, f64, f64))> {
    let columns = board.corners().columns;
    let mut worst: Option<(f64, f64, (f64, f64, f64))> = None;
    for (i, a) in corners.iter().enumerate() {
        for (j, b) in corners.iter().enumerate().skip(i + 1) {
            let at = |index: usize| (index % columns, index / columns);
            let ((column, row), (other_column, other_row)) = (at(a.index), at(b.index));
            let (along, total) = if row == other_row {
                (column.abs_diff(other_column), columns)
            } else if column == other_column {
                (row.abs_diff(other_row), board.corners().rows)
            } else {
                continue;
            };
            if to_f64(along) < MIN_PART * to_f64(total - 1) {
                continue;
            }
            let true_mm = to_f64(along) * board.square().get();
            let error = (on_plane[j] - on_plane[i]).norm() / true_mm - 1.0;
            // Two ends, each with a standard deviation of RMS/√2 along the distance.
            let noise = NOISE_SIGMAS * rms_px / (b.px - a.px).norm();
            if worst.is_none_or(|(most, of_it, _)| error.abs() - noise > most.abs() - of_it) {
                let middle = |a: usize, b: usize| 0.5 * to_f64(a + b);
                let position = (middle(column, other_column), middle(row, other_row), true_mm);
                worst = Some((error, noise, position));
            }
        }
    }
    worst
}

/// Height of the board above its position \[mm\], its tilt \[degrees\], and the reprojection
/// error of the best pose \[px\].
fn board_pose(
    camera: &Camera,
    bed: &Pose,
    board: &Board,
    corners: &[CornerObservation],
    thickness: Mm,
) -> Option<(f64, f64, f64)> {
    let model = CameraModel { camera: *camera, bend_mm: [0.0; 2] };
    let placed = board.correspondences(corners);
    let pose = solve::pose(&model, &placed)?;
    let squares =
        model.sum_of_squares_px2(&super::equations::BoardPlacement::of_one(pose), &[placed])?;
    let seen = bed_from_board(&pose, Mm::ZERO);
    let middle = board.corners_mm().last()?.coords / 2.0;
    let at = bed.apply_inverse(pose.apply(middle.into()));
    let (up, true_up) = (seen.rotation() * Vector3::z(), bed.rotation() * Vector3::z());
    let tilt_deg = up.cross(&true_up).norm().atan2(up.dot(&true_up)).to_degrees();
    let rms_px = (squares / to_f64(corners.len())).sqrt();
    Some((at.z - thickness.get(), tilt_deg, rms_px))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::synthetic::{self, SIZE, TRUTH, board};

    const THICKNESS: Mm = Mm::constant(3.0);

    fn pose() -> Pose {
        Pose::new(Vector3::new(0.1, -0.05, 0.2), Vector3::new(-80.0, -50.0, 420.0))
    }

    fn calibration(camera: Camera) -> Calibration {
        Calibration::Full {
            image_size_px: SIZE,
            camera,
            bed: bed_from_board(&pose(), THICKNESS),
            robot_z: Mm::ZERO,
            quality: None,
        }
    }

    /// The board on the bed, turned and shifted in its plane and so much higher.
    fn seen(higher_mm: f64) -> Vec<CornerObservation> {
        let up = bed_from_board(&pose(), Mm::ZERO).rotation() * Vector3::z();
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 0.2);
        let moved = Pose::from_parts(
            pose().rotation() * turn,
            pose().apply(nalgebra::Point3::new(15.0, -20.0, 0.0)).coords + up * higher_mm,
        );
        synthetic::seen(&moved, || 0.0)
    }

    #[test]
    fn a_calibration_that_holds_measures_the_squares_as_they_are() {
        let found = verify(&calibration(TRUTH), &board(), &seen(0.0), THICKNESS).unwrap();
        assert!((found.square_mm - 20.0).abs() < 1e-6, "{found:?}");
        for nothing in [found.worst_error, found.rms_mm, found.height_mm, found.tilt_deg] {
            assert!(nothing.abs() < 1e-4, "{found:?}");
        }
    }

    #[test]
    fn a_higher_board_measures_larger_and_its_height_is_found() {
        let found = verify(&calibration(TRUTH), &board(), &seen(4.0), THICKNESS).unwrap();
        assert!((found.height_mm - 4.0).abs() < 1e-3, "{found:?}");
        // 4 mm of about 415 mm.
        assert!((found.scale_error - 0.0097).abs() < 0.0005, "{found:?}");
        assert!(found.reprojection_rms_px < 1e-6 && found.tilt_deg < 1e-3);
    }

    #[test]
    fn a_lens_that_was_turned_shows_in_what_is_left() {
        let mut zoomed = TRUTH;
        zoomed.distortion[0] += 0.05;
        zoomed.focal_px = zoomed.focal_px.map(|focal| 1.01 * focal);
        let found = verify(&calibration(zoomed), &board(), &seen(0.0), THICKNESS).unwrap();
        assert!(found.reprojection_rms_px > 0.02, "{found:?}");
        assert!((found.scale_error + 0.0099).abs() < 0.002, "{found:?}");
        let (_, _, length) = found.worst_at;
        assert!(length >= 40.0 && !found.holds(0.002) && found.holds(0.02));
    }

    #[test]
    fn a_single_number_cannot_be_verified() {
        let single = Calibration::Scale { mm_per_px: 0.1, sigma: None };
        let error = verify(&single, &board(), &seen(0.0), THICKNESS).unwrap_err();
        assert_eq!(error, VerifyError::NoCamera);
    }
}
