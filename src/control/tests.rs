//! What an operator relies on, event by event.

mod distance;
mod extruder;
mod repeated;
mod robot_reports;
mod slow_camera;

use super::*;
use crate::core::{
    Mm, MmPerS, MmPerS2, RobotLimits, RobotMode, RobotState, Span, Stamp, WidthRange,
};
use crate::width_control::limiter::{SpeedLimit, SpeedLimits};
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::constant::ConstantStrategy;
use crate::width_control::strategy::pi::PiStrategy;
use crate::width_control::strategy::{BeadNoise, CellParameters, WidthControlSettings};
use crate::width_control::target::WidthTarget;
use std::sync::Arc;

/// The cell of the 2022 paper.
pub fn setup() -> Setup {
    Setup {
        control: WidthControlSettings {
            target: WidthTarget::constant(Mm::constant(42.0)),
            strategy: Arc::new(PiStrategy),
            gains: Some(PiGains { kp_per_s: 5.925, ki_per_s2: 4.74 }),
            max_gap: Span::from_secs(0.5),
            max_hold: Span::from_secs(3.0),
        },
        limits: SpeedLimits {
            min_speed: MmPerS::constant(60.0),
            max_speed: MmPerS::constant(150.0),
            max_accel: MmPerS2::constant(2000.0),
        },
        cell: CellParameters {
            start_speed: MmPerS::constant(112.5),
            start_length: Mm::constant(200.0),
            camera_offset: Mm::constant(88.4),
            camera_offset_sigma: Mm::constant(8.84),
            gauge_length: Mm::constant(12.7),
            setpoint_period: Span::from_millis(200),
            bead_noise: BeadNoise { roughness: None, length: Mm::constant(5.0) },
            screw_pulses: None,
            width_range: WidthRange { min: Mm::constant(20.0), max: Mm::constant(60.0) },
        },
        bead_length: None,
        alone_for: Span::from_millis(1600),
    }
}

/// A cell over time: a robot that reports, a camera that measures.
struct Line {
    controller: Controller,
    now: f64,
    frame: u64,
}

impl Line {
    fn new() -> Self {
        Self::of(setup())
    }

    /// A cell with its link up.
    fn of(setup: Setup) -> Self {
        let mut line = Self { controller: Controller::new(setup), now: 0.0, frame: 0 };
        let _ = line.link_up(200.0);
        line
    }

    /// A robot connects that is as fast as this [mm/s].
    fn link_up(&mut self, max_speed: f64) -> Step {
        let robot = RobotLimits {
            name: "sim".into(),
            min_mm_per_s: MmPerS::constant(10.0),
            max_mm_per_s: MmPerS::constant(max_speed),
            hold_mm_per_s: MmPerS::constant(80.0),
        };
        self.give(&Event::LinkUp { robot })
    }

    fn give(&mut self, event: &Event) -> Step {
        self.controller.step(Stamp::from_secs(self.now), event)
    }

    fn robot(&mut self, mode: RobotMode, path: f64, speed: f64) -> Step {
        self.robot_at(None, mode, path, speed)
    }

    /// A report with the time of the robot's own clock.
    fn robot_at(&mut self, ms: Option<u64>, mode: RobotMode, path: f64, speed: f64) -> Step {
        self.give(&Event::Robot(RobotState {
            robot_time_ms: ms,
            has_setpoint: true,
            mode,
            speed_mm_per_s: MmPerS::constant(speed),
            path_mm: Mm::constant(path),
            z_mm: Mm::ZERO,
        }))
    }

    fn width(&mut self, width: f64) -> Step {
        self.width_of_age(0.0, width)
    }

    /// A width that arrives some seconds after its frame was captured.
    fn width_of_age(&mut self, age: f64, width: f64) -> Step {
        self.frame += 1;
        self.give(&Event::Measured {
            frame: self.frame,
            captured_at: Stamp::from_secs(self.now - age),
            width_mm: Mm::constant(width),
            sigma_mm: Mm::constant(0.01),
        })
    }

    fn tick(&mut self) -> Option<f64> {
        match self.give(&Event::Tick).command {
            Some(Command::Speed(speed)) => Some(speed.get()),
            _ => None,
        }
    }

    /// Lays bead until the controller tracks a width on target.
    fn tracking() -> Self {
        let mut line = Self::new();
        line.now = 1.0;
        let _ = line.robot(RobotMode::Print, 0.0, 112.5);
        line.now = 3.0;
        let _ = line.robot(RobotMode::Print, 225.0, 112.5);
        let _ = line.tick();
        assert_eq!(line.width(42.0).state, State::Tracking);
        line
    }

    fn advance(&mut self, secs: f64, path: f64, speed: f64) -> Step {
        self.now += secs;
        self.robot(RobotMode::Print, path, speed)
    }

