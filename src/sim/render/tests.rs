use nalgebra::Vector3;

use super::*;
use crate::calibration::Camera;
use crate::core::{Pose, Roi, WidthRange};
use crate::vision::Polarity;

mod disturbed;

const PAPER_SCALE: f64 = 0.126_582;

fn gauge(roi: Roi, axis: BeadAxis) -> Gauge {
    let range = WidthRange { min: Mm::constant(1.0), max: Mm::constant(90.0) };
    Gauge::new(roi, axis, Polarity::Bright, range)
}

fn upright() -> Gauge {
    gauge(Roi { x: 40, y: 20, width: 640, height: 500 }, BeadAxis::Vertical)
}

fn scale() -> Calibration {
    Calibration::Scale { mm_per_px: PAPER_SCALE, sigma: None }
}

fn tilted() -> Calibration {
    Calibration::Full {
        image_size_px: [720, 540],
        camera: Camera {
            focal_px: [2500.0, 2490.0],
            centre_px: [352.0, 275.0],
            distortion: [-0.15, 0.4, 1e-3, -5e-4, 0.0, 0.0, 0.0, 0.0],
        },
        bed: Pose::new(Vector3::new(2.95, 0.08, -0.05), Vector3::new(3.0, -7.0, 395.0)),
        robot_z: Mm::constant(100.0),
        quality: None,
    }
}

fn quiet() -> ImageModel {
    ImageModel { noise_grey: 0.0, light_ratio: 1.0, ..ImageModel::default() }
}

fn renderer(calibration: Calibration, gauge: Gauge, image: &ImageModel) -> Renderer {
    Renderer::new(calibration, Mm::constant(20.0), gauge, *image, 5).unwrap()
}

fn fractions(renderer: &Renderer, bead: &BeadEdges<'_>) -> Vec<f32> {
    seen(renderer, bead).fractions
}

fn seen(renderer: &Renderer, bead: &BeadEdges<'_>) -> BeadCoverage {
    let view = renderer.view(None).unwrap();
    let GaugeExtent { run, cross } = renderer.extent();
    let outline = BeadOutline::trace(&view, bead, to_f64(run), to_f64(cross)).unwrap();
    renderer.coverage(0, &outline, &view)
}

fn grey(frame: &Frame) -> Vec<f64> {
    frame.to_grey8().iter().map(|v| f64::from(*v)).collect()
}

fn straight(width_mm: f64) -> impl Fn(f64) -> Option<(f64, f64)> {
    move |_| Some((-0.5 * width_mm, 0.5 * width_mm))
}

/// Where a row of a noise-free image passes half way from ground to bead.
fn half_way(renderer: &Renderer, fractions: &[f32], row: usize, rising: bool) -> f64 {
    let width = renderer.size.0;
    let line = &fractions[row * width..(row + 1) * width];
    let passes = |i: usize| {
        if rising {
            line[i] < 0.5 && line[i + 1] >= 0.5
        } else {
            line[i] >= 0.5 && line[i + 1] < 0.5
        }
    };
    let i = (0..width - 1).find(|i| passes(*i)).unwrap();
    to_f64(i) + f64::from((0.5 - line[i]) / (line[i + 1] - line[i]))
}

#[test]
fn every_row_holds_the_width_of_the_bead_in_pixels() {
    for (slant_deg, blur_px) in [(0.0, 1.5), (7.3, 1.5), (-19.0, 0.0), (12.0, 4.0), (3.0, 0.3)] {
        let image = ImageModel { slant_deg, blur_px, lateral_mm: 1.234, ..quiet() };
        let renderer = renderer(scale(), upright(), &image);
        let fractions = fractions(&renderer, &straight(30.0));
        let expected = 30.0 / PAPER_SCALE / slant_deg.to_radians().cos();
        for row in [60, 200, 333, 480] {
            let sum: f64 =
                fractions[row * 720..(row + 1) * 720].iter().map(|s| f64::from(*s)).sum();
            assert!((sum - expected).abs() < 2e-4, "slant {slant_deg} row {row}: {sum} {expected}");
        }
    }
}

