//! Control by distance, event by event.

use super::*;
use crate::width_control::distance::{FallbackReason, WidthUse};
use crate::width_control::strategy::distance::DistanceStrategy;
use crate::width_control::target::Knot;

const STEP_S: f64 = 0.05;
/// Length of the gauge of `setup` [mm].
const GAUGE_MM: f64 = 12.7;

/// The 2022 paper's cell, controlled by distance.
pub(super) fn by_distance() -> Setup {
    let strategy = DistanceStrategy {
        exponent: 0.25,
        learns_exponent: true,
        drift_per_root_m: 0.0055,
        cancels_pulsation: true,
    };
    let mut setup = setup();
    setup.control.strategy = Arc::new(strategy);
    setup.cell.setpoint_period = Span::from_secs(STEP_S);
    setup
}

/// A robot without lag, and a bead of b = 0.25.
struct Cell {
    line: Line,
    path: f64,
    speed: f64,
    /// Piece by piece, where it begins and its width.
    laid: Vec<(f64, f64)>,
    /// Whether the robot reports its path.
    reports_path: bool,
}

impl Cell {
    fn new(setup: Setup) -> Self {
        let line = Line::of(setup);
        let mut cell = Self { line, path: 0.0, speed: 112.5, laid: Vec::new(), reports_path: true };
        let _ = cell.line.robot(RobotMode::Print, 0.0, 112.5);
        cell
    }

    fn width_at(speed: f64) -> f64 {
        38.61 * (speed / 112.5).powf(-0.25)
    }

    /// One step of time: lay, report, measure, command.
    fn step(&mut self) -> Step {
        self.laid.push((self.path, Self::width_at(self.speed)));
        self.path += self.speed * STEP_S;
        self.line.now += STEP_S;
        let reported = if self.reports_path { self.path } else { 0.0 };
        let _ = self.line.robot(RobotMode::Print, reported, self.speed);
        let step = self.seen().map(|width| self.line.width(width)).unwrap_or_default();
        if let Some(speed) = self.line.tick() {
            self.speed = speed;
        }
        step
    }

    /// Mean width over the gauge; `None` before there is bead under its middle.
    fn seen(&self) -> Option<f64> {
        let middle = self.path - 88.4;
        let (from, to) = (middle - 0.5 * GAUGE_MM, middle + 0.5 * GAUGE_MM);
        let ends = self.laid.iter().skip(1).map(|(at, _)| *at).chain([self.path]);
        let pieces = self
            .laid
            .iter()
            .zip(ends)
            .map(|((at, width), end)| ((end.min(to) - at.max(from)).max(0.0), *width));
        let (length, area) = pieces
            .fold((0.0, 0.0), |(length, area), (seen, width)| (length + seen, area + seen * width));
        (middle >= 0.0).then_some(area / length)
    }

    fn until(&mut self, path: f64) -> Step {
        let mut step = Step::default();
        while self.path < path {
            step = self.step();
        }
        step
    }
}

#[test]
fn the_first_setpoint_after_the_start_is_that_of_the_target_width() {
    let mut cell = Cell::new(by_distance());
    let _ = cell.until(190.0);
    assert!((cell.speed - 112.5).abs() < 1e-9);
    let _ = cell.until(212.0);
    assert_eq!(cell.line.controller.state(), State::Tracking);
    let expected = 112.5 * (38.61_f64 / 42.0).powf(4.0);
    assert!((cell.speed - expected).abs() < 0.5, "{} {expected}", cell.speed);
}

#[test]
fn a_step_of_the_target_is_laid_at_its_position() {
    let mut setup = by_distance();
    let knot = |path, width| Knot { path: Mm::constant(path), width: Mm::constant(width) };
    let knots = vec![knot(400.0, 42.0), knot(400.0, 40.0)];
    setup.control.target = WidthTarget::constant(Mm::constant(42.0)).along(knots);
    let mut cell = Cell::new(setup);
    let _ = cell.until(390.0);
    assert!((Cell::width_at(cell.speed) - 42.0).abs() < 0.2);
    let _ = cell.until(406.0);
    assert!((Cell::width_at(cell.speed) - 40.0).abs() < 0.2, "{}", cell.speed);
    let step = cell.until(520.0);
    assert!(step.trace.error_mm.unwrap().get().abs() < 0.3, "{step:?}");
}