    /// Lays bead at the start speed, which began at 1 s.
    fn lay(&mut self, secs: f64) -> Step {
        self.advance(secs, 112.5 * (self.now + secs - 1.0), 112.5)
    }
}

#[test]
fn nothing_is_sent_to_a_robot_that_does_not_print() {
    let mut line = Line::new();
    assert_eq!(line.tick(), None);
    let _ = line.robot(RobotMode::Idle, 0.0, 0.0);
    assert_eq!(line.tick(), None);
    assert_eq!(line.width(30.0).state, State::Idle);
}

#[test]
fn the_first_part_is_laid_at_the_start_speed_whatever_the_width() {
    let mut line = Line::new();
    line.now = 1.0;
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    assert_eq!(line.width(30.0).state, State::Priming);
    assert_eq!(line.tick(), Some(112.5));
    line.now = 2.7;
    let _ = line.robot(RobotMode::Print, 191.0, 112.5);
    assert_eq!(line.width(30.0).state, State::Priming);
    assert_eq!(line.tick(), Some(112.5));
}

#[test]
fn tracking_begins_bumpless_and_speeds_up_for_too_wide() {
    let mut line = Line::tracking();
    assert!((line.tick().unwrap() - 112.5).abs() < 1e-9);
    let _ = line.advance(0.1, 236.0, 112.5);
    let step = line.width(43.0);
    let demand = step.trace.demand_mm_per_s.unwrap().get();
    assert!((demand - (112.5 + 5.925 + 0.474)).abs() < 1e-9);
    let bead = step.trace.bead_path_mm.unwrap().get();
    assert!((bead - (236.0 - 88.4)).abs() < 1e-9);
}

#[test]
fn a_gap_is_held_and_not_integrated_across() {
    let mut line = Line::tracking();
    let _ = line.advance(0.1, 236.0, 112.5);
    let _ = line.width(42.5);
    let before = line.tick().unwrap();
    let _ = line.advance(0.6, 300.0, before);
    assert_eq!(line.tick(), Some(before));
    let held = State::Holding(Hold::NoWidth);
    assert_eq!(line.controller.state(), held);
    for _ in 0..2 {
        assert_eq!(line.width(44.0).state, held);
        let _ = line.advance(0.02, 302.0, before);
    }
    let step = line.width(44.0);
    assert_eq!(step.state, State::Tracking);
    assert!((step.trace.demand_mm_per_s.unwrap().get() - before).abs() < 1e-9);
}

#[test]
fn a_long_hold_becomes_a_fault_that_stops_the_robot() {
    let mut line = Line::tracking();
    let speed = line.tick().unwrap();
    for k in 1..=50 {
        let _ = line.advance(0.1, 225.0 + f64::from(k) * 11.25, speed);
        let _ = line.tick();
    }
    let held = Fault::HeldTooLong(Hold::NoWidth);
    assert_eq!(line.controller.state(), State::Fault(held));
    assert_eq!(line.give(&Event::Tick).command, Some(Command::Stop));
    assert_eq!(line.robot(RobotMode::Idle, 0.0, 0.0).state, State::Idle);
}

#[test]
fn a_robot_that_does_not_follow_is_held_and_then_stopped() {
    let mut line = Line::tracking();
    let _ = line.tick();
    let _ = line.advance(0.1, 230.0, 90.0);
    let _ = line.advance(0.55, 280.0, 90.0);
    assert_eq!(line.controller.state(), State::Holding(Hold::SpeedMismatch));
    let _ = line.advance(1.5, 400.0, 90.0);
    assert_eq!(line.controller.state(), State::Fault(Fault::SpeedMismatch));
}

#[test]
fn the_integrator_is_frozen_while_the_robot_is_slower_than_its_setpoint() {
    let mut line = Line::tracking();
    let _ = line.tick();
    let _ = line.advance(0.1, 236.0, 106.0);
    let _ = line.width(42.0);
    let _ = line.advance(0.35, 273.0, 106.0);
    let before = line.width(42.0).trace.integral_mm_per_s.unwrap();
    let _ = line.advance(0.1, 284.0, 106.0);
    let step = line.width(44.0);
    assert_eq!(step.trace.integral_mm_per_s.unwrap(), before);
    let _ = line.tick();
    assert_eq!(line.width(44.0).trace.limit, SpeedLimit::RobotSlower);
}

#[test]
fn a_lost_link_is_a_hold_that_ends_with_the_link() {
    let mut line = Line::tracking();
    let _ = line.tick();
    let step = line.give(&Event::LinkDown { reason: "no STATE for 500 ms".into() });
    assert_eq!(step.state, State::Holding(Hold::LinkDown));
    assert_eq!(line.tick(), None);
    line.now += 0.3;
    let _ = line.link_up(200.0);
    for path in [270.0, 278.0] {
        let _ = line.advance(0.1, path, 80.0);
        assert_eq!(line.width(42.0).state, State::Holding(Hold::NoWidth));
    }
    let _ = line.advance(0.1, 286.0, 80.0);
    let step = line.width(42.0);
    assert_eq!(step.state, State::Tracking);
    assert!((step.trace.demand_mm_per_s.unwrap().get() - 80.0).abs() < 1e-9);
}

