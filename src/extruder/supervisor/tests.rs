use super::*;
use crate::core::Rpm;
use crate::extruder::strategy::{ConstantCommand, Playback};
use crate::extruder::{ExtruderFault, ExtruderHold, PumpMode};
use crate::identify::command_profile::{CommandProfile, ProfilePoint};

const TICK: Span = Span::from_millis(5);
const FLOW: Mm3PerS = Mm3PerS::constant(500.0);

fn setup(controller: ExtruderStrategy) -> ExtruderSetup {
    ExtruderSetup {
        quantity: CommandQuantity::Rpm,
        strategy: controller,
        limits: CommandLimits::new(0.0, 60.0, 40.0).unwrap(),
        feedforward_period: TICK,
        control_period: Span::from_millis(50),
        io_period: Span::from_millis(20),
        command_valid: Span::from_millis(300),
        max_gap: Span::from_millis(200),
        max_hold: Span::from_secs(1.0),
        max_pressure: Some(MPa::constant(2.0)),
        filters: ReadingFilters::default(),
        robot_follows: RobotFollows::Nothing,
        timing: None,
        plan: None,
    }
}

fn report(pump: PumpMode, rpm: f64) -> ExtruderReport {
    ExtruderReport {
        pump,
        valve_open: true,
        screw_rpm: Some(Rpm::constant(rpm)),
        pressure_mpa: Some(MPa::constant(0.6)),
        flow_mm3_per_s: None,
        filled_mm: None,
    }
}

/// A supervisor that is ticked at 200 Hz and reported to at 50 Hz.
struct Bench {
    side: Supervisor,
    ticks: u32,
    laying: Laying,
    report: Option<ExtruderReport>,
    sent: Vec<(f64, ExtruderCommand)>,
}

impl Bench {
    fn new(controller: ExtruderStrategy) -> Self {
        let mut side = Supervisor::new(setup(controller));
        side.link_came_up();
        let report = Some(report(PumpMode::On, 30.0));
        Self { side, ticks: 0, laying: Laying::Bead(FLOW), report, sent: Vec::new() }
    }

    fn go(&mut self, secs: f64) -> ExtruderState {
        let until = f64::from(self.ticks) * TICK.secs() + secs;
        loop {
            let now = Stamp::from_secs(f64::from(self.ticks) * TICK.secs());
            if now.secs() >= until - 1e-9 {
                return self.side.state();
            }
            if self.ticks.is_multiple_of(4)
                && let Some(report) = self.report
            {
                self.side.reported(now, &report);
            }
            let command = self.side.tick(now, self.laying);
            self.sent.extend(command.map(|command| (now.secs(), command)));
            self.ticks += 1;
        }
    }

    fn last(&self) -> ExtruderCommand {
        self.sent.last().unwrap().1
    }
}

#[test]
fn commands_go_out_at_the_rate_of_the_link_while_bead_is_laid() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    assert_eq!(bench.go(1.0), ExtruderState::Running);
    assert_eq!(bench.sent.len(), 50);
    let on = ExtruderCommand { pump_on: true, valve_open: true, value: 30.0 };
    assert!(bench.sent.iter().all(|(_, command)| *command == on));
    bench.laying = Laying::Stopped;
    assert_eq!(bench.go(0.005), ExtruderState::Off);
    assert_eq!(bench.last(), ExtruderCommand { pump_on: false, valve_open: false, value: 0.0 });
}

#[test]
fn a_pump_that_does_not_start_is_a_fault_and_one_that_does_is_waited_for() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.report = Some(report(PumpMode::Starting, 0.0));
    assert_eq!(bench.go(0.6), ExtruderState::Starting);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    let mut stuck = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    stuck.report = Some(report(PumpMode::Starting, 0.0));
    assert_eq!(stuck.go(1.1), ExtruderState::Fault(ExtruderFault::DidNotStart));
    assert!(!stuck.last().pump_on);
}

#[test]
fn missing_reports_are_a_hold_then_a_fault() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.report = None;
    assert_eq!(bench.go(0.15), ExtruderState::Running);
    assert_eq!(bench.go(0.15), ExtruderState::Holding(ExtruderHold::NoReading));
    assert!(bench.last().pump_on);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    bench.report = None;
    bench.go(1.5);
    let fault = ExtruderFault::HeldTooLong(ExtruderHold::NoReading);
    assert_eq!(bench.side.state(), ExtruderState::Fault(fault));
    assert!(!bench.last().pump_on && !bench.last().valve_open);
}

