use nalgebra::{Point3, Rotation3, Vector3};

use super::*;
use crate::calibration::board::Markers;
use crate::calibration::board_observation::{self, BoardObservation};
use crate::calibration::dictionary::Dictionary;
use crate::calibration::{CalibrationQuality, Camera};
use crate::core::{Frame, Pixels, Pose, Size, Stamp};
use crate::sim::board_studio::{BoardStudio, Exposure};
use crate::sim::hash;

const SIZE: [u32; 2] = [640, 480];
const TILT: f64 = 0.2;
const THICKNESS: f64 = 3.0;
/// Height of the surface, and where the middle of the gauge lies on it.
const SURFACE: f64 = 15.0;
const MIDDLE: [f64; 2] = [0.0, -30.0];
/// Where the nozzle touches the board, and where that is from the gauge's middle.
const AT: [f64; 2] = [4.0, -1.0];
const AHEAD: f64 = 85.0;
const RIGHT: f64 = 1.2;

/// A lens that bends no line through its middle, so that a column there stays one.
fn camera() -> Camera {
    Camera::pinhole([900.0, 901.0], [320.0, 240.0]).with_five([-0.15, 0.08, 0.0, 0.0, 0.0])
}

/// Tilted about the image's x: its middle column lies along the bed's y.
fn bed() -> Pose {
    let turn = Vector3::new(std::f64::consts::PI + TILT, 0.0, 0.0);
    Pose::new(turn, Vector3::new(0.0, 0.0, 430.0))
}

fn calibration() -> Calibration {
    let quality = CalibrationQuality {
        reprojection_rms_px: 0.1,
        width_relative_sigma: Some(1e-3),
        seen_px: None,
        uncertainty: None,
        heights_mm: None,
    };
    Calibration::Full {
        image_size_px: SIZE,
        camera: camera(),
        bed: bed(),
        robot_z: Mm::ZERO,
        quality: Some(quality),
    }
}

fn gauge() -> OffsetGauge {
    let middle = bed().apply(Point3::new(MIDDLE[0], MIDDLE[1], SURFACE));
    OffsetGauge {
        middle: camera().project(middle).unwrap(),
        ahead: Vector2::new(0.0, -1.0),
        right: Vector2::new(1.0, 0.0),
        surface_height: Mm::constant(SURFACE),
        surface_height_sigma: Mm::ZERO,
    }
}

fn board() -> Board {
    Board::new(9, 6, Mm::constant(20.0)).unwrap()
}

fn touch(sigma_mm: f64) -> Touch {
    let (sigma, thickness) = (Mm::new(sigma_mm).unwrap(), Mm::constant(THICKNESS));
    Touch { position: AT, sigma, thickness, robot_z: None }
}

/// The board so that a position of it, in squares, lies at a position of the bed; a little
/// turned.
fn lies(at: [f64; 2], on_bed: [f64; 2], height: f64) -> Pose {
    let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
        * Rotation3::from_axis_angle(&Vector3::z_axis(), 0.12);
    let place = Vector3::new(on_bed[0], on_bed[1], height);
    let origin = place - turn * (Vector3::new(at[0], at[1], 0.0) * 20.0);
    Pose::from_parts(bed().rotation() * turn, bed().apply(origin.into()).coords)
}

/// The image of a board that is displaced by this from the specified position `AT`.
fn seen(off: [f64; 2], height: f64, seed: u64) -> BoardObservation {
    let place = [MIDDLE[0] + RIGHT + off[0], MIDDLE[1] + AHEAD + off[1]];
    let studio = BoardStudio::new(&camera(), SIZE);
    let frame = studio.take(&board(), &lies(AT, place, height), Exposure::SHARP, seed).unwrap();
    board_observation::observe(&board(), "", &frame).unwrap()
}

fn found(sighting: &BoardObservation, touch: &Touch) -> NozzleOffset {
    find(&calibration(), &gauge(), &board(), &sighting.corners, touch).unwrap()
}

