//! How long a picture of a board takes, from its pixels to its corners, and how long
//! the calibration that follows.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use std::hint::black_box;

use divan::Bencher;
use nalgebra::{Rotation3, Vector3};
use truebead::calibration::board::Board;
use truebead::calibration::board_observation::{self, BoardObservation};
use truebead::calibration::covariance::CalibrationCovariance;
use truebead::calibration::plane::OnBed;
use truebead::calibration::solve::{self, Solution};
use truebead::calibration::{Camera, next_view, width_map};
use truebead::core::{Frame, Mm, Pose};
use truebead::sim::board_studio::{BoardStudio, Exposure};

const SIZE: [u32; 2] = [640, 480];
const VIEWS: u32 = 13;

fn board() -> Board {
    Board::new(9, 6, Mm::constant(25.0)).expect("a sound board")
}

fn frames() -> Vec<Frame> {
    let camera =
        Camera::pinhole([900.0, 901.0], [322.0, 236.0]).with_five([-0.15, 0.08, 4e-4, -3e-4, 0.0]);
    let studio = BoardStudio::new(&camera, SIZE);
    let pose = |i: u32| {
        let turn = f64::from(i) * 0.7;
        let tilt = 0.25 + 0.04 * f64::from(i % 10);
        let rotation = Rotation3::new(Vector3::new(tilt * turn.cos(), tilt * turn.sin(), 0.05));
        let middle = Vector3::new(40.0 * turn.sin(), 30.0 * turn.cos(), 560.0);
        Pose::from_parts(rotation, middle - rotation * Vector3::new(100.0, 62.5, 0.0))
    };
    (0..VIEWS)
        .map(|i| {
            studio.take(&board(), &pose(i), Exposure::SHARP, i.into()).expect("a sound picture")
        })
        .collect()
}

fn sightings() -> Vec<BoardObservation> {
    frames()
        .iter()
        .map(|frame| board_observation::observe(&board(), "", frame).expect("a board"))
        .collect()
}

fn solution() -> Solution {
    solve::solve(&board(), &sightings()).expect("a camera")
}

#[divan::bench]
fn find_and_refine(bencher: Bencher<'_, '_>) {
    let (board, frames) = (board(), frames());
    let mut next = 0;
    bencher.bench_local(|| {
        next = (next + 1) % frames.len();
        board_observation::observe(&board, "", black_box(&frames[next])).expect("a board")
    });
}

#[divan::bench]
fn solve_thirteen_views(bencher: Bencher<'_, '_>) {
    let (board, sightings) = (board(), sightings());
    bencher.bench_local(|| solve::solve(&board, black_box(&sightings)).expect("a camera"));
}

fn covariance(solution: &Solution) -> CalibrationCovariance {
    let on_bed = OnBed::fit(&solution.model, vec![solution.corners(&board(), 0)]).expect("a bed");
    CalibrationCovariance::of(&board(), solution, &on_bed, Mm::ZERO).expect("a settled camera")
}

#[divan::bench]
fn width_map(bencher: Bencher<'_, '_>) {
    let covariance = covariance(&solution());
    bencher.bench_local(|| width_map::WidthMap::of(black_box(&covariance), 42.0, Mm::ZERO));
}

#[divan::bench]
fn next_picture(bencher: Bencher<'_, '_>) {
    let (board, solution) = (board(), solution());
    let covariance = covariance(&solution);
    let heights = [Mm::ZERO, Mm::constant(20.0)];
    bencher
        .bench_local(|| next_view::best(&board, &solution, black_box(&covariance), 80.0, &heights));
}

fn main() {
    divan::main();
}
