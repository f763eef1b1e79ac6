//! How long a picture of 720 × 100 pixels takes with each disturbance.

#![expect(clippy::expect_used, reason = "a benchmark of sound input")]

use divan::Bencher;
use truebead::calibration::Calibration;
use truebead::core::{Mm, Roi, Stamp, WidthRange};
use truebead::scenario::image::{ImageModel, MotionBlur};
use truebead::sim::render::Renderer;
use truebead::vision::{BeadAxis, Gauge, Polarity};

const USUAL: ImageModel = ImageModel { size_px: [720, 100], ..ImageModel::DEFAULT };

const NAMES: [&str; 9] =
    ["nothing", "shading", "shadow", "older bead", "spots", "grains", "motion", "texture", "curve"];

fn disturbed(name: &str) -> ImageModel {
    let mut picture = USUAL;
    match name {
        "shading" => picture.shading.bead_grey_per_px = 1.0,
        "shadow" => picture.shadow.distance_px = 6.0,
        "older bead" => picture.neighbour.gap_px = 20.0,
        "spots" => picture.spots.covered_fraction = 0.05,
        "grains" => picture.grains.rows_fraction = 0.3,
        "motion" => picture.motion = MotionBlur { length_px: 6.0, direction_deg: 15.0 },
        "texture" => picture.texture.sigma_grey = 2.0,
        "curve" => picture.bend.radius_mm = 120.0,
        _ => {}
    }
    picture
}

#[divan::bench(args = NAMES)]
fn picture(bencher: Bencher<'_, '_>, name: &str) {
    let gauge = Gauge::new(
        Roi { x: 40, y: 10, width: 640, height: 80 },
        BeadAxis::Vertical,
        Polarity::Bright,
        WidthRange { min: Mm::constant(20.0), max: Mm::constant(60.0) },
    );
    let scale = Calibration::Scale { mm_per_px: 0.126_582, sigma: None };
    let renderer = Renderer::new(scale, Mm::ZERO, gauge, disturbed(name), 1).expect("a sound cell");
    let bead = |_: f64| Some((-21.0, 21.0));
    bencher.bench_local(|| renderer.render(0, Stamp::START, None, &bead).expect("a picture"));
}

fn main() {
    divan::main();
}