#[test]
fn the_truth_lies_within_the_reported_sigma() {
    let mut squares = 0.0;
    for seed in 0..10 {
        let off = hash::normal_pair(hash::mix(&[41, seed])).map(|z| 0.5 * z);
        let found = found(&seen(off, THICKNESS, seed), &touch(0.5));
        let sigma = found.parts.sigma().get();
        assert!((0.5..0.6).contains(&sigma), "{found:?}");
        for error in [found.along_mm - AHEAD, found.across_mm - RIGHT] {
            assert!(error.abs() < 3.0 * sigma, "{found:?}");
            squares += (error / sigma).powi(2) / 20.0;
        }
    }
    assert!((0.4..1.8).contains(&squares), "{squares}");
}

#[test]
fn a_touch_that_is_certain_leaves_the_noise_of_the_corners() {
    for seed in 0..4 {
        let found = found(&seen([0.0; 2], THICKNESS, seed), &touch(0.0));
        let off = (found.along_mm - AHEAD).hypot(found.across_mm - RIGHT);
        assert!(off < 4.0 * found.parts.corners.get() && off < 0.05, "{off} mm, {found:?}");
        assert!(found.scale_error.abs() < 5e-4 && found.rms_mm < 0.05, "{found:?}");
        // The corner that the nozzle's row begins at is above and left of the middle.
        assert!(found.first_corner.y < 240.0 && found.first_corner.x < 320.0, "{found:?}");
        assert!((found.parts.calibration.unwrap().get() - 0.085).abs() < 1e-3, "{found:?}");
    }
}

/// The nozzle hides a part of the board, and lies within it: what a plain board cannot
/// tell.
#[test]
fn a_board_with_markers_has_one_reading_and_may_be_covered_in_part() {
    let marks = Markers { side: Mm::constant(14.0), dictionary: Dictionary::Four };
    let marked = board().with_marks(marks).unwrap();
    let at = [4.0, 2.0];
    let place = [MIDDLE[0] + RIGHT, MIDDLE[1] + 20.0];
    let studio = BoardStudio::new(&camera(), SIZE);
    let pose = lies(at, place, THICKNESS);
    let frame = studio.take(&marked, &pose, Exposure::SHARP, 6).unwrap();
    let nozzle = camera().project(pose.apply(Point3::new(80.0, 40.0, 0.0))).unwrap();
    let bytes = frame.to_grey8();
    let values = bytes.iter().enumerate().map(|(i, &grey)| {
        #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
        let px = ImagePoint::new((i % 640) as f64, (i / 640) as f64);
        if (px - nozzle).norm() < 45.0 { 70 } else { grey }
    });
    let covered =
        Frame::new(0, Stamp::START, Size::new(640, 480), Pixels::Grey8(values.collect())).unwrap();
    let corners = board_observation::observe(&marked, "", &covered).unwrap().corners;
    assert!((30..54).contains(&corners.len()), "{}", corners.len());
    let touch = Touch { position: at, ..touch(0.0) };
    let found = find(&calibration(), &gauge(), &marked, &corners, &touch).unwrap();
    assert!((found.along_mm - 20.0).hypot(found.across_mm - RIGHT) < 0.05, "{found:?}");
    // Behind the gauge is behind it, and not the other way round.
    let behind = OffsetGauge { ahead: Vector2::new(0.0, 1.0), ..gauge() };
    let none = find(&calibration(), &behind, &marked, &corners, &touch).unwrap_err();
    assert!(none.to_string().contains("of the gauge (20.0 mm behind its middle)"), "{none}");
}

#[test]
fn a_camera_that_has_risen_with_the_robot_sees_the_same() {
    let risen = Touch { robot_z: Some(Mm::constant(10.0)), ..touch(0.0) };
    let found = found(&seen([0.0; 2], THICKNESS - 10.0, 1), &risen);
    assert!((found.along_mm - AHEAD).abs() < 0.05, "{found:?}");
}

