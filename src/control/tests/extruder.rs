//! The extruder side through the controller: loss of the link, and successive beads.

use super::*;
use crate::core::{Mm2, Rpm};
use crate::extruder::strategy::{ConstantCommand, Playback};
use crate::extruder::{
    CommandLimits, CommandQuantity, ExtruderCommand, ExtruderFault, ExtruderHold, ExtruderReport,
    ExtruderState, ExtruderStrategy, FlowFollows, PumpMode, RobotFollows,
};
use crate::extruder::{ExtruderSetup, FlowDemand};
use crate::identify::command_profile::{CommandProfile, ProfilePoint};

const TICK_S: f64 = 0.005;
const SPEED: f64 = 112.5;

fn test_bench(strategy: ExtruderStrategy) -> (ExtruderSetup, FlowDemand) {
    let setup = ExtruderSetup {
        quantity: CommandQuantity::Rpm,
        strategy,
        limits: CommandLimits::new(0.0, 60.0, 400.0).unwrap(),
        feedforward_period: Span::from_secs(TICK_S),
        control_period: Span::from_millis(50),
        io_period: Span::from_millis(20),
        command_valid: Span::from_millis(300),
        max_gap: Span::from_millis(200),
        max_hold: Span::from_secs(1.0),
        max_pressure: None,
        filters: crate::extruder::ReadingFilters::default(),
        robot_follows: RobotFollows::Nothing,
        timing: None,
        plan: None,
    };
    let demand = FlowDemand::new(Mm2::constant(10.0), MmPerS::constant(SPEED), FlowFollows::Robot);
    (setup, demand)
}

/// A robot that prints or stands, and an extruder that follows its command.
struct Cell {
    line: Line,
    mode: RobotMode,
    path: f64,
    ticks: u32,
    link: bool,
    command: Option<ExtruderCommand>,
    sent: Vec<(f64, ExtruderCommand)>,
}

impl Cell {
    fn new(strategy: ExtruderStrategy) -> Self {
        let mut line = Line::new();
        let (setup, demand) = test_bench(strategy);
        line.controller = line.controller.with_extruder(setup, demand);
        let mut cell = Self {
            line,
            mode: RobotMode::Idle,
            path: 0.0,
            ticks: 0,
            link: false,
            command: None,
            sent: Vec::new(),
        };
        cell.link(true);
        cell
    }

    fn link(&mut self, up: bool) {
        self.link = up;
        let down = Event::ExtruderDown { reason: "no STATE for 500 ms".into() };
        let event = if up { Event::ExtruderUp } else { down };
        assert!(self.line.give(&event).extruder.unwrap().command.is_none());
    }

    /// Advances time; returns the state of the extruder side.
    fn go(&mut self, secs: f64) -> ExtruderState {
        let until = self.line.now + secs - 1e-9;
        let mut state = ExtruderState::Off;
        while self.line.now < until {
            if self.ticks.is_multiple_of(4) {
                let speed = if self.mode == RobotMode::Print { SPEED } else { 0.0 };
                let _ = self.line.robot(self.mode, self.path, speed);
                if self.link {
                    let report = self.report();
                    let _ = self.line.give(&Event::Extruder(report));
                }
            }
            let side = self.line.give(&Event::ExtruderTick).extruder.unwrap();
            state = side.state;
            if let Some(command) = side.command {
                assert!(self.link, "a command without a link");
                self.command = Some(command);
                self.sent.push((self.line.now, command));
            }
            self.ticks += 1;
            self.line.now += TICK_S;
            if self.mode == RobotMode::Print {
                self.path += SPEED * TICK_S;
            }
        }
        state
    }

    fn report(&self) -> ExtruderReport {
        let on = self.command.filter(|command| command.pump_on);
        ExtruderReport {
            pump: if on.is_some() { PumpMode::On } else { PumpMode::Off },
            valve_open: self.command.is_some_and(|command| command.valve_open),
            screw_rpm: Rpm::new(on.map_or(0.0, |command| command.value)).ok(),
            pressure_mpa: None,
            flow_mm3_per_s: None,
            filled_mm: None,
        }
    }