#[test]
fn pixels_far_from_the_edges_are_bead_or_ground_in_the_light_there() {
    let image = ImageModel { noise_grey: 0.0, light_ratio: 1.5, ..ImageModel::default() };
    let renderer = renderer(scale(), upright(), &image);
    let pixels = grey(&renderer.render(0, Stamp::START, None, &straight(40.0)).unwrap().frame);
    let light = |x: f64, y: f64| 1.0 + 0.2 * ((x - 359.5) / 719.0 + (y - 269.5) / 539.0);
    for (x, y, level) in [(0, 0, 70.0), (719, 539, 70.0), (360, 10, 150.0), (300, 500, 150.0)] {
        let expected = level * light(f64::from(x), f64::from(y));
        let at = usize::try_from(y * 720 + x).unwrap();
        assert!((pixels[at] - expected.round()).abs() < 1e-9, "pixel {x}, {y}");
    }
    assert!((light(719.0, 539.0) / light(0.0, 0.0) - 1.5).abs() < 1e-12);
}

#[test]
fn truth_lies_where_the_picture_passes_half_way() {
    let wavy = |s: f64| {
        let wave = 0.2 * (s / 4.0).sin();
        Some((-19.0 - wave, 20.0 + 0.1 * (s / 3.0).cos()))
    };
    // An odd number of rows, so that the middle of the gauge is a row.
    let odd = gauge(Roi { x: 40, y: 20, width: 640, height: 501 }, BeadAxis::Vertical);
    for (calibration, slant_deg) in [(scale(), 0.0), (tilted(), 0.0), (tilted(), 9.0)] {
        let image = ImageModel { slant_deg, lateral_mm: -0.7, ..quiet() };
        let renderer = renderer(calibration, odd, &image);
        let truth = renderer.render(0, Stamp::START, None, &wavy).unwrap().truth.unwrap();
        let fractions = fractions(&renderer, &wavy);
        assert_eq!((truth.left.y, truth.right.y), (270.0, 270.0));
        assert!((half_way(&renderer, &fractions, 270, true) - truth.left.x).abs() < 0.01);
        assert!((half_way(&renderer, &fractions, 270, false) - truth.right.x).abs() < 0.01);
        assert!((truth.width_mm - 39.0).abs() < 0.15);
    }
}

#[test]
fn a_straight_bead_has_its_width_between_its_edges_on_the_surface() {
    let image = ImageModel { slant_deg: 11.0, lateral_mm: 2.0, ..quiet() };
    let renderer = renderer(tilted(), upright(), &image);
    let bead = straight(37.0);
    let truth = renderer.render(0, Stamp::START, None, &bead).unwrap().truth.unwrap();
    assert!((truth.width_mm - 37.0).abs() < 1e-9);
    assert!(truth.roughness_mm < 1e-9);
    let map = tilted().surface(Mm::constant(20.0), None);
    let view = renderer.view(None).unwrap();
    let (left, right) = (map.to_mm(truth.left).unwrap(), map.to_mm(truth.right).unwrap());
    let along = view.along_mm(truth.right).unwrap() - view.along_mm(truth.left).unwrap();
    let normal = ((right - left).norm_squared() - along * along).sqrt();
    assert!((normal - 37.0).abs() < 1e-3, "{normal}");
}

#[test]
fn a_surface_nearer_the_camera_looks_wider() {
    let down = Calibration::Full {
        image_size_px: [720, 540],
        camera: Camera {
            focal_px: [2500.0, 2500.0],
            centre_px: [359.5, 269.5],
            distortion: [0.0; 8],
        },
        bed: Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), Vector3::new(0.0, 0.0, 400.0)),
        robot_z: Mm::constant(100.0),
        quality: None,
    };
    let seen = |height: Option<f64>, robot_z: Option<f64>| {
        let image = ImageModel { true_surface_height_mm: height, ..quiet() };
        let rendered = renderer(down.clone(), upright(), &image)
            .render(0, Stamp::START, robot_z.map(Mm::constant), &straight(40.0))
            .unwrap();
        let truth = rendered.truth.unwrap();
        truth.right.x - truth.left.x
    };
    assert!((seen(None, None) - 40.0 * 2500.0 / 380.0).abs() < 1e-6);
    assert!((seen(Some(25.0), None) - 40.0 * 2500.0 / 375.0).abs() < 1e-6);
    assert!((seen(None, Some(110.0)) - 40.0 * 2500.0 / 390.0).abs() < 1e-6);
}

