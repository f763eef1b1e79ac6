//! How much faster than the clock the closed loop is simulated.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use std::path::Path;
use std::time::Instant;

use divan::Bencher;
use truebead::calibration::Calibration;
use truebead::cell::Cell;
use truebead::cell::file::Purpose;
use truebead::control::{Event, Step};
use truebead::core::{Mm, Stamp};
use truebead::run::runner::NoRecorder;
use truebead::sim::cell::{FrameObservation, Observer, SimCell};

const CELL: &str = include_str!("../cells/barjuei2022.toml");

struct NoObserver;

impl Observer for NoObserver {
    fn step(&mut self, _: Stamp, _: &Event, _: &Step) {}
    fn frame(&mut self, _: &FrameObservation<'_>) {}
}

fn layer() -> f64 {
    let cell = Cell::parse(Path::new("barjuei2022.toml"), CELL, Purpose::Run).expect("sound");
    let run = cell.run.clone().expect("read for a run");
    let scale = Calibration::Scale { mm_per_px: 0.126_582, sigma: None };
    let mut sim = SimCell::new(&cell, &run, scale, NoRecorder).expect("a sound cell");
    sim.layer(Mm::ZERO, &mut NoObserver).duration.secs()
}

#[divan::bench]
fn layer_of_two_metres(bencher: Bencher<'_, '_>) {
    bencher.bench_local(layer);
}

fn main() {
    divan::main();
    #[expect(clippy::disallowed_methods, reason = "a benchmark")]
    let mut ratios: Vec<f64> = (0..21)
        .map(|_| {
            let began = Instant::now();
            let simulated_s = layer();
            simulated_s / began.elapsed().as_secs_f64()
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!("ratio simulated/clock = {:.0}", ratios[ratios.len() / 2]);
}