#[test]
fn a_robot_without_a_path_falls_back_to_pi_control() {
    let mut cell = Cell::new(by_distance());
    cell.reports_path = false;
    let step = cell.until(600.0);
    assert_eq!(step.trace.fallback, Some(FallbackReason::NoPath));
    assert!(step.trace.integral_mm_per_s.is_some(), "{step:?}");
    assert_eq!(cell.line.controller.state(), State::Tracking);
}

#[test]
fn the_next_bead_is_controlled_from_its_first_millimetre() {
    let mut setup = by_distance();
    setup.cell.start_length = Mm::ZERO;
    let mut cell = Cell::new(setup);
    let _ = cell.until(500.0);
    let _ = cell.line.robot(RobotMode::Idle, 500.0, 0.0);
    cell.line.now += 5.0;
    let _ = cell.line.robot(RobotMode::Print, 500.0, 112.5);
    let speed = cell.line.tick().unwrap();
    assert!((Cell::width_at(speed) - 42.0).abs() < 0.1, "{speed}");
}

#[test]
fn control_waits_until_the_bead_fills_the_gauge() {
    let mut setup = by_distance();
    setup.cell.start_length = Mm::ZERO;
    let mut line = Line::of(setup);
    line.now = 1.0;
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    for tenth in 11..=18 {
        line.now = 0.1 * f64::from(tenth);
        let _ = line.robot(RobotMode::Print, 112.5 * (line.now - 1.0), 112.5);
    }
    let step = line.width(38.6);
    assert_eq!((step.state, step.trace.integral_mm_per_s), (State::Priming, None));
    line.now = 2.0;
    let _ = line.robot(RobotMode::Print, 112.5, 112.5);
    let step = line.width(38.6);
    assert_eq!((step.state, step.trace.integral_mm_per_s), (State::Tracking, None));
}

/// It was forgotten: the widths of the offset after a hold had no speed, and moved nothing.
#[test]
fn bead_that_the_robot_lays_at_its_hold_speed_was_laid_at_a_known_speed() {
    let mut cell = Cell::new(by_distance());
    let _ = cell.until(300.0);
    for _ in 0..16 {
        cell.laid.push((cell.path, Cell::width_at(112.5)));
        cell.path += 112.5 * STEP_S;
        cell.line.now += STEP_S;
        let _ = cell.line.robot(RobotMode::Hold, cell.path, 112.5);
    }
    cell.speed = 112.5;
    for _ in 0..30 {
        let trace = cell.step().trace.distance.unwrap();
        assert_eq!(trace.use_of_width, WidthUse::Taken, "at {} mm", cell.path);
    }
}

#[test]
fn a_hold_for_old_widths_is_not_ended_by_what_is_known_of_the_bead() {
    let mut cell = Cell::new(by_distance());
    let _ = cell.until(300.0);
    assert_eq!(cell.line.controller.state(), State::Tracking);
    let mut states = Vec::new();
    for _ in 0..120 {
        cell.path += cell.speed * STEP_S;
        let _ = cell.line.advance(STEP_S, cell.path, cell.speed);
        let _ = cell.line.width_of_age(0.8, 42.0);
        cell.speed = cell.line.tick().unwrap_or(cell.speed);
        states.push(cell.line.controller.state());
    }
    let held = states.iter().position(|state| matches!(state, State::Holding(_))).unwrap();
    assert!(!states[held..].contains(&State::Tracking), "{states:?}");
    assert_eq!(states.last(), Some(&State::Fault(Fault::HeldTooLong(slow_camera::too_slow(0.8)))));
}
