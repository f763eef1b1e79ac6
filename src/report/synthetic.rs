//! An invented run for the tests: a sinusoidal width, every state, a limit, rejected frames,
//! images. It is always the same.

#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "small numbers of a made-up run"
)]

use std::path::Path;

use crate::control::{Command, Event, Fault, Hold, State, Step, Trace};
use crate::core::{
    Frame, ImagePoint, Mm, MmPerS, MmPerS2, Pixels, RobotMode, RobotState, Roi, Size, Stamp,
    WidthRange,
};
use crate::report::run::RunPage;
use crate::rows::frame_row::{ControlColumns, FrameRow, sample};
use crate::rows::log::{ControlFacts, LogOptions};
use crate::rows::summary::{RunNote, Summary};
use crate::vision::{BeadAxis, Edges, Gauge, Polarity, WidthMeasurement};
use crate::width_control::limiter::{SpeedLimit, SpeedLimits};

const SIZE: (usize, usize) = (720, 540);
const MM_PER_PX: f64 = 0.126_582;
const MM_BEHIND: f64 = 88.4;

pub fn gauge() -> Gauge {
    Gauge::new(
        Roi { x: 100, y: 60, width: 520, height: 420 },
        BeadAxis::Vertical,
        Polarity::Bright,
        WidthRange { min: Mm::constant(20.0), max: Mm::constant(60.0) },
    )
}

pub fn options(folder: &Path, title: &str, with_control: bool) -> LogOptions {
    LogOptions {
        folder: folder.to_path_buf(),
        title: title.to_string(),
        header: vec![
            ("camera".to_string(), "rendered, 50 Hz, 720 × 540 px".to_string()),
            ("robot".to_string(), "127.0.0.1:5653".to_string()),
            ("calibration".to_string(), "0.126582 mm/px".to_string()),
        ],
        gauge: gauge(),
        target: with_control.then_some(Mm::constant(42.0)),
        max_rejected_fraction: 0.05,
        control: with_control.then_some(ControlFacts {
            limits: SpeedLimits {
                min_speed: MmPerS::constant(60.0),
                max_speed: MmPerS::constant(150.0),
                max_accel: MmPerS2::constant(2000.0),
            },
            extruder: None,
            profile: None,
            tolerance: None,
        }),
    }
}

/// A pseudo-random number between −1 and 1 (the finaliser of `SplitMix64`).
fn chance(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

fn width_at(time: f64) -> f64 {
    let start = 3.6 * (-(time - 2.0).max(0.0) / 1.5).exp();
    42.0 - start + 0.25 * (time * 1.3).sin()
}

fn state_at(time: f64) -> State {
    match time {
        t if t < 0.8 => State::Idle,
        t if t < 2.6 => State::Priming,
        t if (11.0..12.1).contains(&t) => State::Holding(Hold::NoWidth),
        t if t >= 19.2 => State::Fault(Fault::HeldTooLong(Hold::LinkDown)),
        t if t >= 18.6 => State::Holding(Hold::LinkDown),
        _ => State::Tracking,
    }
}

fn speed_at(time: f64) -> f64 {
    match time {
        t if t < 0.8 => 0.0,
        t if t < 2.6 => 112.5,
        t => (78.0 + 34.5 * (-(t - 2.6) / 1.2).exp() - 25.0 * (-(t - 5.0).powi(2)).exp()
            + 4.0 * (t * 1.3).sin())
        .max(60.0),
    }
}

fn refused_at(frame: u64, time: f64) -> Option<&'static str> {
    match frame {
        _ if (10.8..12.0).contains(&time) => Some("no_pair"),
        333 | 334 => Some("saturated"),
        700..705 => Some("low_contrast"),
        850 => Some("unreadable"),
        _ => None,
    }
}

fn image(frame: u64, width_px: f64, edges: &mut [Vec<ImagePoint>; 2]) -> Frame {
    let middle = 360.0 + 6.0 * chance(frame);
    let wave = |y: f64, side: f64| middle + side * (width_px / 2.0 + 1.5 * (y / 40.0 + side).sin());
    let mut pixels = Vec::with_capacity(SIZE.0 * SIZE.1);
    for y in 0..SIZE.1 {
        let (left, right) = (wave(y as f64, -1.0), wave(y as f64, 1.0));
        for x in 0..SIZE.0 {
            let x_f = x as f64;
            let cover = (x_f - left + 0.5).clamp(0.0, 1.0) * (right - x_f + 0.5).clamp(0.0, 1.0);
            let noise = 3.0 * chance((frame * 540 + y as u64) * 720 + x as u64);
            pixels.push((58.0 + 110.0 * cover + noise) as u8);
        }
    }
    for (points, side) in edges.iter_mut().zip([-1.0, 1.0]) {
        points.clear();
        points.extend((0..64).map(|i| {
            let y = 60.0 + (f64::from(i) + 0.5) * 420.0 / 64.0 - 0.5;
            ImagePoint::new(wave(y, side), y)
        }));
    }
    Frame::new(frame, Stamp::START, Size::new(SIZE.0, SIZE.1), Pixels::Grey8(pixels)).unwrap()
}

fn measured(frame: u64, width: f64) -> WidthMeasurement {
    let mut measured = sample::measured(width, 0.03 + 0.01 * chance(frame).abs());
    let half = width / MM_PER_PX / 2.0;
    measured.left = ImagePoint::new(360.0 - half, 269.5);
    measured.right = ImagePoint::new(360.0 + half, 269.5);
    measured.hints.contrast_grey = 110.0 + 3.0 * chance(frame + 7) - frame as f64 * 0.01;
    measured.hints.blur_px = 1.2 + 0.05 * chance(frame + 8);
    measured.hints.noise_grey = 2.1 + 0.1 * chance(frame + 9);
    measured.hints.saturated_fraction = 0.002 * (1.0 + chance(frame + 10));
    measured
}

