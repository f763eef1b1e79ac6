use super::*;
use crate::calibration::{Calibration, Camera};
use crate::core::{Mm, Pixels, Pose, Roi, Size, Stamp, WidthRange};
use crate::vision::gauge::{BeadAxis, EdgeKind, Polarity};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const SIZE: (usize, usize) = (400, 60);
/// Edges of the bead \[px\].
const EDGES: [f64; 2] = [60.0, 300.0];
/// Width of a groove [px].
const GROOVE_PX: f64 = 2.0;

/// A bead of 150 on 70 with a blur of 1.5 px and a noise of 2.
fn frame() -> Frame {
    frame_of_gamma(1.0, 11)
}

/// The same light seen by a camera with a gamma.
fn frame_of_gamma(gamma: f64, seed: u64) -> Frame {
    frame_of_gamma_in_noise(gamma, 2.0, seed)
}

/// The same with another noise of the light.
fn frame_of_gamma_in_noise(gamma: f64, noise_grey: f64, seed: u64) -> Frame {
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut noise = || -> f64 { StandardNormal.sample(&mut random) };
    let share = |x: f64| 0.5 * (1.0 + libm::erf(x / (1.5 * std::f64::consts::SQRT_2)));
    let mut level = |x: u16| {
        let [left, right] = EDGES.map(|edge| share(f64::from(x) - edge));
        let light = 70.0 + 80.0 * (left - right) + noise_grey * noise();
        255.0 * (light.max(0.0) / 255.0).powf(gamma)
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "8 bits")]
    let values = (0..60 * 400u16).map(|k| level(k % 400).round() as u8).collect();
    Frame::new(0, Stamp::START, Size::new(SIZE.0, SIZE.1), Pixels::Grey8(values)).unwrap()
}

fn gauge(from: usize, to: usize) -> Gauge {
    Gauge::new(
        Roi { x: from, y: 0, width: to - from, height: 60 },
        BeadAxis::Vertical,
        Polarity::Bright,
        WidthRange { min: Mm::constant(10.0), max: Mm::constant(400.0) },
    )
}

fn measure(gauge: Gauge, surface: &SurfaceMap) -> Result<WidthMeasurement, Reject> {
    Measurer::new(gauge, None).measure(&frame(), surface)
}

/// Beside each edge of the bead a dark line that is narrower than its blur.
fn frame_with_grooves(seed: u64) -> Frame {
    let mut random = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let share = |x: f64| 0.5 * (1.0 + libm::erf(x / (1.5 * std::f64::consts::SQRT_2)));
    let mut level = |x: u16| {
        let noise: f64 = StandardNormal.sample(&mut random);
        let x = f64::from(x);
        let ground = share(EDGES[0] - GROOVE_PX - x) + share(x - EDGES[1] - GROOVE_PX);
        15.0 + 135.0 * (share(x - EDGES[0]) - share(x - EDGES[1])) + 55.0 * ground + 2.0 * noise
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "8 bits")]
    let values = (0..60 * 400u16).map(|k| level(k % 400).round() as u8).collect();
    Frame::new(0, Stamp::START, Size::new(SIZE.0, SIZE.1), Pixels::Grey8(values)).unwrap()
}

/// Half of the height above a groove that blur fills lies inside the bead; who says that
/// there is none gets that position.
#[test]
fn a_given_edge_says_whether_a_dark_line_is_a_groove() {
    let scale = SurfaceMap::from_scale(1.0);
    let width = |edge| {
        let gauge = Gauge { edge, ..gauge(0, 400) };
        let frames = (1..=20).map(frame_with_grooves);
        let found =
            frames.filter_map(|frame| Measurer::new(gauge, None).measure(&frame, &scale).ok());
        let widths: Vec<f64> = found.map(|found| found.width.get()).collect();
        assert!(widths.len() > 15, "{edge:?}: {}", widths.len());
        widths.iter().sum::<f64>() / f64::from(u32::try_from(widths.len()).unwrap())
    };
    let [auto, step, groove] = [EdgeKind::Auto, EdgeKind::Step, EdgeKind::Groove].map(width);
    assert!((groove - 240.0).abs() < 0.2 && (auto - 240.0).abs() < 0.3, "{auto} {groove}");
    assert!(groove - step > 0.3, "{step} {groove}");
}

/// Either the gauge shows enough of both edges, or it says so: a step that is
/// cut short seems to lie farther inside.
#[test]
fn an_edge_at_the_border_of_the_gauge_is_no_edge() {
    let scale = SurfaceMap::from_scale(1.0);
    for margin in 0..24 {
        for from in [60 - margin, 0] {
            let to = if from == 0 { 301 + margin } else { 400 };
            match measure(gauge(from, to), &scale) {
                Ok(found) => {
                    assert!((found.width.get() - 240.0).abs() < 0.1, "{from}..{to}: {found:?}");
                }
                Err(_) => assert!(margin < 8, "{margin} px beside an edge are enough"),
            }
        }
    }
    let found = measure(gauge(58, 400), &scale).unwrap_err();
    assert!(matches!(found, Reject::Clipped { .. } | Reject::NoPair { .. }), "{found}");
}

/// With a gamma of 0.45 the half level of a flank lies outside the bead; the table
/// takes that back.
#[test]
fn a_given_gamma_is_taken_out_before_edges_are_found() {
    let scale = SurfaceMap::from_scale(1.0);
    let seeds = 1..=20;
    // The mean over the frames: a single one may be off by its noise.
    let width = |gamma, given| {
        let gauge = Gauge { gamma: given, ..gauge(0, 400) };
        let of = |seed| {
            let frame = frame_of_gamma(gamma, seed);
            Measurer::new(gauge, None).measure(&frame, &scale).unwrap().width.get()
        };
        seeds.clone().map(of).sum::<f64>() / 20.0
    };
    let linear = width(1.0, None);
    for gamma in [0.45, 2.2] {
        let found = width(gamma, Some(gamma));
        assert!((found - linear).abs() < 0.01, "{gamma}: {found} for {linear}");
    }
    let uncorrected = width(0.45, None);
    assert!(uncorrected - linear > 0.1, "{uncorrected} for {linear}");
}