#[test]
fn a_height_that_is_not_known_moves_the_middle_of_a_gauge_seen_aslant() {
    let sighting = seen([0.0; 2], THICKNESS, 2);
    let gauge = OffsetGauge { surface_height_sigma: Mm::constant(2.0), ..gauge() };
    let found = find(&calibration(), &gauge, &board(), &sighting.corners, &touch(0.0)).unwrap();
    let eye = bed().apply_inverse(Point3::origin());
    let expected = 2.0 * ((MIDDLE[1] - eye.y) / (eye.z - SURFACE)).abs();
    assert!((found.parts.height.get() / expected - 1.0).abs() < 0.01, "{found:?} {expected}");
}

#[test]
fn the_nozzle_is_beyond_the_right_end_of_a_horizontal_gauge() {
    // Straight down: the bed's y runs up in the image.
    let bed =
        Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), Vector3::new(0.0, 0.0, 430.0));
    let calibration = Calibration::Full {
        image_size_px: SIZE,
        camera: camera(),
        bed,
        robot_z: Mm::ZERO,
        quality: None,
    };
    let gauge = OffsetGauge {
        middle: camera().project(bed.apply(Point3::new(-30.0, 0.0, SURFACE))).unwrap(),
        ahead: Vector2::new(1.0, 0.0),
        right: Vector2::new(0.0, 1.0),
        ..gauge()
    };
    // 9, 2.5 is five squares right of the board's middle.
    let place = |x: f64, y: f64| bed.apply(Point3::new(x, y, THICKNESS)).coords;
    let axes = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let pose = Pose::from_parts(bed.rotation() * axes, place(65.0 - 180.0, -1.2 + 50.0));
    let studio = BoardStudio::new(&camera(), SIZE);
    let frame = studio.take(&board(), &pose, Exposure::SHARP, 3).unwrap();
    let corners = board_observation::observe(&board(), "", &frame).unwrap().corners;
    let touch = Touch { position: [9.0, 2.5], ..touch(0.0) };
    let found = find(&calibration, &gauge, &board(), &corners, &touch).unwrap();
    let off = (found.along_mm - 95.0).hypot(found.across_mm - 1.2);
    assert!(off < 0.05 && found.parts.calibration.is_none(), "{found:?}");
}

#[test]
fn what_has_no_one_answer_is_refused() {
    // Its opposite corners have one colour.
    let even = Board::new(8, 6, Mm::constant(20.0)).unwrap();
    let place = [MIDDLE[0] + RIGHT, MIDDLE[1] + AHEAD];
    let studio = BoardStudio::new(&camera(), SIZE);
    let pose = lies(AT, place, THICKNESS);
    let frame = studio.take(&even, &pose, Exposure::SHARP, 4).unwrap();
    let corners = board_observation::observe(&even, "", &frame).unwrap().corners;
    let asked = |gauge: &OffsetGauge, at| {
        let touch = Touch { position: at, ..touch(0.5) };
        find(&calibration(), gauge, &even, &corners, &touch).map(|found| found.along_mm)
    };
    // The board's middle, and a little beside it, is ahead of the gauge's either way.
    let both = asked(&gauge(), [3.5, 2.0]);
    assert!(matches!(both, Err(NozzleOffsetError::Ambiguous { .. })), "{both:?}");
    let behind = OffsetGauge { ahead: Vector2::new(0.0, 1.0), ..gauge() };
    let none = asked(&behind, [3.5, 2.0]);
    assert!(matches!(none, Err(NozzleOffsetError::Behind { .. })), "{none:?}");
    let square = Board::new(6, 6, Mm::constant(20.0)).unwrap();
    let few = &corners[..36];
    let refused = find(&calibration(), &gauge(), &square, few, &touch(0.5));
    assert_eq!(refused.unwrap_err(), NozzleOffsetError::Square(6));
    let single = Calibration::Scale { mm_per_px: 0.1, sigma: None };
    let refused = find(&single, &gauge(), &board(), &corners, &touch(0.5));
    assert_eq!(refused.unwrap_err(), NozzleOffsetError::NoCamera);
}