#[test]
fn a_fault_stays_until_the_robot_is_idle() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.report = Some(report(PumpMode::Fault, 0.0));
    assert_eq!(bench.go(0.1), ExtruderState::Fault(ExtruderFault::Pump));
    bench.report = Some(report(PumpMode::Off, 0.0));
    assert_eq!(bench.go(1.0), ExtruderState::Fault(ExtruderFault::Pump));
    bench.laying = Laying::Stopped;
    assert_eq!(bench.go(0.1), ExtruderState::Fault(ExtruderFault::Pump));
    bench.laying = Laying::Idle;
    assert_eq!(bench.go(0.1), ExtruderState::Off);
    bench.laying = Laying::Bead(FLOW);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
}

#[test]
fn a_bead_without_reports_is_a_fault_within_the_longest_gap() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.report = None;
    assert_eq!(bench.go(0.15), ExtruderState::Starting);
    assert_eq!(bench.go(0.1), ExtruderState::Fault(ExtruderFault::NoAnswer));
    // An extruder that reported before the bead and not since.
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.laying = Laying::Idle;
    bench.report = Some(report(PumpMode::Off, 0.0));
    bench.go(0.5);
    bench.report = None;
    bench.go(2.0);
    bench.laying = Laying::Bead(FLOW);
    assert_eq!(bench.go(0.25), ExtruderState::Fault(ExtruderFault::NoAnswer));
}

#[test]
fn a_pump_that_runs_on_keeps_the_first_fault() {
    let high = |pump, mpa| {
        Some(ExtruderReport { pressure_mpa: Some(MPa::constant(mpa)), ..report(pump, 30.0) })
    };
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.report = high(PumpMode::On, 2.1);
    let stopped = ExtruderState::Fault(ExtruderFault::Overpressure);
    assert_eq!(bench.go(0.5), stopped);
    bench.laying = Laying::Stopped;
    assert_eq!(bench.go(1.0), ExtruderState::Fault(ExtruderFault::RunsOn));
    bench.report = high(PumpMode::Stopping, 1.0);
    assert_eq!(bench.go(0.1), stopped);
    bench.laying = Laying::Idle;
    assert_eq!(bench.go(0.1), ExtruderState::Off);
    // A pump that runs on at rest does not press against a closed valve.
    bench.report = high(PumpMode::On, 2.1);
    bench.go(0.1);
    assert!(bench.last().valve_open && !bench.last().pump_on);
    // A link that comes back does not show that the pump stands.
    bench.side.link_went_down(Stamp::from_secs(9.0));
    assert_eq!(bench.side.state(), ExtruderState::Off);
}

#[test]
fn a_pump_that_runs_on_is_a_fault_until_it_stands() {
    let runs_on = ExtruderState::Fault(ExtruderFault::RunsOn);
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.laying = Laying::Idle;
    assert_eq!(bench.go(0.9), ExtruderState::Off);
    assert_eq!(bench.go(0.3), runs_on);
    // No bead is laid with a pump that does not comply.
    bench.laying = Laying::Bead(FLOW);
    assert_eq!(bench.go(0.5), runs_on);
    assert!(!bench.last().pump_on);
    bench.report = Some(report(PumpMode::Stopping, 5.0));
    bench.laying = Laying::Idle;
    assert_eq!(bench.go(0.1), ExtruderState::Off);
    bench.laying = Laying::Bead(FLOW);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
}

#[test]
fn too_high_a_pressure_stops_the_pump_and_leaves_the_valve_open() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    let mut high = report(PumpMode::On, 30.0);
    high.pressure_mpa = Some(MPa::constant(2.1));
    bench.report = Some(high);
    assert_eq!(bench.go(0.02), ExtruderState::Fault(ExtruderFault::Overpressure));
    assert_eq!(bench.last(), ExtruderCommand { pump_on: false, valve_open: true, value: 0.0 });
}

#[test]
fn a_screw_at_the_wrong_speed_is_a_hold_then_a_fault() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.report = Some(report(PumpMode::On, 25.0));
    assert_eq!(bench.go(0.4), ExtruderState::Running);
    assert_eq!(bench.go(0.3), ExtruderState::Holding(ExtruderHold::SpeedMismatch));
    bench.report = Some(report(PumpMode::On, 29.5));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    bench.report = Some(report(PumpMode::On, 0.0));
    assert_eq!(
        bench.go(2.2),
        ExtruderState::Fault(ExtruderFault::HeldTooLong(ExtruderHold::SpeedMismatch,))
    );
}

#[test]
fn no_command_is_sent_while_the_link_is_down_and_a_long_loss_is_a_fault() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.side.link_went_down(Stamp::from_secs(0.5));
    bench.report = None;
    let sent = bench.sent.len();
    assert_eq!(bench.go(0.5), ExtruderState::Holding(ExtruderHold::LinkDown));
    assert_eq!(bench.sent.len(), sent);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    assert!(bench.sent.len() > sent);
}

