//! Whether calibrations from disjoint halves of real images differ as much as they
//! predict: the corners' true errors, the real lens and the real board are in that.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::path::Path;

use nalgebra::{Point2, Vector2};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use truebead::calibration::board::Board;
use truebead::calibration::board_observation::{self, BoardObservation};
use truebead::calibration::covariance::CalibrationCovariance;
use truebead::calibration::equations::Correspondence;
use truebead::calibration::plane::OnBed;
use truebead::calibration::{Calibration, CalibrationQuality, SurfaceMap, solve};
use truebead::core::{Channel, Mm, Stamp};
use truebead::io::image_file;

/// OpenCV's sample images by both cameras of a pair.
const SETS: [&str; 2] = ["chessboard", "chessboard_right"];
/// Splits of both sets together; every image is left out of its halves in turn.
const SPLITS: usize = 200;
/// Cells along each side of the board in the image that is in neither half.
const GRID: u32 = 5;
/// Half of the length whose size is compared, along the image's rows \[px\].
const HALF_PX: f64 = 50.0;
/// RMS of the difference over what was predicted.
const RATIO: std::ops::RangeInclusive<f64> = 0.6..=1.6;

fn board() -> Board {
    Board::new(9, 6, Mm::constant(25.0)).unwrap()
}

/// The boards of a set, if it is there.
fn sightings(set: &str) -> Option<Vec<BoardObservation>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(set);
    let Ok(files) = folder.read_dir() else {
        eprintln!("skipped: the pictures of the board are not at {}", folder.display());
        return None;
    };
    let mut paths: Vec<_> = files.map(|file| file.unwrap().path()).collect();
    paths.sort();
    let look = |path: &std::path::PathBuf| {
        let frame = image_file::read(path, Channel::Grey, 0, Stamp::START).unwrap();
        board_observation::observe(&board(), &path.display().to_string(), &frame).unwrap()
    };
    Some(paths.par_iter().map(look).collect())
}

/// The plane of a board before the camera of one half of the images.
struct Face {
    surface: SurfaceMap,
    /// How many times larger its standard deviations are than those of independent corners.
    inflation: f64,
}

fn face(half: &[BoardObservation], corners: &[Correspondence]) -> Face {
    let solution = solve::solve(&board(), half).unwrap();
    let on_bed = OnBed::fit(&solution.model, vec![corners.to_vec()]).unwrap();
    let covariance = CalibrationCovariance::of(&board(), &solution, &on_bed, Mm::ZERO).unwrap();
    let quality = CalibrationQuality {
        reprojection_rms_px: solution.rms_px,
        width_relative_sigma: None,
        seen_px: None,
        heights_mm: None,
        // Both halves see the same corners of this image: their noise is no difference.
        uncertainty: Some(covariance.uncertainty_of_camera()),
    };
    let calibration = Calibration::Full {
        image_size_px: solution.image_size_px,
        camera: *solution.camera(),
        bed: on_bed.bed(Mm::ZERO),
        robot_z: Mm::ZERO,
        quality: Some(quality),
    };
    Face { surface: calibration.surface(Mm::ZERO, None), inflation: solution.design_effect.sqrt() }
}

/// Ends of 100 px along x about the middle of each cell of the board.
fn lengths(sighting: &BoardObservation) -> Vec<[Point2<f64>; 2]> {
    let corner = |column: usize, row: usize| sighting.corners[row * 9 + column].px;
    let part = |i: u32| (f64::from(i) + 0.5) / f64::from(GRID);
    let middle = |i: u32| {
        // Between the four corners around the position, as if the square were a parallelogram.
        let (x, y) = (8.0 * part(i % GRID), 5.0 * part(i / GRID));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small")]
        let (column, row) = ((x as usize).min(7), (y as usize).min(4));
        let at = corner(column, row);
        let (right, down) = (corner(column + 1, row) - at, corner(column, row + 1) - at);
        at + right * x.fract() + down * y.fract()
    };
    let half = Vector2::new(HALF_PX, 0.0);
    (0..GRID * GRID).map(middle).map(|at| [at - half, at + half]).collect()
}

/// A length before one camera \[mm\].
struct Length {
    mm: f64,
    sigma: f64,
    /// If every corner were off by itself.
    independent: f64,
}

/// The result of one split at each position: difference over its predicted standard deviation,
/// and both as a fraction of the length.
struct Compared {
    ratio: f64,
    /// The same if every corner were off by itself.
    if_independent: f64,
    difference: f64,
    sigma: f64,
}

fn split(all: &[BoardObservation], left_out: usize, seed: u64) -> Vec<Compared> {
    let mut others: Vec<BoardObservation> = all.to_vec();
    let one = others.remove(left_out);
    others.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
    let corners = board().correspondences(&one.corners);
    let (first, second) = others.split_at(others.len() / 2);
    let faces = [first, second].map(|half| face(half, &corners));
    let compare = |ends: [Point2<f64>; 2]| {
        let [a, b] = [&faces[0], &faces[1]].map(|face| {
            let place = ends.map(|px| face.surface.to_mm(px).unwrap());
            let length = (place[1] - place[0]).norm();
            let sigma = face.surface.width_relative_sigma_of(ends).unwrap() * length;
            Length { mm: length, sigma, independent: sigma / face.inflation }
        });
        let (difference, sigma) = (a.mm - b.mm, a.sigma.hypot(b.sigma));
        Compared {
            ratio: difference / sigma,
            if_independent: difference / a.independent.hypot(b.independent),
            difference: difference / a.mm,
            sigma: sigma / a.mm,
        }
    };
    lengths(&one).into_iter().map(compare).collect()
}

#[expect(clippy::cast_precision_loss, reason = "a count of places")]
fn rms(compared: &[Compared], value: fn(&Compared) -> f64) -> f64 {
    let squares: f64 = compared.iter().map(|one| value(one).powi(2)).sum();
    (squares / compared.len() as f64).sqrt()
}

#[test]
fn halves_of_real_images_differ_as_much_as_they_predict() {
    let sets: Option<Vec<Vec<BoardObservation>>> = SETS.iter().map(|set| sightings(set)).collect();
    let Some(sets) = sets else { return };
    let compared: Vec<(usize, Vec<Compared>)> = (0..SPLITS)
        .into_par_iter()
        .map(|number| {
            let (set, turn) = (number % SETS.len(), number / SETS.len());
            let left_out = turn % sets[set].len();
            (set, split(&sets[set], left_out, number as u64))
        })
        .collect();
    let mut all = Vec::new();
    for (number, name) in SETS.iter().enumerate() {
        let of_set = compared.iter().filter(|(set, _)| *set == number).flat_map(|(_, c)| c);
        let of_set: Vec<Compared> = of_set.map(|c| Compared { ..*c }).collect();
        report(name, &of_set);
        all.extend(of_set);
    }
    let ratio = report("both", &all);
    assert!(RATIO.contains(&ratio), "{ratio}");
}

fn report(name: &str, compared: &[Compared]) -> f64 {
    let ratio = rms(compared, |one| one.ratio);
    println!(
        "{name}: RMS of difference over predicted sigma {ratio:.2} ({:.2} if corners were \
         independent); difference {:.3} %, sigma \
         {:.3} % of the length (RMS)",
        rms(compared, |one| one.if_independent),
        100.0 * rms(compared, |one| one.difference),
        100.0 * rms(compared, |one| one.sigma),
    );
    ratio
}
