//! Whether a calibration still holds: a board of a known size on the bed is measured
//! as a bead would be.

use nalgebra::{Point2, Vector2, Vector3};

use super::Camera;
use super::board::{Board, CornerObservation};
use super::equations::CameraModel;
use super::plane::bed_from_board;
use super::solve;
use super::{Calibration, SurfaceMap};
use crate::core::geometry::Pose;
use crate::core::units::Mm;

/// Widths are compared over this part of the board at least.
const MIN_PART: f64 = 0.3;
/// Standard deviations that the noise of two corners may make of the error of their
/// distance; there are hundreds of distances.
const NOISE_SIGMAS: f64 = 4.0;

/// What a board on the bed says of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Findings {
    /// Side of a square as it measures, in the mean \[mm\].
    pub square_mm: f64,
    /// That over its true side, less one.
    pub scale_error: f64,
    /// The error of the distance along a row or a column, 0.3 of the board long or
    /// longer, that is furthest beyond what the corners' noise explains, as a share of
    /// the distance.
    pub worst_error: f64,
    /// How much of it the corners' noise may make, as a share of the distance.
    pub noise: f64,
    /// Middle and length of that distance: column and row on the board, counted from
    /// 0, and mm.
    pub worst_at: (f64, f64, f64),
    /// Root mean square distance of the corners from a board of the measured size
    /// \[mm\].
    pub rms_mm: f64,
    /// How far the board lies above the place where it should be, by the size at which
    /// it is seen \[mm\]: its middle.
    pub height_mm: f64,
    /// How far it is tilted against the bed \[degrees\].
    pub tilt_deg: f64,
    /// Root mean square of what is left between seen and expected corners with the best
    /// pose of the board \[px\]: the lens alone, wherever the board lies.
    pub reprojection_rms_px: f64,
}

impl Findings {
    /// Whether no width is further off than this share of it, as far as the corners'
    /// noise lets it be seen.
    pub fn holds(&self, tolerance: f64) -> bool {
        self.scale_error.abs() <= tolerance && self.worst_error.abs() - self.noise <= tolerance
    }
}

/// Why a board says nothing of a calibration.
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
    let on_bed = places(&map, corners).ok_or(VerifyError::OffBed)?;
    let (scale, rms_mm) = similarity(board, corners, &on_bed).ok_or(VerifyError::OffBed)?;
    let (height_mm, tilt_deg, reprojection_rms_px) =
        board_pose(camera, bed, board, corners, thickness).ok_or(VerifyError::NoPose)?;
    let (worst_error, noise, worst_at) =
        worst(board, corners, &on_bed, reprojection_rms_px).ok_or(VerifyError::TooLittle)?;
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

fn places(map: &SurfaceMap, corners: &[CornerObservation]) -> Option<Vec<Point2<f64>>> {
    corners.iter().map(|corner| map.to_mm(corner.px)).collect()
}

/// Scale and residual \[mm\] of the similarity that takes the board to where it was
/// measured, by least squares; mirrored, because the bed's y and the board's run
/// against each other.
#[expect(clippy::cast_precision_loss, reason = "a count of corners")]
fn similarity(
    board: &Board,
    corners: &[CornerObservation],
    on_bed: &[Point2<f64>],
) -> Option<(f64, f64)> {
    let flat: Vec<Vector2<f64>> = board
        .correspondences(corners)
        .iter()
        .map(|c| Vector2::new(c.on_board.x, -c.on_board.y))
        .collect();
    let count = flat.len() as f64;
    let middle =
        |points: &mut dyn Iterator<Item = Vector2<f64>>| points.sum::<Vector2<f64>>() / count;
    let from = middle(&mut flat.iter().copied());
    let to = middle(&mut on_bed.iter().map(|p| p.coords));
    // Complex numbers: to − middle = s·(from − middle).
    let (mut along, mut across, mut squares) = (0.0, 0.0, 0.0);
    for (a, b) in flat.iter().zip(on_bed) {
        let (a, b) = (a - from, b.coords - to);
        along += a.dot(&b);
        across += a.perp(&b);
        squares += a.norm_squared();
    }
    let (re, im) = (along / squares, across / squares);
    let left: f64 = flat
        .iter()
        .zip(on_bed)
        .map(|(a, b)| {
            let a = a - from;
            let taken = Vector2::new(re * a.x - im * a.y, im * a.x + re * a.y);
            (b.coords - to - taken).norm_squared()
        })
        .sum();
    let scale = re.hypot(im);
    scale.is_finite().then(|| (scale, (left / count).sqrt()))
}

/// The error of a distance along a row or a column that is furthest beyond its noise,
/// as a share, with that noise and where it is. `None` where no two corners are as far
/// apart in a row or a column.
#[expect(clippy::cast_precision_loss, reason = "at most 100 corners a side")]
fn worst(
    board: &Board,
    corners: &[CornerObservation],
    on_bed: &[Point2<f64>],
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
            if (along as f64) < MIN_PART * (total - 1) as f64 {
                continue;
            }
            let true_mm = along as f64 * board.square().get();
            let error = (on_bed[j] - on_bed[i]).norm() / true_mm - 1.0;
            // Two ends, each off by 1/√2 of the RMS along the way between them.
            let noise = NOISE_SIGMAS * rms_px / (b.px - a.px).norm();
            if worst.is_none_or(|(most, of_it, _)| error.abs() - noise > most.abs() - of_it) {
                let middle = |a: usize, b: usize| 0.5 * (a + b) as f64;
                let place = (middle(column, other_column), middle(row, other_row), true_mm);
                worst = Some((error, noise, place));
            }
        }
    }
    worst
}

/// Height of the board above its place \[mm\], its tilt \[degrees\], and what the best
/// pose leaves \[px\].
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
    #[expect(clippy::cast_precision_loss, reason = "a count of corners")]
    let rms_px = (squares / corners.len() as f64).sqrt();
    Some((at.z - thickness.get(), tilt_deg, rms_px))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::synthetic;
    use crate::calibration::synthetic::{SIZE, TRUTH, board};

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
    fn a_board_that_is_higher_measures_larger_and_is_told_to_be_higher() {
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
