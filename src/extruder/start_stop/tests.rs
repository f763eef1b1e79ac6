#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::core::{Mm3PerS, MmPerS, Span};

const MACHINE: StartStop = StartStop {
    first_flow_s: 0.2,
    rise_s: 0.25,
    void_mm3: 600.0,
    idle_time_constant_s: 20.0,
    stop_s: 0.15,
    fall_s: 0.2,
    drool_s: 0.1,
    drool_time_constant_s: 0.8,
};

fn timing(min_speed_ratio: f64) -> StartStopTiming {
    let (flow, speed) = (Mm3PerS::constant(400.0), MmPerS::constant(40.0));
    StartStopTiming::new(
        MACHINE,
        BeadConditions { flow, speed, min_speed_ratio, robot_lag: Span::ZERO },
    )
    .unwrap()
}

fn pause(idle_s: f64) -> Pause {
    Pause { idle: Span::from_secs(idle_s), flow_before: Mm3PerS::constant(400.0) }
}

/// Integral of a function over a time [s].
fn integral(to_s: f64, f: impl Fn(f64) -> f64) -> f64 {
    let steps = 20_000_u32;
    let dt = to_s / f64::from(steps);
    (0..steps).map(|k| f((f64::from(k) + 0.5) * dt) * dt).sum()
}

#[test]
fn the_delay_of_the_first_flow_grows_with_the_pause_up_to_the_whole_void() {
    assert_eq!(MACHINE.delay_s(0.0, 400.0), 0.2);
    let one = MACHINE.delay_s(20.0, 400.0);
    assert!((one - 0.2 - 1.5 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12);
    assert!((MACHINE.delay_s(1e5, 400.0) - 1.7).abs() < 1e-12);
    // Twice the flow fills the void in half the time.
    assert!((MACHINE.delay_s(1e5, 800.0) - 0.95).abs() < 1e-12);
}

#[test]
fn the_volume_after_a_stop_is_the_integral_of_the_flow() {
    for t in [0.1, 0.4, 2.0, 9.0] {
        let summed = integral(t, |at| MACHINE.remaining_flow(at));
        assert!((MACHINE.delivered_s(t) - summed).abs() < 1e-7, "{t}");
    }
    assert!((MACHINE.total_after_stop_s() - MACHINE.delivered_s(60.0)).abs() < 1e-12);
    for fraction in [0.9, 0.5, 0.05, 1e-3] {
        assert!((MACHINE.remaining_flow(MACHINE.falls_to_s(fraction)) - fraction).abs() < 1e-9);
    }
}

/// Void plus surplus of a start at which the robot goes at a moment [s of flow].
fn lost_at_start(start: &Start, goes_s: f64, fraction: impl Fn(f64) -> f64) -> f64 {
    integral(6.0, |t| {
        let wanted = if t < goes_s { 0.0 } else { fraction(t) };
        (wanted - start.flow_ratio(Span::from_secs(t))).abs()
    })
}

#[test]
fn the_start_time_minimises_void_plus_surplus() {
    for idle in [0.0, 2.0, 40.0, 300.0] {
        let start = timing(1.0).start(&pause(idle));
        let best = lost_at_start(&start, start.robot_start().secs(), |_| 1.0);
        for other in [-0.3, -0.05, 0.05, 0.3] {
            let goes_s = (start.robot_start().secs() + other).max(0.0);
            assert!(lost_at_start(&start, goes_s, |_| 1.0) >= best - 1e-3, "{idle} {other}");
        }
    }
}

#[test]
fn a_robot_that_follows_the_flow_leaves_a_tenth() {
    let start = timing(0.1).start(&pause(300.0));
    let fraction = |t: f64| start.speed_ratio(Span::from_secs(t));
    let following = lost_at_start(&start, start.robot_start().secs(), fraction);
    let steady = timing(1.0).start(&pause(300.0));
    let keeping = lost_at_start(&steady, steady.robot_start().secs(), |_| 1.0);
    assert!(following < 0.11 * keeping, "{following} {keeping}");
}

#[test]
fn the_flow_after_a_stop_fills_the_rest_of_the_bead() {
    for min_speed_ratio in [1.0, 0.3, 0.05] {
        let stop = timing(min_speed_ratio).stop();
        let lasts = MACHINE.falls_to_s(0.5 * min_speed_ratio);
        let way = integral(lasts, |t| 40.0 * stop.speed_ratio(Span::from_secs(t)));
        assert!((way - stop.distance().get()).abs() < 1e-3, "{way} {}", stop.distance());
        let end = stop.flow_ratio(Span::from_secs(lasts));
        assert!((end - 0.5 * min_speed_ratio).abs() < 1e-6);
        // The volume of the distance, less the void before its end, plus the drool is all.
        let void = integral(lasts, |t| {
            let since = Span::from_secs(t);
            400.0 * (stop.speed_ratio(since) - stop.flow_ratio(since))
        });
        let laid = 10.0 * stop.distance().get() - void;
        let all = 400.0 * MACHINE.total_after_stop_s();
        let drool = all - 400.0 * MACHINE.delivered_s(lasts);
        assert!((laid + drool - all).abs() < 0.05, "{laid} {all}");
    }
}

#[test]
fn setpoints_lead_by_the_lag_of_the_robot() {
    let lag = Span::from_millis(80);
    let prompt = timing(0.2);
    let late =
        StartStopTiming::new(MACHINE, BeadConditions { robot_lag: lag, ..*prompt.conditions() })
            .unwrap();
    let [prompt_start, late_start] = [prompt, late].map(|timing| timing.start(&pause(30.0)));
    assert_eq!(late_start.robot_start() + lag, prompt_start.robot_start());
    for ms in [700, 1500, 2500] {
        let at = prompt_start.robot_start() + Span::from_millis(ms);
        assert_eq!(late_start.speed_ratio(at - lag), prompt_start.speed_ratio(at));
        let at = Span::from_millis(ms);
        assert_eq!(late.stop().speed_ratio(at - lag), prompt.stop().speed_ratio(at));
    }
    assert_eq!(late.stop().distance(), prompt.stop().distance());
}

#[test]
fn after_a_short_pause_the_robot_does_not_wait() {
    let start = timing(0.1).start(&pause(0.0));
    assert_eq!(start.robot_start(), Span::ZERO);
    assert_eq!(start.flow_ratio(Span::ZERO), 1.0);
    assert!(start.flow_ratio(Span::from_secs(0.3)) > 0.7);
}

#[test]
fn parameters_out_of_range_are_refused() {
    let laid = *timing(1.0).conditions();
    let said = |parameters: StartStop, laid: BeadConditions| {
        StartStopTiming::new(parameters, laid).unwrap_err()
    };
    let error = said(StartStop { rise_s: 0.0, ..MACHINE }, laid);
    assert_eq!(
        error.to_string(),
        "the time constant of the rise [s] is 0; it must be a finite number above zero"
    );
    let error = said(StartStop { void_mm3: f64::NAN, ..MACHINE }, laid);
    assert!(matches!(error, StartStopError::Negative { what: "the void [mm³]", .. }));
    let error = said(StartStop { drool_s: 0.9, ..MACHINE }, laid);
    assert_eq!(error, StartStopError::TooMuchDrool { drool_s: 0.9, time_constant_s: 0.8 });
    let error = said(MACHINE, BeadConditions { min_speed_ratio: 1.5, ..laid });
    assert_eq!(error, StartStopError::StartSpeedFraction { value: 1.5 });
    let error = said(MACHINE, BeadConditions { flow: Mm3PerS::ZERO, ..laid });
    assert!(matches!(error, StartStopError::NotPositive { .. }));
}
