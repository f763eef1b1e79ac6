//! How long one step of the controller takes that holds the width by distance: a
//! report, a width and a setpoint. A setpoint every 50 ms leaves a thousand times
//! as long.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use divan::Bencher;
use truebead::core::{Mm, MmPerS, Span, Stamp};
use truebead::width_control::distance::{
    BeadRoughness, DistanceController, DistanceSettings, WidthReading,
};

const FRAME_S: f64 = 0.02;

/// A law that is under way on a bead whose flow pulsates.
struct Under {
    law: DistanceController,
    count: u32,
}

impl Under {
    fn new() -> Self {
        let law = DistanceController::new(DistanceSettings {
            offset: Mm::constant(88.4),
            offset_sigma: Mm::constant(8.8),
            gauge: Mm::constant(12.7),
            reference_speed: MmPerS::constant(112.5),
            exponent: 0.25,
            learns_exponent: true,
            drift_per_root_m: 0.002,
            roughness: BeadRoughness { ratio: 0.0025, length_mm: 5.0 },
            cancels_pulsation: true,
        });
        let mut under = Self { law, count: 0 };
        for _ in 0..1500 {
            under.step();
        }
        under
    }

    fn step(&mut self) -> Option<MmPerS> {
        self.count += 1;
        let at = f64::from(self.count) * FRAME_S;
        let speed = 80.0 + 2.0 * (0.7 * at).sin();
        let path = Mm::new(80.0 * at - 2.857 * (0.7 * at).cos()).expect("finite");
        let now = Stamp::from_secs(at);
        self.law.reported(now, path, MmPerS::new(speed).expect("finite"), 1.0);
        let width = Mm::new(42.0 + 0.8 * (2.1 * at).sin()).expect("finite");
        let measured = WidthReading { width, sigma: Mm::constant(0.36) };
        let target = Mm::constant(42.0);
        let _ = self.law.measured(path, measured, target);
        self.law.speed(target, now, Span::from_millis(50))
    }
}

// One step is too short for the clock alone: a sample is the mean of many.
#[divan::bench(sample_size = 200)]
fn step(bencher: Bencher<'_, '_>) {
    let mut under = Under::new();
    bencher.bench_local(|| under.step());
}

fn main() {
    divan::main();
}
