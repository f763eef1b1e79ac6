//! How long one step of the screw's control takes: predict over the delay and
//! decide. A feed that changed at every step, and a plug that is short, so that
//! the delay is long.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use divan::{Bencher, black_box};
use truebead::core::{Mm, Span, Stamp};
use truebead::extruder::screw::control::{Scheme, ScrewSettings};
use truebead::extruder::screw::feedback::PlugSetpoint;
use truebead::extruder::screw::{
    FillFeedback, PiecewiseExponential, Screw, ScrewControl, ScrewDesign, SpeedPulsation,
};

const A: SpeedPulsation =
    SpeedPulsation { relative_amplitude: 0.1, rad_per_s: 3.5, phase_rad: 0.0 };
/// Share that is fed for as long as the delay lasts.
const SHARES: [f64; 2] = [0.3, 0.5];

fn control(pulsation: SpeedPulsation, scheme: Scheme, period: Span) -> ScrewControl {
    let screw: Screw = ScrewDesign::DIAGNE_2015.screw(pulsation).expect("sound");
    let setpoint = PlugSetpoint { plug: Mm::constant(160.0), max_fill: 0.9 };
    let law = PiecewiseExponential::new(&screw, setpoint, 36.0).expect("sound");
    let law = FillFeedback::Exponential(law);
    let settings = ScrewSettings { screw, feedback: law, scheme, period, initial_fill: 0.2 };
    ScrewControl::new(&settings).expect("sound")
}

/// Steps of a control whose feed is changed after every step.
fn step(bencher: Bencher<'_, '_>, mut control: ScrewControl, period: Span) {
    let plug = Mm::constant(60.0);
    let mut now = Stamp::START;
    let mut tick = 0_usize;
    let mut once = move || {
        now = now + period;
        tick += 1;
        let decided = control.step(now, plug).expect("within the screw");
        control.applied(now, SHARES[tick % 2]).expect("a share");
        decided
    };
    for _ in 0..4_000 {
        black_box(once());
    }
    bencher.bench_local(once);
}

#[divan::bench]
fn exact_at_200_hz(bencher: Bencher<'_, '_>) {
    let period = Span::from_millis(5);
    step(bencher, control(A, Scheme::Exact, period), period);
}

#[divan::bench]
fn exact_at_1_khz(bencher: Bencher<'_, '_>) {
    let period = Span::from_millis(1);
    step(bencher, control(A, Scheme::Exact, period), period);
}

#[divan::bench]
fn exact_and_steady_at_200_hz(bencher: Bencher<'_, '_>) {
    let period = Span::from_millis(5);
    step(bencher, control(SpeedPulsation::default(), Scheme::Exact, period), period);
}

#[divan::bench]
fn as_the_paper_at_200_hz(bencher: Bencher<'_, '_>) {
    let period = Span::from_millis(5);
    step(bencher, control(A, Scheme::Paper, period), period);
}

#[divan::bench]
fn as_the_paper_at_1_khz(bencher: Bencher<'_, '_>) {
    let period = Span::from_millis(1);
    step(bencher, control(A, Scheme::Paper, period), period);
}

fn main() {
    divan::main();
}
