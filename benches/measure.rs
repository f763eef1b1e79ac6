//! How long a width takes, beside the paper's way on the same 720x540 frame.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use std::hint::black_box;

use divan::Bencher;
use truebead::calib::{Calibration, SurfaceMap};
use truebead::frame::Frame;
use truebead::geometry::Roi;
use truebead::sim::picture::Picture;
use truebead::sim::render::Renderer;
use truebead::time::Stamp;
use truebead::units::Mm;
use truebead::vision::{Axis, Gauge, Measurer, Method, Polarity};

fn main() {
    divan::main();
}

fn gauge(method: Method) -> Gauge {
    Gauge {
        roi: Roi { x: 40, y: 20, width: 640, height: 500 },
        axis: Axis::Vertical,
        polarity: Polarity::Bright,
        width_range: (Mm::constant(20.0), Mm::constant(60.0)),
        method,
        calipers: 64,
        min_contrast_grey: 6.0,
    }
}

fn frame() -> Frame {
    let calibration = Calibration::Scale { mm_per_px: 0.126_582 };
    let gauge = gauge(Method::Caliper);
    let renderer =
        Renderer::new(calibration, Mm::ZERO, gauge, Picture::default(), 1).expect("a sound cell");
    let bead = |_: f64| Some((-21.0, 21.0));
    renderer.render(0, Stamp::START, None, &bead).expect("a picture").frame
}

#[divan::bench(args = [Method::Caliper, Method::EdgeLines])]
fn width(bencher: Bencher<'_, '_>, method: Method) {
    let frame = frame();
    let surface = SurfaceMap::from_scale(0.126_582);
    let mut measurer = Measurer::new(gauge(method), None);
    bencher.bench_local(|| black_box(measurer.measure(black_box(&frame), &surface)));
}

#[divan::bench]
fn copy_of_the_frame(bencher: Bencher<'_, '_>) {
    let frame = frame();
    let mut copy = frame.to_grey8().into_owned();
    bencher.bench_local(|| copy.copy_from_slice(&black_box(&frame).to_grey8()));
}