    fn last(&self) -> ExtruderCommand {
        self.command.unwrap()
    }
}

#[test]
fn a_lost_extruder_is_held_while_the_robot_goes_on() {
    let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    cell.mode = RobotMode::Print;
    assert_eq!(cell.go(1.0), ExtruderState::Running);
    cell.link(false);
    assert_eq!(cell.go(0.8), ExtruderState::Holding(ExtruderHold::LinkDown));
    assert_eq!(cell.line.tick(), Some(SPEED));
    cell.link(true);
    assert_eq!(cell.go(0.2), ExtruderState::Running);
    assert_eq!(cell.last(), ExtruderCommand { pump_on: true, valve_open: true, value: 30.0 });
}

#[test]
fn a_pump_stops_with_a_robot_that_is_silent() {
    let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    cell.mode = RobotMode::Print;
    assert_eq!(cell.go(1.0), ExtruderState::Running);
    let _ = cell.line.give(&Event::LinkDown { reason: "no STATE for 500 ms".into() });
    let mut state = ExtruderState::Running;
    for _ in 0..340 {
        assert!(cell.last().pump_on || cell.line.now > 1.0 + 1.59);
        let report = cell.report();
        let _ = cell.line.give(&Event::Extruder(report));
        let side = cell.line.give(&Event::ExtruderTick).extruder.unwrap();
        state = side.state;
        cell.command = side.command.or(cell.command);
        cell.line.now += TICK_S;
    }
    assert_eq!(state, ExtruderState::Off);
    assert!(!cell.last().pump_on && !cell.last().valve_open);
}

#[test]
fn a_lost_extruder_stops_the_robot_and_is_stopped_when_it_returns() {
    let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    cell.mode = RobotMode::Print;
    let _ = cell.go(1.0);
    cell.link(false);
    let fault = ExtruderFault::HeldTooLong(ExtruderHold::LinkDown);
    assert_eq!(cell.go(1.1), ExtruderState::Fault(fault));
    assert_eq!(cell.line.controller.state(), State::Fault(Fault::Extruder(fault)));
    assert_eq!(cell.line.give(&Event::Tick).command, Some(Command::Stop));
    cell.link(true);
    assert_eq!(cell.go(0.1), ExtruderState::Fault(fault));
    assert!(!cell.last().pump_on && !cell.last().valve_open);
    // The robot's idleness ends the fault on both sides.
    cell.mode = RobotMode::Idle;
    assert_eq!(cell.go(0.1), ExtruderState::Off);
    (cell.mode, cell.path) = (RobotMode::Print, 0.0);
    assert_eq!(cell.go(0.5), ExtruderState::Running);
}

#[test]
fn every_bead_restarts_the_profile() {
    let at = |from_s, value| ProfilePoint { from_s, value };
    let profile = CommandProfile::new(vec![at(0.0, 20.0), at(0.5, 50.0)], 2.0).unwrap();
    let mut cell = Cell::new(ExtruderStrategy::Profile(Playback::new(profile)));
    for _ in 0..3 {
        (cell.mode, cell.path) = (RobotMode::Print, 0.0);
        let sent = cell.sent.len();
        assert_eq!(cell.go(1.0), ExtruderState::Running);
        assert_eq!(cell.sent[sent].1.value, 20.0);
        assert_eq!(cell.last().value, 50.0);
        cell.mode = RobotMode::Idle;
        assert_eq!(cell.go(0.5), ExtruderState::Off);
        assert_eq!(cell.last(), ExtruderCommand { pump_on: false, valve_open: false, value: 0.0 });
    }
}

#[test]
fn a_bead_right_behind_another_keeps_the_pump_running() {
    let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    cell.mode = RobotMode::Print;
    let _ = cell.go(1.0);
    let sent = cell.sent.len();
    cell.path = 0.0;
    assert_eq!(cell.go(1.0), ExtruderState::Running);
    assert!(cell.sent[sent..].iter().all(|(_, command)| command.pump_on));
}

