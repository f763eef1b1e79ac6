//! Starts and stops of an extruder with known delays.

use super::*;
use crate::extruder::start_stop::BeadConditions;
use crate::identify::start_stop::parameters::StartStop;

const SPEED: MmPerS = MmPerS::constant(50.0);
const MACHINE: StartStop = StartStop {
    first_flow_s: 0.2,
    rise_s: 0.1,
    void_mm3: 500.0,
    idle_time_constant_s: 20.0,
    stop_s: 0.1,
    fall_s: 0.2,
    drool_s: 0.05,
    drool_time_constant_s: 0.8,
};
const LEAST_SHARE: f64 = 0.1;

fn bench() -> Bench {
    let laid = BeadConditions {
        flow: FLOW,
        speed: SPEED,
        min_speed_ratio: LEAST_SHARE,
        robot_lag: Span::ZERO,
    };
    let timing = Some(StartStopTiming::new(MACHINE, laid).unwrap());
    let setup =
        ExtruderSetup { timing, ..setup(ExtruderStrategy::Constant(ConstantCommand(30.0))) };
    let mut bench = Bench::new(ExtruderStrategy::Constant(ConstantCommand(30.0)));
    bench.side = Supervisor::new(setup);
    bench.side.link_came_up();
    bench
}

#[test]
fn the_robot_waits_for_the_first_flow_and_then_follows_it() {
    let mut bench = bench();
    // The void of a pause of unknown length is filled in one second.
    assert_eq!(bench.go(1.1), ExtruderState::Running);
    assert_eq!(bench.side.robot_speed_ratio(), LEAST_SHARE);
    assert!(bench.side.flow_ratio() < 1e-6);
    bench.go(0.2);
    let fraction = bench.side.flow_ratio();
    assert!((fraction - (1.0 - (-1.0_f64).exp())).abs() < 0.05, "{fraction}");
    assert!((bench.side.robot_speed_ratio() - fraction).abs() < 1e-9);
    let predicted = bench.side.trace().predicted_mm3_per_s.unwrap();
    assert!((predicted / FLOW - fraction).abs() < 1e-9);
    bench.go(0.7);
    assert_eq!((bench.side.robot_speed_ratio(), bench.side.flow_ratio()), (1.0, 1.0));
    assert!(bench.sent.iter().all(|(_, command)| command.value == 30.0 && command.pump_on));
}

#[test]
fn after_a_short_pause_the_robot_hardly_waits() {
    let mut bench = bench();
    bench.go(3.0);
    bench.laying = Laying::Idle;
    bench.report = Some(report(PumpMode::Off, 0.0));
    bench.go(1.0);
    bench.laying = Laying::Bead(FLOW);
    bench.report = Some(report(PumpMode::On, 30.0));
    // V(1 s) = 500·(1 − e^(−1/20)) = 24 mm³, in 0.05 s, after 0.2 s.
    bench.go(0.22);
    assert!(bench.side.flow_ratio() < 0.2);
    bench.go(0.5);
    assert!(bench.side.flow_ratio() > 0.98, "{}", bench.side.flow_ratio());
}

#[test]
fn the_pump_stops_before_the_bead_ends_and_the_valve_stays_open() {
    let mut bench = bench();
    bench.go(3.0);
    let way = bench.side.stop_distance(SPEED).unwrap();
    assert!((4.0..20.0).contains(&way.get()), "{way}");
    let half = bench.side.stop_distance(SPEED * 0.5).unwrap();
    assert!((half.get() - 0.5 * way.get()).abs() < 1e-9);
    bench.laying = Laying::Ending(FLOW);
    assert_eq!(bench.go(0.005), ExtruderState::Ending);
    assert_eq!(bench.last(), ExtruderCommand { pump_on: false, valve_open: true, value: 0.0 });
    bench.report = Some(report(PumpMode::Off, 0.0));
    bench.go(0.3);
    let fraction = bench.side.flow_ratio();
    assert!((0.2..0.6).contains(&fraction), "{fraction}");
    assert_eq!(bench.side.robot_speed_ratio(), fraction);
    bench.go(5.0);
    assert_eq!(bench.side.state(), ExtruderState::Ending);
    assert_eq!(bench.side.robot_speed_ratio(), LEAST_SHARE);
    bench.laying = Laying::Idle;
    assert_eq!(bench.go(0.1), ExtruderState::Off);
    assert_eq!(bench.last(), ExtruderCommand { pump_on: false, valve_open: false, value: 0.0 });
}

#[test]
fn the_next_bead_begins_though_the_robot_was_not_seen_idle() {
    let mut bench = bench();
    bench.go(3.0);
    bench.laying = Laying::Ending(FLOW);
    bench.go(0.005);
    bench.report = Some(report(PumpMode::Off, 0.0));
    bench.go(1.0);
    bench.laying = Laying::Bead(FLOW);
    bench.go(0.005);
    bench.report = Some(report(PumpMode::On, 30.0));
    assert_eq!(bench.go(0.1), ExtruderState::Running);
    assert!(bench.last().pump_on);
    assert!(bench.side.flow_ratio() < 1.0);
}

#[test]
fn faults_are_detected_while_a_bead_ends() {
    let mut bench = bench();
    bench.go(3.0);
    bench.laying = Laying::Ending(FLOW);
    bench.go(1.5);
    assert_eq!(bench.side.state(), ExtruderState::Fault(ExtruderFault::RunsOn));
    let mut bench = self::bench();
    bench.go(3.0);
    bench.laying = Laying::Ending(FLOW);
    bench.go(0.005);
    let high = MPa::constant(2.5);
    bench.report =
        Some(ExtruderReport { pressure_mpa: Some(high), ..report(PumpMode::Stopping, 0.0) });
    assert_eq!(bench.go(0.1), ExtruderState::Fault(ExtruderFault::Overpressure));
    // A pump that faulted does not come back because the bead ends.
    assert_eq!(bench.go(0.5), ExtruderState::Fault(ExtruderFault::Overpressure));
}
