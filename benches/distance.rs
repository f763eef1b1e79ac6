//! How long one step of control by distance takes: a report, a width and a setpoint, and the watch
//! over the bead's model. A setpoint every 50 ms leaves a thousand times as long.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use std::collections::VecDeque;
use std::f64::consts::TAU;

use divan::Bencher;
use truebead::core::{Mm, MmPerS, Span, Stamp};
use truebead::sim::hash;
use truebead::width_control::bead_noise::BeadRoughness;
use truebead::width_control::controller::BeadReport;
use truebead::width_control::distance::{DistanceController, DistanceSettings, WidthReading};
use truebead::width_control::watch::{BeadWatch, WatchSettings};

const FRAME_S: f64 = 0.02;

const OFFSET: Mm = Mm::constant(88.4);
const GAUGE: Mm = Mm::constant(12.7);
const START_SPEED: MmPerS = MmPerS::constant(112.5);
const TARGET: Mm = Mm::constant(42.0);
const ROUGHNESS: BeadRoughness = BeadRoughness { ratio: 0.0025, length_mm: 5.0 };
/// Period of the flow's pulsation.
const PERIOD_S: f64 = 3.0;
/// The bead's exponent, and a speed near the one at which it is 42 mm wide: papers.md, "004".
const EXPONENT: f64 = 0.221;
const SPEED_MM_PER_S: f64 = 80.0;

/// Control that is under way, of a robot that has its commanded speed at once.
struct Running {
    controller: DistanceController,
    watch: BeadWatch,
    /// Amplitude of the flow's pulsation.
    amplitude: f64,
    count: u32,
    path_mm: f64,
    speed: f64,
    /// Path and ln w of the bead as far as the camera sees it.
    laid: VecDeque<(f64, f64)>,
}

impl Running {
    fn new(amplitude: f64) -> Self {
        let controller = DistanceController::new(DistanceSettings {
            offset: OFFSET,
            offset_sigma: Mm::constant(8.8),
            gauge: GAUGE,
            reference_speed: START_SPEED,
            exponent: 0.25,
            learns_exponent: true,
            drift_per_root_m: 0.002,
            roughness: ROUGHNESS,
            cancels_pulsation: true,
            screw_pulses: None,
        });
        let watch = BeadWatch::new(WatchSettings {
            offset: OFFSET,
            offset_sigma: Mm::constant(8.84),
            gauge: GAUGE,
            reference_speed: START_SPEED,
            exponent: Some(0.25),
            roughness: ROUGHNESS,
        });
        let (speed, laid) = (START_SPEED.get(), VecDeque::new());
        let mut running =
            Self { controller, watch, amplitude, count: 0, path_mm: 0.0, speed, laid };
        for _ in 0..1500 {
            running.step();
        }
        running
    }

    /// The bead that is laid in this step, and the one that the camera sees.
    fn lay(&mut self, at: f64) -> Option<WidthReading> {
        self.path_mm += self.speed * FRAME_S;
        let [rough, _] = hash::normal_pair(hash::mix(&[u64::from(self.count)]));
        let flow = self.amplitude * (TAU * at / PERIOD_S).sin() + ROUGHNESS.ratio * rough;
        let ln_width = TARGET.get().ln() + flow - EXPONENT * (self.speed / SPEED_MM_PER_S).ln();
        self.laid.push_back((self.path_mm, ln_width));
        let from = self.path_mm - OFFSET.get() - 0.5 * GAUGE.get();
        while self.laid.front().is_some_and(|(path, _)| *path < from) {
            self.laid.pop_front();
        }
        let seen = self.laid.iter().take_while(|(path, _)| *path < from + GAUGE.get());
        let (count, sum) = seen.fold((0.0, 0.0), |(count, sum), (_, one)| (count + 1.0, sum + one));
        let is_under_camera = self.path_mm > OFFSET.get() + GAUGE.get();
        let width = Mm::new((sum / count).exp()).ok().filter(|_| is_under_camera)?;
        Some(WidthReading { width, sigma: Mm::constant(0.003) })
    }

    fn step(&mut self) -> Option<MmPerS> {
        self.count += 1;
        let at = f64::from(self.count) * FRAME_S;
        let reading = self.lay(at);
        let now = Stamp::from_secs(at);
        let (path, speed) = (Mm::new(self.path_mm), MmPerS::new(self.speed));
        let (path, speed) = (path.expect("finite"), speed.expect("finite"));
        self.controller.reported(now, path, speed, 1.0);
        self.watch.reported(&BeadReport { at: now, path, speed, flow_ratio: 1.0 });
        if let Some(reading) = reading {
            let _ = self.controller.measured(path, reading);
            let _ = self.watch.measured(path, reading, TARGET);
        }
        let commanded = self.controller.speed(TARGET, now, Span::from_millis(50));
        if let Some(commanded) = commanded {
            self.speed = commanded.get().clamp(60.0, 150.0);
        }
        commanded
    }
}

// One step is too short for the clock alone: a sample is the mean of many.
#[divan::bench(args = [0.0, 0.02], sample_size = 200)]
fn step(bencher: Bencher<'_, '_>, amplitude: f64) {
    let mut running = Running::new(amplitude);
    bencher.bench_local(|| running.step());
}

fn main() {
    divan::main();
}
