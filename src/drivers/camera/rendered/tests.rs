use super::*;
use crate::calibration::Calibration;
use crate::cell::ImageSource;
use crate::core::{Frame, Mm, MmPerS, RobotMode, Roi, WidthRange};
use crate::scenario::bead::{BeadModel, EdgeRoughness};
use crate::scenario::disturbance::Flow;
use crate::scenario::image::ImageModel;
use crate::vision::{BeadAxis, Gauge, Polarity};

const SMOOTH_STEADY: Simulation = Simulation {
    seed: 1,
    width_source: crate::scenario::table::WidthSource::Frames,
    path: Mm::constant(2000.0),
    frame_spacing: None,
    step: Span::from_millis(20),
    report: Span::from_millis(20),
    latency: Span::ZERO,
    stamp_delay: Span::ZERO,
    robot_bandwidth_hz: 10.0,
    random_phase: false,
    gauge_length: Mm::ZERO,
    width_noise: Mm::ZERO,
    outlier_fraction: 0.0,
    outlier_size: 0.0,
    missing_fraction: 0.0,
    other_bead: None,
    bead: BeadModel {
        width_mm: 10.0,
        at_speed_mm_per_s: 100.0,
        exponent: 0.25,
        slow_below_mm_per_s: 0.0,
        slow_exponent: 0.25,
    },
    roughness: EdgeRoughness { sigma_mm: 0.0, length_mm: 5.0 },
    flow: Flow::STEADY,
    image: ImageModel {
        size_px: [160, 120],
        blur_px: 1.0,
        noise_grey: 0.0,
        light_ratio: 1.0,
        ..ImageModel::DEFAULT
    },
};

fn camera() -> (RenderedCamera, RobotView, Sender<()>) {
    let gauge = Gauge {
        calipers: 32,
        ..Gauge::new(
            Roi { x: 10, y: 10, width: 140, height: 100 },
            BeadAxis::Vertical,
            Polarity::Bright,
            WidthRange { min: Mm::constant(1.0), max: Mm::constant(15.0) },
        )
    };
    let described = CameraSettings {
        source: ImageSource::Rendered,
        source_name: "rendered".to_string(),
        rate_hz: 500.0,
        mount: Mount::Flange,
        offset: Mm::constant(90.0),
        offset_sigma: Mm::constant(8.0),
        latency: Span::ZERO,
        deadline: Span::from_millis(2000),
    };
    let scale = Calibration::Scale { mm_per_px: 0.1, sigma: None };
    let picture = SMOOTH_STEADY.image;
    let renderer = Renderer::new(scale, Mm::ZERO, gauge, picture, 1).unwrap();
    let (stop, stopped) = bounded(1);
    let (camera, view) =
        RenderedCamera::new(renderer, &SMOOTH_STEADY, &described, RunClock::start(), stopped);
    (camera, view, stop)
}

fn printing(path_mm: f64) -> RobotState {
    RobotState {
        robot_time_ms: None,
        has_setpoint: false,
        mode: RobotMode::Print,
        speed_mm_per_s: MmPerS::constant(100.0),
        path_mm: Mm::constant(path_mm),
        z_mm: Mm::ZERO,
    }
}

fn next(camera: &mut RenderedCamera) -> Frame {
    match camera.next_frame().unwrap().unwrap() {
        Grab::Frame { frame, .. } => frame,
        Grab::Unreadable { reason, .. } | Grab::Waiting { reason } => panic!("{reason}"),
    }
}

fn middle(frame: &Frame) -> u8 {
    frame.to_grey8()[60 * 160 + 80]
}

#[test]
fn the_camera_shows_what_the_robot_laid_its_offset_before() {
    let (mut camera, view, _stop) = camera();
    assert_eq!(middle(&next(&mut camera)), 70, "ground, before anything is heard");
    view.observe(Stamp::START, &printing(20.0));
    assert_eq!(middle(&next(&mut camera)), 70, "ground, before the bead is under the camera");
    view.observe(Stamp::START, &printing(200.0));
    let frame = next(&mut camera);
    assert_eq!(middle(&frame), 150);
    assert_eq!(frame.seq, 2);
    let grey = frame.to_grey8();
    let bright = grey[60 * 160..61 * 160].iter().filter(|&&value| value > 110).count();
    assert_eq!(bright, 100, "10 mm at 0.1 mm/px");
}

#[test]
fn stamps_grow_and_a_stop_ends_the_frames() {
    let (mut camera, _view, stop) = camera();
    let (first, second) = (next(&mut camera), next(&mut camera));
    assert!(second.captured_at > first.captured_at);
    stop.send(()).unwrap();
    assert_eq!(camera.next_frame(), Ok(None));
    drop(stop);
    assert_eq!(camera.next_frame(), Ok(None));
}