#[test]
fn a_profile_is_played_from_the_moment_the_pump_runs_within_the_fastest_change() {
    let at = |from_s, value| ProfilePoint { from_s, value };
    let profile = CommandProfile::new(vec![at(0.0, 10.0), at(0.5, 50.0)], 9.0).unwrap();
    let mut bench = Bench::new(ExtruderStrategy::Profile(Playback::new(profile)));
    bench.report = Some(ExtruderReport { screw_rpm: None, ..report(PumpMode::On, 0.0) });
    bench.go(0.4);
    assert_eq!(bench.last().value, 10.0);
    bench.go(0.4);
    let values: Vec<f64> = bench.sent.iter().map(|(_, command)| command.value).collect();
    assert!(values.windows(2).all(|pair| pair[1] - pair[0] <= 40.0 * 0.02 + 1e-9), "{values:?}");
    bench.go(1.0);
    assert_eq!(bench.last().value, 50.0);
}

#[test]
fn ending_a_run_stops_the_pump_at_once() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    assert!(!bench.side.stop().unwrap().pump_on);
    assert_eq!(bench.side.state(), ExtruderState::Off);
}

#[test]
fn a_valve_that_stays_closed_is_a_hold_then_a_fault() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.report = Some(ExtruderReport { valve_open: false, ..report(PumpMode::On, 30.0) });
    assert_eq!(bench.go(0.1), ExtruderState::Holding(ExtruderHold::ValveShut));
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    bench.report = Some(ExtruderReport { valve_open: false, ..report(PumpMode::On, 30.0) });
    let fault = ExtruderFault::HeldTooLong(ExtruderHold::ValveShut);
    assert_eq!(bench.go(1.2), ExtruderState::Fault(fault));
}

#[test]
fn reports_from_before_the_command_to_run_are_no_fault() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.03);
    assert_eq!(bench.side.state(), ExtruderState::Running);
    bench.report = Some(report(PumpMode::Stopping, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Starting);
    bench.report = Some(report(PumpMode::Starting, 0.0));
    assert_eq!(bench.go(0.3), ExtruderState::Starting);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    bench.report = Some(report(PumpMode::Off, 0.0));
    assert_eq!(bench.go(0.1), ExtruderState::Fault(ExtruderFault::Pump));
}

#[test]
fn a_limit_on_the_pressure_needs_its_reading_and_relieves_until_it_has_fallen() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.go(0.5);
    bench.report = Some(ExtruderReport { pressure_mpa: None, ..report(PumpMode::On, 30.0) });
    assert_eq!(bench.go(0.1), ExtruderState::Holding(ExtruderHold::NoReading));
    bench.report = Some(report(PumpMode::On, 30.0));
    bench.go(0.1);
    let high = ExtruderReport { pressure_mpa: MPa::new(2.5).ok(), ..report(PumpMode::On, 0.0) };
    bench.report = Some(high);
    bench.go(0.1);
    bench.laying = Laying::Idle;
    assert_eq!(bench.go(0.1), ExtruderState::Off);
    assert!(bench.last().valve_open && !bench.last().pump_on);
    bench.report = Some(report(PumpMode::Off, 0.0));
    bench.go(0.1);
    assert!(!bench.last().valve_open);
}

#[test]
fn a_pump_that_restarts_restarts_the_strategy() {
    let at = |from_s, value| ProfilePoint { from_s, value };
    let profile = CommandProfile::new(vec![at(0.0, 20.0), at(0.5, 50.0)], 2.0).unwrap();
    let mut bench = Bench::new(ExtruderStrategy::Profile(Playback::new(profile)));
    bench.report = Some(report(PumpMode::On, 20.0));
    assert_eq!(bench.go(0.3), ExtruderState::Running);
    bench.report = Some(report(PumpMode::Starting, 0.0));
    assert_eq!(bench.go(0.6), ExtruderState::Starting);
    assert_eq!(bench.sent.last().unwrap().1.value, 20.0);
    bench.report = Some(report(PumpMode::On, 20.0));
    assert_eq!(bench.go(0.3), ExtruderState::Running);
    assert_eq!(bench.sent.last().unwrap().1.value, 20.0);
}

#[test]
fn a_relieving_valve_waits_for_a_report_of_a_lower_pressure() {
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    let with = |mpa: Option<f64>| {
        let pressure_mpa = mpa.map(|mpa| MPa::new(mpa).unwrap());
        Some(ExtruderReport { pressure_mpa, ..report(PumpMode::On, 30.0) })
    };
    let _ = bench.go(0.3);
    bench.report = with(Some(2.1));
    assert_eq!(bench.go(0.1), ExtruderState::Fault(ExtruderFault::Overpressure));
    for (mpa, open) in [(None, true), (Some(1.95), true), (Some(1.8), false)] {
        bench.report = with(mpa);
        let _ = bench.go(0.1);
        let last = bench.sent.last().unwrap().1;
        assert_eq!((last.pump_on, last.valve_open), (false, open), "{mpa:?}");
    }
}

mod pause;
