//! Reports of a robot that cannot be true: a path that jumps, a clock that stands still.

use super::distance::by_distance;
use super::*;

const SPEED: f64 = 112.5;
/// Time between two steps \[s\].
const STEP_S: f64 = 0.05;

/// A robot that reports what its faults make of the truth, and a camera.
struct Cell {
    line: Line,
    /// Path that was laid.
    laid: f64,
    /// Error of the reported path.
    jump: f64,
    /// Whether the robot's clock stands still.
    clock_stands: bool,
    clock_ms: u64,
    /// Reports that were not used.
    ignored: usize,
}

impl Cell {
    /// A cell that tracks.
    fn tracking(setup: Setup) -> Self {
        let line = Line::of(setup);
        let (laid, jump) = (0.0, 0.0);
        let mut cell = Self { line, laid, jump, clock_stands: false, clock_ms: 1, ignored: 0 };
        let _ = cell.until(4.0);
        assert_eq!(cell.line.controller.state(), State::Tracking);
        cell
    }

    /// One step of time: lay, report, measure, command.
    fn step(&mut self) -> State {
        self.line.now += STEP_S;
        self.laid += SPEED * STEP_S;
        self.clock_ms += if self.clock_stands { 0 } else { 50 };
        let path = self.laid + self.jump;
        let step = self.line.robot_at(Some(self.clock_ms), RobotMode::Print, path, SPEED);
        self.ignored += usize::from(step.trace.report_ignored);
        let _ = self.line.width(42.0);
        let _ = self.line.tick();
        self.line.controller.state()
    }

    /// The states until a time.
    fn until(&mut self, secs: f64) -> Vec<State> {
        let mut states = Vec::new();
        while self.line.now < secs - 1e-9 {
            states.push(self.step());
        }
        states
    }
}

fn jumped(state: &State) -> bool {
    matches!(state, State::Holding(Hold::PathJump { step_mm })
        if (step_mm.get() - (500.0 + SPEED * STEP_S)).abs() < 1e-6)
}

#[test]
fn a_path_that_jumps_is_a_hold_until_bead_laid_after_it_is_seen() {
    for setup in [setup(), by_distance()] {
        let mut cell = Cell::tracking(setup);
        cell.jump = 500.0;
        let states = cell.until(6.0);
        let held = states.iter().take_while(|state| jumped(state)).count();
        // 88.4 mm at 112.5 mm/s, and three widths.
        let expected = 88.4 / SPEED + 3.0 * STEP_S;
        let lasted = STEP_S * f64::from(u32::try_from(held).unwrap());
        assert!((lasted - expected).abs() < 2.0 * STEP_S, "{lasted} {expected}");
        assert!(states[held..].iter().all(|state| *state == State::Tracking), "{states:?}");
    }
}

#[test]
fn a_width_is_located_from_where_the_path_went_on() {
    let mut cell = Cell::tracking(setup());
    cell.jump = 500.0;
    let _ = cell.step();
    let step = cell.line.width(42.0);
    assert!(!step.trace.bead_expected);
    let path = step.trace.nozzle_path_mm.unwrap().get();
    assert!((path - (cell.laid + 500.0)).abs() < 1e-6);
}

#[test]
fn a_path_that_jumps_again_and_again_is_a_fault() {
    let mut cell = Cell::tracking(setup());
    let mut states = Vec::new();
    for _ in 0..12 {
        cell.jump += 500.0;
        states.extend(cell.until(cell.line.now + 0.5));
    }
    assert!(!states.contains(&State::Tracking));
    assert!(matches!(states.last(), Some(State::Fault(Fault::HeldTooLong(Hold::PathJump { .. })))));
}

#[test]
fn reports_that_are_delayed_or_coarse_are_no_jump() {
    let mut line = Line::tracking();
    // The path in steps of 15 mm.
    for k in 1..=40_u32 {
        line.now += 0.02;
        let path = 225.0 + f64::from(k) * 0.02 * SPEED;
        let coarse = (path / 15.0).floor() * 15.0;
        let ms = Some(u64::from(20 * k));
        let step = line.robot_at(ms, RobotMode::Print, coarse, SPEED);
        assert_eq!(step.state, State::Tracking, "{path}");
        let _ = line.width(42.0);
    }
    // Three reports of every 0.2 s, which were delayed and arrive at once.
    line.now += 0.6;
    for k in 1..=3_u32 {
        line.now += 1e-4;
        let path = 315.0 + f64::from(k) * 0.2 * SPEED;
        let ms = Some(u64::from(800 + 200 * k));
        assert_eq!(line.robot_at(ms, RobotMode::Print, path, SPEED).state, State::Tracking);
    }
}

#[test]
fn the_path_of_another_connection_or_another_bead_is_no_jump() {
    let mut line = Line::tracking();
    let _ = line.robot(RobotMode::Idle, 225.0, 0.0);
    let _ = line.advance(0.1, 900.0, SPEED);
    assert_eq!(line.controller.state(), State::Priming);
    let mut line = Line::tracking();
    let _ = line.give(&Event::LinkDown { reason: "cut".into() });
    let _ = line.link_up(200.0);
    let state = line.advance(0.1, 900.0, SPEED).state;
    assert_eq!(state, State::Holding(Hold::NoWidth));
}

#[test]
fn a_report_whose_clock_does_not_rise_is_not_used() {
    let mut cell = Cell::tracking(setup());
    let before = cell.line.controller.robot.state.unwrap();
    cell.clock_stands = true;
    let states = cell.until(cell.line.now + 0.4);
    assert_eq!(cell.ignored, 8);
    assert_eq!(cell.line.controller.robot.state, Some(before));
    assert!(states.iter().all(|state| *state == State::Tracking));
    cell.clock_stands = false;
    let states = cell.until(cell.line.now + 1.0);
    assert_eq!((cell.ignored, states.contains(&State::Tracking)), (8, true));
    assert_eq!(cell.line.controller.state(), State::Tracking);
}

#[test]
fn a_clock_that_stands_still_is_a_hold_and_then_stops_the_robot() {
    let mut cell = Cell::tracking(setup());
    cell.clock_stands = true;
    let states = cell.until(cell.line.now + 5.0);
    let clock = Hold::RobotClock;
    let held = states.iter().position(|state| *state == State::Holding(clock.clone())).unwrap();
    // After 0.5 s without a report that can be used.
    assert!((10..=11).contains(&held), "{held}");
    assert_eq!(states.last(), Some(&State::Fault(Fault::HeldTooLong(clock))));
    assert_eq!(cell.line.give(&Event::Tick).command, Some(Command::Stop));
}

#[test]
fn a_robot_whose_clock_stands_may_still_report_that_it_has_stopped() {
    let mut cell = Cell::tracking(setup());
    cell.clock_stands = true;
    let _ = cell.step();
    let step = cell.line.robot_at(Some(cell.clock_ms), RobotMode::Fault, cell.laid, 0.0);
    assert_eq!(step.state, State::Fault(Fault::Robot));
}