#[test]
fn a_horizontal_bead_is_a_vertical_one_turned() {
    let bead = |s: f64| Some((-10.0 - 0.3 * (s / 5.0).sin(), 14.0 + 0.01 * s));
    let size_px = [300, 300];
    let roi = Roi { x: 20, y: 20, width: 260, height: 260 };
    // To the right of the direction of travel in both.
    let leaning = |slant_deg| ImageModel { size_px, slant_deg, ..quiet() };
    let up = fractions(&renderer(scale(), gauge(roi, BeadAxis::Vertical), &leaning(-5.0)), &bead);
    let right =
        fractions(&renderer(scale(), gauge(roi, BeadAxis::Horizontal), &leaning(5.0)), &bead);
    for (row, column) in (0..300).flat_map(|row| (0..300).map(move |column| (row, column))) {
        let turned = up[(299 - column) * 300 + row];
        assert!((right[row * 300 + column] - turned).abs() < 1e-6);
    }
}

#[test]
fn a_bead_that_begins_in_the_picture_covers_its_own_area() {
    let begun = |s: f64| (s < 3.3).then_some((-12.0, 13.0));
    let image = ImageModel { slant_deg: 6.0, size_px: [400, 300], ..quiet() };
    let roi = Roi { x: 20, y: 20, width: 360, height: 260 };
    let renderer = renderer(scale(), gauge(roi, BeadAxis::Vertical), &image);
    let at = |bead: &BeadEdges<'_>| {
        fractions(&renderer, bead).iter().map(|s| f64::from(*s)).sum::<f64>()
    };
    let later = |s: f64| (s < 5.3).then_some((-12.0, 13.0));
    let grown = (at(&later) - at(&begun)) * PAPER_SCALE * PAPER_SCALE;
    assert!((grown - 2.0 * 25.0).abs() < 1e-2, "{grown}");
    let rendered = renderer.render(0, Stamp::START, None, &begun).unwrap();
    assert_eq!(rendered.truth, None);
}

#[test]
fn without_a_bead_there_is_ground() {
    let renderer = renderer(tilted(), upright(), &quiet());
    let rendered = renderer.render(0, Stamp::START, None, &|_| None).unwrap();
    assert!(rendered.frame.to_grey8().iter().all(|v| *v == 70));
    assert_eq!(rendered.truth, None);
}

#[test]
fn noise_is_of_the_size_that_was_asked_for_and_of_the_frame_alone() {
    let image = ImageModel { light_ratio: 1.0, noise_grey: 4.0, ..ImageModel::default() };
    let renderer = renderer(scale(), upright(), &image);
    let frame = |seq| renderer.render(seq, Stamp::START, None, &|_| None).unwrap().frame;
    let (first, second) = (frame(0), frame(1));
    assert_eq!(frame(0), first);
    let (a, b) = (grey(&first), grey(&second));
    let n = to_f64(a.len());
    let variance = a.iter().map(|v| (v - 70.0).powi(2)).sum::<f64>() / n;
    // Rounding adds a twelfth; four standard errors.
    assert!((variance - 16.0 - 1.0 / 12.0).abs() < 4.0 * 16.0 * (2.0 / n).sqrt());
    let shared = a.iter().zip(&b).map(|(a, b)| (a - 70.0) * (b - 70.0)).sum::<f64>() / n;
    assert!(shared.abs() < 4.0 * 16.0 / n.sqrt());
}

#[test]
fn a_gauge_outside_the_picture_is_refused_in_words() {
    let image = ImageModel { size_px: [320, 240], ..quiet() };
    let refused = Renderer::new(scale(), Mm::ZERO, upright(), image, 1).unwrap_err();
    let message = refused.to_string();
    assert!(message.contains("(680, 520)") && message.contains("320 x 240"), "{message}");
}

#[test]
fn the_reach_is_half_the_picture() {
    let reach = renderer(scale(), upright(), &quiet()).reach_mm(None).unwrap();
    assert!((reach - 270.0 * PAPER_SCALE).abs() < 1e-9);
}
