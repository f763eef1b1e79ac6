use super::*;
use nalgebra::Vector3;

use crate::calibration::lens::Lens;
use crate::calibration::synthetic::{self, SIZE, TRUTH, board, poses};
use crate::calibration::{CalibrationQuality, relative_sigma, solve};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

const NOISE_PX: f64 = 0.1;
const THICKNESS: Mm = Mm::constant(4.0);
const SEEDS: u64 = 400;

fn later() -> Pose {
    Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(-70.0, -60.0, 400.0))
}

/// The images of a calibration, and a bed from one of them, from one that was
/// taken later, and from that one with two more beside it.
fn solved(seed: u64) -> (Solution, [OnBed; 3]) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let noise = Normal::new(0.0, NOISE_PX).unwrap();
    let mut off = || noise.sample(&mut random);
    let sightings: Vec<_> =
        poses().iter().map(|pose| synthetic::sighting("", pose, &mut off)).collect();
    let solution = solve::solve_with(&board(), &sightings, Lens::Five).unwrap();
    let several =
        BoardPlacement { pose: later(), others: vec![[10.0, 14.0, 0.3], [-20.0, 5.0, -0.4]] };
    let mut seen = |i| board().correspondences(&synthetic::seen(&several.of_board(i), &mut off));
    let (first, second, third) = (seen(0), seen(1), seen(2));
    let own = board().correspondences(&sightings[3].corners);
    let beds = [vec![own], vec![first.clone()], vec![first, second, third]]
        .map(|boards| OnBed::fit(&solution.model, boards).unwrap());
    (solution, beds)
}

fn covariance(solution: &Solution, on_bed: &OnBed) -> CalibrationCovariance {
    CalibrationCovariance::of(&board(), solution, on_bed, THICKNESS).unwrap()
}

/// Beads here and there, and the height of their surface.
fn beads() -> [([ImagePoint; 2], Mm); 3] {
    let at = ImagePoint::new;
    [
        ([at(240.0, 270.0), at(480.0, 270.0)], Mm::ZERO),
        ([at(20.0, 40.0), at(200.0, 60.0)], Mm::ZERO),
        ([at(600.0, 200.0), at(590.0, 500.0)], Mm::constant(20.0)),
    ]
}

#[test]
#[expect(clippy::cast_precision_loss, reason = "some seeds")]
fn widths_vary_over_many_calibrations_as_each_of_them_predicts() {
    let runs: Vec<[CalibrationCovariance; 3]> = (0..SEEDS)
        .into_par_iter()
        .map(|seed| {
            let (solution, beds) = solved(seed);
            beds.map(|bed| covariance(&solution, &bed))
        })
        .collect();
    for which in 0..3 {
        for (ends, height) in beads() {
            let widths = runs.iter().map(|run| run[which].width_mm(ends, height).unwrap());
            let (widths, sigmas): (Vec<f64>, Vec<f64>) = widths.unzip();
            let mean = widths.iter().sum::<f64>() / SEEDS as f64;
            let squares = widths.iter().map(|width| (width - mean).powi(2)).sum::<f64>();
            let spread = (squares / (SEEDS - 1) as f64).sqrt();
            let predicted = (sigmas.iter().map(|s| s * s).sum::<f64>() / SEEDS as f64).sqrt();
            let ratio = spread / predicted;
            assert!((0.9..1.1).contains(&ratio), "bed {which}, {ends:?}: {ratio}");
        }
    }
}

#[test]
fn the_joint_covariance_says_what_each_width_does() {
    let (solution, beds) = solved(6);
    for bed in &beds {
        let covariance = covariance(&solution, bed);
        let quality = CalibrationQuality {
            reprojection_rms_px: solution.rms_px,
            width_relative_sigma: None,
            seen_px: None,
            heights_mm: None,
            uncertainty: Some(covariance.uncertainty()),
        };
        let calibration = Calibration::Full {
            image_size_px: SIZE,
            camera: *solution.camera(),
            bed: bed.bed(THICKNESS),
            robot_z: Mm::ZERO,
            quality: Some(quality),
        };
        for (ends, height) in beads() {
            let (width, sigma) = covariance.width_mm(ends, height).unwrap();
            let fraction = calibration.surface(height, None).width_relative_sigma_of(ends).unwrap();
            assert!((fraction * width / sigma - 1.0).abs() < 1e-4, "{fraction} {sigma} {width}");
        }
    }
}

#[test]
fn three_boards_on_the_bed_determine_its_plane_better_than_one() {
    let (solution, [_, one, three]) = solved(5);
    let [one, three] = [one, three].map(|bed| covariance(&solution, &bed));
    let (ends, height) = beads()[2];
    let [one, three] = [one, three].map(|c| c.width_mm(ends, height).unwrap().1);
    assert!(three < one, "{three} {one}");
}

#[test]
fn the_share_is_no_smaller_than_that_of_a_bead_in_the_middle() {
    let (solution, [_, later, _]) = solved(2);
    let covariance = covariance(&solution, &later);
    let fraction = relative_sigma::where_seen(&covariance).unwrap();
    let (ends, height) = beads()[0];
    let (width, sigma) = covariance.width_mm(ends, height).unwrap();
    assert!(fraction >= sigma / width && fraction < 0.002, "{fraction}");
    let (mm_per_px, sigma) = covariance.mm_per_px(THICKNESS).unwrap();
    let calibration = Calibration::Full {
        image_size_px: SIZE,
        camera: *solution.camera(),
        bed: later.bed(THICKNESS),
        robot_z: Mm::ZERO,
        quality: None,
    };
    let scale = scale::single_scale(&calibration, THICKNESS).unwrap();
    assert_eq!(mm_per_px, scale.mm_per_px);
    assert!(sigma > 0.0 && sigma / mm_per_px < fraction);
}

#[test]
fn more_noise_leaves_more_and_boards_all_alike_do_not_settle_the_camera() {
    let (solution, [_, later, _]) = solved(3);
    let fraction = relative_sigma::where_seen(&covariance(&solution, &later)).unwrap();
    let noisy = Solution { noise_px: 2.0 * solution.noise_px, ..solution.clone() };
    let doubled = relative_sigma::where_seen(&covariance(&noisy, &later)).unwrap();
    assert!((doubled / fraction - 2.0).abs() < 1e-9);
    let straight = Pose::new(Vector3::zeros(), Vector3::new(-80.0, -50.0, 420.0));
    let mut alike = solution;
    alike.model.camera = TRUTH;
    for view in &mut alike.views {
        view.pose = straight;
    }
    assert!(CalibrationCovariance::of(&board(), &alike, &later, THICKNESS).is_none());
}

#[test]
fn another_image_reduces_the_uncertainty() {
    let (solution, [_, later, _]) = solved(4);
    let covariance = covariance(&solution, &later);
    let pose = poses()[7];
    let corners = board().correspondences(&synthetic::seen(&pose, || 0.0));
    let more = covariance.with_another(&pose, &corners).unwrap();
    for (ends, height) in beads() {
        let [with, without] = [&more, &covariance].map(|c| c.width_mm(ends, height).unwrap().1);
        assert!(with < without && with > 0.5 * without, "{with} {without}");
    }
}