#[test]
fn a_robot_with_narrower_limits_is_never_driven() {
    let mut line = Line::new();
    let step = line.link_up(100.0);
    assert_eq!(step.state, State::Holding(Hold::RobotLimits));
    let _ = line.robot(RobotMode::Print, 0.0, 80.0);
    assert_eq!(line.tick(), None);
}

#[test]
fn a_lost_recording_ends_control_in_hold() {
    let mut line = Line::tracking();
    let step = line.give(&Event::RecordingLost);
    assert_eq!(step.state, State::Holding(Hold::RecordingLost));
    let _ = line.advance(0.1, 236.0, 112.5);
    assert_eq!(line.width(50.0).state, State::Holding(Hold::RecordingLost));
    assert_eq!(line.tick(), None);
    let step = line.give(&Event::Stop);
    assert_eq!(step.command, Some(Command::Stop));
}

#[test]
fn a_width_of_the_last_bead_does_not_start_control_of_this_one() {
    let mut line = Line::new();
    line.controller.setup.cell.start_length = Mm::constant(20.0);
    line.now = 1.0;
    let _ = line.robot(RobotMode::Print, 500.0, 112.5);
    line.now = 1.4;
    let _ = line.robot(RobotMode::Print, 545.0, 112.5);
    assert_eq!(line.width(42.0).state, State::Priming);
    line.now = 1.9;
    let _ = line.robot(RobotMode::Print, 600.0, 112.5);
    assert_eq!(line.width(42.0).state, State::Tracking);
}

#[test]
fn a_bead_without_widths_is_held_and_then_a_fault() {
    let mut line = Line::new();
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    let mut states = Vec::new();
    let mut path = 0.0;
    for _ in 0..80 {
        path += 11.25;
        let _ = line.advance(0.1, path, 112.5);
        let _ = line.tick();
        states.push((path, line.controller.state()));
    }
    let first = |state: &State| states.iter().find(|(_, found)| found == state).map(|one| one.0);
    let held = first(&State::Holding(Hold::NoWidth)).unwrap();
    // 200 mm at the start speed, 88.4 mm to the camera, and half a second.
    assert!((340.0..370.0).contains(&held), "{held}");
    assert!(first(&State::Fault(Fault::HeldTooLong(Hold::NoWidth))).is_some());
}

#[test]
fn a_camera_lost_during_a_robot_hold_is_still_a_hold_after_it() {
    let mut line = Line::new();
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    let _ = line.advance(0.5, 56.0, 112.5);
    let _ = line.robot(RobotMode::Hold, 56.0, 0.0);
    let _ = line.give(&Event::CameraLost { reason: "unplugged".into() });
    let state = line.advance(0.1, 57.0, 112.5).state;
    assert_eq!(state, State::Holding(Hold::CameraLost));
}

#[test]
fn a_path_that_jitters_is_no_new_bead_and_one_in_a_fault_stays_in_it() {
    let mut line = Line::tracking();
    assert_eq!(line.advance(0.1, 236.0, 112.5).state, State::Tracking);
    assert_eq!(line.advance(0.1, 235.9, 112.5).state, State::Tracking);
    let _ = line.robot(RobotMode::Fault, 240.0, 0.0);
    assert_eq!(line.advance(0.1, 5.0, 112.5).state, State::Fault(Fault::Robot));
    let _ = line.robot(RobotMode::Idle, 5.0, 0.0);
    assert_eq!(line.advance(0.1, 6.0, 112.5).state, State::Priming);
}

#[test]
fn a_new_bead_that_is_first_reported_in_hold_is_a_new_one() {
    let mut line = Line::tracking();
    let _ = line.advance(0.1, 500.0, 112.5);
    let _ = line.robot(RobotMode::Hold, 60.0, 0.0);
    assert_eq!(line.advance(0.1, 65.0, 112.5).state, State::Priming);
}

#[test]
fn a_constant_strategy_keeps_its_speed_whatever_is_measured() {
    let speed = MmPerS::constant(95.0);
    let mut setup = setup();
    setup.control.strategy = Arc::new(ConstantStrategy { speed });
    let mut line = Line::of(setup);
    line.now = 1.0;
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    let _ = line.advance(2.0, 225.0, 112.5);
    assert_eq!(line.width(50.0).state, State::Tracking);
    assert_eq!(line.tick(), Some(95.0));
    let _ = line.advance(0.2, 244.0, 95.0);
    let _ = line.width(30.0);
    assert_eq!(line.tick(), Some(95.0));
}