/// A bead of 1 m and one of 500 mm, both half as fast from the middle of the longer one on.
const PLAN: &str = "\
bead,time_s,path_mm,speed_mm_per_s,command_rpm,flow_mm3_per_s
1,0,0,112.5,30,1125
1,4.4,495,112.5,30,1125
1,4.5,503.4375,56.25,15,562.5
1,13.3277778,1000,56.25,15,562.5
2,0,0,112.5,30,1125
2,4.44444,500,112.5,30,1125
";

fn planned() -> Cell {
    let (setup, demand) = test_bench(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    let plan = Some(std::sync::Arc::new(crate::extruder::trajectory::read(PLAN).unwrap()));
    let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    // The test moves the robot at once, so its speed may jump too.
    let limits = SpeedLimits {
        min_speed: MmPerS::constant(10.0),
        max_accel: MmPerS2::constant(1e5),
        ..super::setup().limits
    };
    cell.line = Line::of(Setup { limits, ..super::setup() });
    cell.line.controller =
        cell.line.controller.with_extruder(ExtruderSetup { plan, ..setup }, demand);
    cell.mode = RobotMode::Print;
    cell
}

#[test]
fn a_hold_follows_the_plan_and_keeps_the_width_controllers_ratio() {
    let mut cell = planned();
    let _ = cell.go(2.0);
    // Too wide: the controller raises the speed.
    let mut requested = cell.line.tick().unwrap();
    for _ in 0..6 {
        let _ = cell.line.width(46.0);
        requested = cell.line.tick().unwrap();
        let _ = cell.go(0.05);
    }
    assert!(requested > SPEED * 1.03, "{requested}");
    let lost = Event::CameraLost { reason: "unplugged".into() };
    assert!(matches!(cell.line.give(&lost).state, State::Holding(_)));
    let held = cell.line.tick().unwrap();
    assert!((held / requested - 1.0).abs() < 1e-6, "{held} after {requested}");
    // After the plan's step, still held.
    cell.path = 550.0;
    let _ = cell.go(0.02);
    let slowed = cell.line.tick().unwrap();
    assert!(matches!(cell.line.controller.state(), State::Holding(_)));
    assert!((slowed / (requested / 2.0) - 1.0).abs() < 1e-6, "{slowed} after {requested}");
}

#[test]
fn an_interrupted_bead_is_planned_again_and_a_complete_one_is_not() {
    let mut cell = planned();
    let halfway = |cell: &mut Cell| {
        (cell.mode, cell.path) = (RobotMode::Print, 0.0);
        let _ = cell.go(0.02);
        cell.path = 600.0;
        let _ = cell.go(0.02);
        cell.line.tick().unwrap()
    };
    let rest = |cell: &mut Cell| {
        cell.mode = RobotMode::Idle;
        let _ = cell.go(0.1);
    };
    for _ in 0..2 {
        assert!((halfway(&mut cell) - SPEED / 2.0).abs() < 1e-3);
        rest(&mut cell);
    }
    let _ = halfway(&mut cell);
    cell.path = 995.0;
    let _ = cell.go(0.02);
    rest(&mut cell);
    // The second bead's plan is at its end there, and slows down nowhere.
    assert!((halfway(&mut cell) - SPEED).abs() < 1e-3);
}

#[test]
fn a_bead_that_begins_while_the_link_is_down_is_the_next_of_the_plan() {
    let mut cell = planned();
    cell.path = 995.0;
    let _ = cell.go(0.02);
    // As it would be had the bead begun at 0.
    cell.mode = RobotMode::Idle;
    let _ = cell.go(0.02);
    (cell.mode, cell.path) = (RobotMode::Print, 0.0);
    let _ = cell.go(0.02);
    cell.path = 995.0;
    let _ = cell.go(0.02);
    assert!((cell.line.tick().unwrap() - SPEED / 2.0).abs() < 1e-3);
    let _ = cell.line.give(&Event::LinkDown { reason: "no STATE for 500 ms".into() });
    cell.line.now += 1.0;
    let _ = cell.line.link_up(200.0);
    cell.path = 20.0;
    let _ = cell.go(0.02);
    cell.path = 600.0;
    let _ = cell.go(0.02);
    // The second bead's plan slows down nowhere.
    assert!((cell.line.tick().unwrap() - SPEED).abs() < 1e-3);
}

#[test]
fn a_pump_stops_by_the_last_report_of_the_robot_whatever_was_held_before() {
    // Held for a lost camera when the link is lost, and for missing widths long before.
    for lost_before in [Some(Event::CameraLost { reason: "unplugged".into() }), None] {
        let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
        cell.mode = RobotMode::Print;
        assert_eq!(cell.go(2.0), ExtruderState::Running);
        let _ = cell.line.width(42.0);
        if let Some(lost) = &lost_before {
            let _ = cell.line.give(lost);
        }
        let _ = cell.line.tick();
        let _ = cell.go(2.0);
        let _ = cell.line.tick();
        assert!(matches!(cell.line.controller.state(), State::Holding(_)));
        let _ = cell.line.give(&Event::LinkDown { reason: "no STATE for 500 ms".into() });
        let gone = cell.line.now;
        while cell.line.now < gone + 1.7 {
            let report = cell.report();
            let _ = cell.line.give(&Event::Extruder(report));
            let side = cell.line.give(&Event::ExtruderTick).extruder.unwrap();
            cell.command = side.command.or(cell.command);
            let alone_s = cell.line.now - gone;
            assert!(cell.last().pump_on || alone_s > 1.55, "{lost_before:?}: {alone_s}");
            cell.line.now += TICK_S;
        }
        assert!(!cell.last().pump_on, "{lost_before:?}");
    }
}

/// Lays bead until the width is tracked.
fn tracking() -> Cell {
    let mut cell = Cell::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    cell.mode = RobotMode::Print;
    let _ = cell.go(3.0);
    assert_eq!(cell.line.width(42.0).state, State::Tracking);
    let _ = cell.line.tick();
    cell
}

#[test]
fn the_width_is_not_controlled_once_the_last_command_of_a_silent_extruder_has_run_out() {
    let mut cell = tracking();
    cell.link(false);
    let _ = cell.go(0.25);
    assert_eq!(cell.line.controller.state(), State::Tracking);
    let _ = cell.go(0.1);
    let silent = State::Holding(Hold::ExtruderSilent);
    assert_eq!(cell.line.controller.state(), silent);
    // Widths, here far too large, do not change the speed any more.
    let speed = cell.line.tick().unwrap();
    for _ in 0..5 {
        assert_eq!(cell.line.width(50.0).state, silent);
        assert_eq!(cell.line.tick(), Some(speed));
        let _ = cell.go(0.05);
    }
    // The longest hold of the extruder, 1 s, counts from when its link was lost.
    let _ = cell.go(0.5);
    let fault = Fault::Extruder(ExtruderFault::HeldTooLong(ExtruderHold::LinkDown));
    assert_eq!(cell.line.controller.state(), State::Fault(fault));
    assert_eq!(cell.line.give(&Event::Tick).command, Some(Command::Stop));
}

#[test]
fn control_goes_on_with_bead_that_was_laid_after_a_silent_extruder_came_back() {
    let mut cell = tracking();
    cell.link(false);
    let _ = cell.go(0.6);
    assert_eq!(cell.line.controller.state(), State::Holding(Hold::ExtruderSilent));
    cell.link(true);
    let _ = cell.go(0.1);
    let back = cell.path;
    let mut tracked = None;
    while tracked.is_none() && cell.path < back + 300.0 {
        let _ = cell.go(0.02);
        let state = cell.line.width(42.0).state;
        tracked = (state == State::Tracking).then_some(cell.path - back);
    }
    // The camera is 88.4 mm behind the nozzle.
    let tracked = tracked.unwrap();
    assert!((70.0..110.0).contains(&tracked), "{tracked}");
}