/// Frames of a camera whose gamma is not given show together how far off their widths are.
#[test]
fn skewed_flanks_tell_how_far_widths_are_off() {
    let scale = SurfaceMap::from_scale(1.0);
    let estimated = |gamma| {
        let (mut sum, mut weight, mut error) = (0.0, 0.0, 0.0);
        for seed in 1..=100 {
            let mut measurer = Measurer::new(gauge(0, 400), None);
            let found = measurer.measure(&frame_of_gamma(gamma, seed), &scale).unwrap();
            error += 0.01 * (found.width.get() - 240.0);
            // None where another way of measuring shows more.
            let Some(skew) = measurer.with_skew(found).hints.skew else { continue };
            sum += skew.offset_px / skew.variance;
            weight += 1.0 / skew.variance;
        }
        (sum / weight, 1.0 / f64::sqrt(weight), error)
    };
    let (offset, sigma, error) = estimated(1.0);
    assert!(offset.abs() < 3.5 * sigma && sigma < 0.05, "{offset} ± {sigma}");
    assert!(error.abs() < 0.02, "{error}");
    for gamma in [0.45, 1.5] {
        let (offset, sigma, error) = estimated(gamma);
        assert!((offset - error).abs() < 3.5 * sigma, "{gamma}: {offset} ± {sigma} for {error}");
        assert!(offset.abs() > 4.0 * sigma, "{gamma}: {offset} ± {sigma}");
    }
}

/// Where a single frame shows the skew, its standard deviation contains it.
#[test]
fn sigma_contains_a_skew_that_shows() {
    let scale = SurfaceMap::from_scale(1.0);
    let frame = frame_of_gamma_in_noise(0.45, 0.2, 3);
    let found = Measurer::new(gauge(0, 400), None).measure(&frame, &scale).unwrap();
    let error = found.width.get() - 240.0;
    assert!(error > 0.3 && error < 1.5 * found.sigma.get(), "{error} ± {}", found.sigma);
}

#[test]
fn light_behind_16_bits_is_the_same_as_behind_8() {
    let scale = SurfaceMap::from_scale(1.0);
    let gauge = Gauge { gamma: Some(0.45), ..gauge(0, 400) };
    let frame = frame_of_gamma(0.45, 11);
    let Pixels::Grey8(values) = frame.pixels() else { unreachable!() };
    let deep = values.iter().map(|&value| u16::from(value) * 16).collect();
    let deep =
        Frame::new(0, Stamp::START, Size::new(SIZE.0, SIZE.1), Pixels::Grey16(deep)).unwrap();
    let of = |frame, white| Measurer::new(gauge, white).measure(frame, &scale).unwrap();
    let (bytes, words) = (of(&frame, None), of(&deep, Some(255 * 16)));
    assert!((bytes.width.get() - words.width.get()).abs() < 1e-3, "{bytes:?} {words:?}");
    assert!((bytes.hints.contrast_grey - words.hints.contrast_grey).abs() < 0.1);
}

#[test]
fn a_width_with_too_large_a_sigma_is_refused() {
    let found = measure(gauge(0, 400), &SurfaceMap::from_scale(1.0)).unwrap();
    let fraction = found.sigma.get() / found.width.get();
    let strict = Gauge { max_sigma: 0.5 * fraction, ..gauge(0, 400) };
    let refused = measure(strict, &SurfaceMap::from_scale(1.0)).unwrap_err();
    assert_eq!(refused.status(), "unsure");
    let text = refused.to_string();
    assert!(text.contains("a longer gauge") && !text.contains("calibrate"), "{text}");
}

#[test]
fn an_uncertain_calibration_is_named_as_the_cause() {
    let calibration = Calibration::Scale { mm_per_px: 1.0, sigma: Some(0.03) };
    let surface = calibration.surface(Mm::ZERO, None);
    let refused = measure(gauge(0, 400), &surface).unwrap_err();
    assert_eq!(refused.status(), "unsure");
    let text = refused.to_string();
    assert!(text.contains("3.0 %") && text.contains("calibrate again"), "{text}");
    let loose = Gauge { max_sigma: 0.05, ..gauge(0, 400) };
    assert!(measure(loose, &surface).is_ok());
}

#[test]
fn images_of_another_size_than_the_calibrations_are_refused() {
    let camera = Camera { focal_px: [500.0; 2], centre_px: [200.0, 30.0], distortion: [0.0; 8] };
    let bed =
        Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), Vector3::new(0.0, 0.0, 400.0));
    let calibration = |image_size_px: [u32; 2]| Calibration::Full {
        image_size_px,
        camera,
        bed,
        robot_z: Mm::ZERO,
        quality: None,
    };
    let surface = |size: [u32; 2]| calibration(size).surface(Mm::ZERO, None);
    let width = measure(gauge(0, 400), &surface([400, 60])).unwrap().width;
    assert!((width.get() - 240.0 * 0.8).abs() < 0.1, "{width}");
    let refused = measure(gauge(0, 400), &surface([800, 120])).unwrap_err();
    assert_eq!(refused, Reject::OtherSize { image: SIZE, calibrated: [800, 120] });
    assert_eq!(refused.status(), "wrong_size");
    let said = refused.to_string();
    assert!(said.contains("400x60") && said.contains("800x120"), "{said}");
}
