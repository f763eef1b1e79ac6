//! How long one cycle of a pressure law takes: its readings of 50 ms and one
//! command. The paper's takes 224 µs at most.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use divan::Bencher;
use truebead::core::{MPa, Rpm, Span, Stamp};
use truebead::extruder::pressure::{InitialState, PressureController};
use truebead::studies::ma2026::TestedController;

const READING: Span = Span::from_millis(20);
const COMMAND: Span = Span::from_millis(50);

/// A law that is under way, with a target that never rests.
struct Cycle {
    law: Box<dyn PressureController>,
    now: Stamp,
    count: u64,
}

impl Cycle {
    fn new(tried: TestedController) -> Self {
        let at = MPa::constant(0.6);
        let running = InitialState { pressure: at, target: at, speed: Rpm::constant(0.6) };
        let law = tried.controller(running).expect("sound settings");
        let mut cycle = Self { law, now: Stamp::START, count: 0 };
        for _ in 0..200 {
            cycle.run();
        }
        cycle
    }

    /// Five readings every two commands.
    fn run(&mut self) -> Rpm {
        self.count += 1;
        for reading in 0..2 + i64::from(self.count.is_multiple_of(2)) {
            let at = self.now + Span::from_ns(reading * READING.ns() / 2);
            let read = if self.count.is_multiple_of(3) { 0.607 } else { 0.594 };
            self.law.measured(at, MPa::constant(read)).expect("in order");
        }
        self.now = self.now + COMMAND;
        let target = if self.count % 80 < 40 { 0.6 } else { 0.7 };
        self.law.step(self.now, MPa::constant(target)).speed
    }
}

// One cycle is too short for the clock alone: a sample is the mean of many.
#[divan::bench(sample_size = 400, args = [TestedController::Pi, TestedController::Vsfc, TestedController::SmithPi, TestedController::Predictive])]
fn cycle(bencher: Bencher<'_, '_>, tried: TestedController) {
    let mut cycle = Cycle::new(tried);
    bencher.bench_local(|| cycle.run());
}

fn main() {
    divan::main();
}
