use super::*;
use crate::calibration::Calibration;
use crate::calibration::board::observe_all;
use crate::calibration::camera::NUMBERS;
use crate::calibration::plane::bed_from_board;
use crate::calibration::synthetic::{self, SIZE, TRUTH, board, poses};
use crate::calibration::uncertainty::ROWS;
use crate::core::Mm;
use nalgebra::Point3;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// What the true camera sees, with noise.
fn sightings(noise_px: f64) -> Vec<BoardObservation> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let noise = Normal::new(0.0, noise_px).unwrap();
    let mut off = || noise.sample(&mut random);
    let named = poses().into_iter().enumerate();
    named.map(|(i, pose)| synthetic::sighting(&i.to_string(), &pose, &mut off)).collect()
}

#[test]
fn exact_corners_give_the_true_camera_and_poses() {
    let solution = solve_with(&board(), &sightings(0.0), Lens::Five).unwrap();
    assert!(solution.rms_px < 1e-9, "rms {}", solution.rms_px);
    for (found, truth) in solution.camera().numbers().iter().zip(TRUTH.numbers()) {
        assert!((found - truth).abs() < 1e-6, "{:?}", solution.camera());
    }
    for (view, truth) in solution.views.iter().zip(poses()) {
        assert!((view.pose.translation_mm() - truth.translation_mm()).norm() < 1e-6);
        assert!(view.max_px < 1e-8);
    }
}

#[test]
fn the_error_and_the_standard_deviations_are_those_of_the_noise() {
    let noise_px = 0.1;
    let solution = solve_with(&board(), &sightings(noise_px), Lens::Five).unwrap();
    assert!((solution.noise_px / noise_px - 1.0).abs() < 0.06, "{}", solution.noise_px);
    let sigma = solution.sigma.unwrap();
    let pairs = solution.camera().numbers().into_iter().zip(TRUTH.numbers());
    for (number, (found, truth)) in pairs.enumerate().take(9) {
        let miss = (found - truth).abs() / sigma[number];
        assert!(miss < 3.5, "{} is off by {miss} standard deviations", SHARED_NAMES[number]);
    }
    // What is not fitted is known.
    assert_eq!(sigma[9..], [0.0; 5]);
}

#[test]
fn a_lens_and_a_bend_that_are_there_are_found_and_none_is_made_up() {
    let flat = solve(&board(), &sightings(0.1)).unwrap();
    assert!(!flat.free.bend);
    assert!(flat.free.lens >= Some(Lens::Four), "{:?}", flat.free);
    let bend_mm = [0.0, 0.4];
    let model = CameraModel { camera: TRUTH, bend_mm };
    let mut bent = sightings(0.0);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
    let noise = Normal::new(0.0, 0.1).unwrap();
    for (sighting, pose) in bent.iter_mut().zip(poses()) {
        let corners = board().correspondences(&sighting.corners);
        let positions: Vec<_> = corners
            .iter()
            .map(|corner| {
                let px = TRUTH.project(pose.apply(model.on_board(corner))).unwrap();
                px + nalgebra::Vector2::new(noise.sample(&mut random), noise.sample(&mut random))
            })
            .collect();
        sighting.corners = observe_all(&positions);
    }
    let found = solve(&board(), &bent).unwrap();
    assert!(found.free.bend, "{:?}", found.trials);
    let (sigma, [rows, columns]) = (found.sigma.unwrap(), found.model.bend_mm);
    assert!(rows.abs() < 4.0 * sigma[NUMBERS], "{rows}");
    assert!((columns - 0.4).abs() < 4.0 * sigma[NUMBERS + 1], "{columns}");
}

/// The others fix the camera, and the pose of the one that is left out is fitted.
#[test]
fn the_cross_validation_error_is_that_of_really_leaving_images_out() {
    let all = sightings(0.1);
    let solution = solve_with(&board(), &all, Lens::Five).unwrap();
    let (mut squares, mut corners) = (0.0, 0.0);
    for left_out in 0..all.len() {
        let mut others = all.clone();
        let one = others.remove(left_out);
        let model = solve_with(&board(), &others, Lens::Five).unwrap().model;
        let seen = board().correspondences(&one.corners);
        let pose = pose(&model, &seen).unwrap();
        squares += model.sum_of_squares_px2(&BoardPlacement::of_one(pose), &[seen]).unwrap();
        corners += 54.0;
    }
    let left_out = f64::sqrt(squares / corners);
    let reported = solution.cross_validation_px.unwrap();
    assert!((reported / left_out - 1.0).abs() < 0.002, "{reported} {left_out}");
    assert!(reported > solution.rms_px);
}

#[test]
fn a_width_is_right_at_any_height_with_the_full_calibration() {
    let solution = solve(&board(), &sightings(0.0)).unwrap();
    let thickness = Mm::constant(4.0);
    let bed = bed_from_board(&solution.views[2].pose, thickness);
    let true_bed = bed_from_board(&poses()[2], thickness);
    let calibration = Calibration::Full {
        image_size_px: SIZE,
        camera: *solution.camera(),
        bed,
        robot_z: Mm::ZERO,
        quality: None,
    };
    for height in [0.0, 4.0, 20.0, 45.0] {
        let map = calibration.surface(Mm::constant(height), None);
        // A bead of 42 mm on the true bed, at this height.
        let edge = |x: f64| {
            let px = TRUTH.project(true_bed.apply(Point3::new(x, -40.0, height))).unwrap();
            map.to_mm(px).unwrap()
        };
        let width = (edge(100.0) - edge(58.0)).norm();
        assert!((width - 42.0).abs() < 1e-6, "{width} mm at {height} mm");
    }
}

#[test]
fn a_pose_alone_is_found_with_a_known_camera() {
    let model = CameraModel { camera: TRUTH, bend_mm: [0.0; 2] };
    let found = pose(&model, &board().correspondences(&sightings(0.0)[3].corners)).unwrap();
    assert!((found.translation_mm() - poses()[3].translation_mm()).norm() < 1e-6);
    assert!((found.rotation_rad() - poses()[3].rotation_rad()).norm() < 1e-8);
}

#[test]
fn too_few_images_are_no_calibration() {
    let few = solve(&board(), &sightings(0.0)[..2]).unwrap_err();
    assert_eq!(few, SolveError::TooFew { found: 2 });
}

#[test]
fn the_camera_parameters_have_the_same_names_in_both_lists() {
    assert_eq!(SHARED_NAMES[..NUMBERS], ROWS[..NUMBERS]);
}
