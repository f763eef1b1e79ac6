//! How long one step of control by distance takes: a report, a width and a setpoint, and the test
//! whether the width answers. A setpoint every 50 ms leaves a thousand times as long.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use divan::Bencher;
use truebead::core::{Mm, MmPerS, Span, Stamp};
use truebead::width_control::bead_noise::BeadRoughness;
use truebead::width_control::controller::BeadReport;
use truebead::width_control::distance::{DistanceController, DistanceSettings, WidthReading};
use truebead::width_control::response::{ResponseSettings, ResponseTest};

const FRAME_S: f64 = 0.02;

const OFFSET: Mm = Mm::constant(88.4);
const GAUGE: Mm = Mm::constant(12.7);
const START_SPEED: MmPerS = MmPerS::constant(112.5);
const ROUGHNESS: BeadRoughness = BeadRoughness { ratio: 0.0025, length_mm: 5.0 };

/// Control that is under way on a bead whose flow pulsates.
struct Running {
    controller: DistanceController,
    response: ResponseTest,
    count: u32,
}

impl Running {
    fn new() -> Self {
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
        });
        let response = ResponseTest::new(ResponseSettings {
            offset: OFFSET,
            gauge: GAUGE,
            reference_speed: START_SPEED,
            roughness: ROUGHNESS,
        });
        let mut running = Self { controller, response, count: 0 };
        for _ in 0..1500 {
            running.step();
        }
        running
    }

    fn step(&mut self) -> Option<MmPerS> {
        self.count += 1;
        let at = f64::from(self.count) * FRAME_S;
        let speed = 80.0 + 2.0 * (0.7 * at).sin();
        let path = Mm::new(80.0 * at - 2.857 * (0.7 * at).cos()).expect("finite");
        let now = Stamp::from_secs(at);
        let speed = MmPerS::new(speed).expect("finite");
        self.controller.reported(now, path, speed, 1.0);
        self.response.reported(&BeadReport { at: now, path, speed, flow_ratio: 1.0 });
        let width = Mm::new(42.0 + 0.8 * (2.1 * at).sin()).expect("finite");
        let reading = WidthReading { width, sigma: Mm::constant(0.36) };
        let target = Mm::constant(42.0);
        let _ = self.controller.measured(path, reading);
        let _ = self.response.measured(path, reading, target);
        self.controller.speed(target, now, Span::from_millis(50))
    }
}

// One step is too short for the clock alone: a sample is the mean of many.
#[divan::bench(sample_size = 200)]
fn step(bencher: Bencher<'_, '_>) {
    let mut running = Running::new();
    bencher.bench_local(|| running.step());
}

fn main() {
    divan::main();
}