fn robot(time: f64, path: f64) -> Event {
    Event::Robot(RobotState {
        robot_time_ms: None,
        has_setpoint: false,
        mode: RobotMode::Print,
        speed_mm_per_s: MmPerS::new(speed_at(time)).unwrap(),
        path_mm: Mm::new(path).unwrap(),
        z_mm: Mm::ZERO,
    })
}

fn setpoint(time: f64) -> Step {
    let speed = MmPerS::new(speed_at(time)).unwrap();
    let limit = if speed.get() <= 60.0 { SpeedLimit::MinSpeed } else { SpeedLimit::None };
    let demand = MmPerS::new(speed.get() - if limit == SpeedLimit::None { 0.3 } else { 9.0 }).ok();
    let moving = !matches!(state_at(time), State::Idle | State::Fault(_));
    Step {
        command: moving.then_some(Command::Speed(speed)),
        state: state_at(time),
        trace: Trace { limit, demand_mm_per_s: demand, ..Trace::default() },
        extruder: None,
    }
}

/// Twenty seconds with a controller, 50 frames per second.
pub fn run(folder: &Path) -> Summary {
    let mut log = RunPage::log(options(folder, "Run of cell.toml <demo & more>", true)).unwrap();
    let mut edges = [Vec::new(), Vec::new()];
    let mut path = 0.0;
    for frame in 0..1000_u64 {
        let time = frame as f64 * 0.02;
        let now = Stamp::from_secs(time);
        path += speed_at(time) * 0.02;
        let step = Step { command: None, ..setpoint(time) };
        let step = Step { trace: Trace::default(), ..step };
        log.step(now, &robot(time, path), &step);
        if frame.is_multiple_of(10) {
            log.step(now, &Event::Tick, &setpoint(time));
            log.note(&RunNote::SetpointSent);
            log.latency(1.1 + 0.5 * chance(frame).powi(3) + 0.4 * chance(frame + 1), 80.0);
        }
        let width = width_at(time) + 0.06 * chance(frame + 3);
        let outcome = refused_at(frame, time).map_or(Ok(measured(frame, width)), Err);
        let control = ControlColumns {
            bead_expected: true,
            measured_path: Mm::new(path - MM_BEHIND).ok().filter(|path| *path >= Mm::ZERO),
            nozzle_path: Mm::new(path).ok(),
            speed: MmPerS::new(speed_at(time)).ok(),
            setpoint: None,
            state: state_at(time).name(),
            limit: SpeedLimit::None,
            target: Some(Mm::constant(42.0)),
        };
        let row = FrameRow {
            frame,
            time_s: Some(time),
            outcome,
            roughness: None,
            control: Some(control),
        };
        let shown = frame.is_multiple_of(50) || outcome.is_err();
        let image = shown.then(|| image(frame, width / MM_PER_PX, &mut edges));
        let found = Edges { left: &edges[0], right: &edges[1] };
        log.frame(&row, image.as_ref(), outcome.is_ok().then_some(found)).unwrap();
    }
    log.step(
        Stamp::from_secs(18.62),
        &Event::LinkDown { reason: "no STATE for 500 ms".into() },
        &setpoint(19.9),
    );
    log.finish().unwrap()
}

/// Frames without times and without a controller.
pub fn process(folder: &Path) -> Summary {
    let mut log = RunPage::log(options(folder, "Frames of clip.mp4", false)).unwrap();
    let mut edges = [Vec::new(), Vec::new()];
    for frame in 0..300_u64 {
        let width = 42.0 + 0.5 * (frame as f64 * 0.05).sin() + 0.05 * chance(frame);
        let outcome = if frame < 80 { Err("no_pair") } else { Ok(measured(frame, width)) };
        let image = (frame.is_multiple_of(20) || frame == 0)
            .then(|| image(frame, width / MM_PER_PX, &mut edges));
        let found = Edges { left: &edges[0], right: &edges[1] };
        let row = FrameRow { frame, time_s: None, outcome, roughness: None, control: None };
        log.frame(&row, image.as_ref(), outcome.is_ok().then_some(found)).unwrap();
    }
    log.finish().unwrap()
}

pub const HOURS_OF_FRAMES: u64 = 100_000;

/// Three hours with ten frames per second, without images.
pub fn hours(folder: &Path) -> Summary {
    let mut log = RunPage::log(options(folder, "A long run", true)).unwrap();
    for frame in 0..HOURS_OF_FRAMES {
        let time = frame as f64 * 0.1;
        let path = time * 80.0;
        let tracking = Step { state: State::Tracking, ..Step::default() };
        let step = if frame.is_multiple_of(2) { &setpoint(15.0) } else { &tracking };
        log.step(Stamp::from_secs(time), &robot(15.0 + (time * 0.01).sin(), path), step);
        let spike = if frame == 54_321 { 6.0 } else { 0.0 };
        let width = 42.0 + 0.3 * chance(frame) + spike;
        let lost = frame % 997 == 0;
        let outcome = if lost { Err("no_pair") } else { Ok(measured(frame, width)) };
        let control = ControlColumns {
            bead_expected: true,
            measured_path: Mm::new(path - MM_BEHIND).ok(),
            nozzle_path: Mm::new(path).ok(),
            speed: MmPerS::new(80.0).ok(),
            setpoint: MmPerS::new(80.0).ok(),
            state: "tracking",
            limit: SpeedLimit::None,
            target: Some(Mm::constant(42.0)),
        };
        let row = FrameRow {
            frame,
            time_s: Some(time),
            outcome,
            roughness: None,
            control: Some(control),
        };
        log.frame(&row, None, None).unwrap();
    }
    log.finish().unwrap()
}
