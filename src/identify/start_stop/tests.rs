#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::core::{Mm3PerS, MmPerS, Span};
use crate::extruder::start_stop::{BeadConditions, Pause, StartStopTiming};

const MACHINE: StartStop = StartStop {
    first_flow_s: 0.2,
    rise_s: 0.25,
    void_mm3: 600.0,
    idle_time_constant_s: 20.0,
    stop_s: 0.15,
    fall_s: 0.2,
    drool_s: 0.15,
    drool_time_constant_s: 1.0,
};
const PAUSES_S: [f64; 8] = [30.0, 2.0, 8.0, 60.0, 200.0, 1.0, 15.0, 120.0];
const RUNS_S: f64 = 5.0;
const STEP_S: f64 = 0.02;

/// The fraction of the flow that runs of 5 s with pauses between them give, by the model itself.
fn recording(machine: StartStop, pauses_s: &[f64]) -> [TimeSeries; 2] {
    let (flow, speed) = (Mm3PerS::constant(400.0), MmPerS::constant(40.0));
    let laid = BeadConditions { flow, speed, min_speed_ratio: 1.0, robot_lag: Span::ZERO };
    let timing = StartStopTiming::new(machine, laid).unwrap();
    let mut command = TimeSeries::new("command_rpm", true);
    let mut seen = TimeSeries::new("flow_mm3_per_s", false);
    command.push(0.0, 40.0);
    let mut from_s = 0.0;
    let mut log = |from_s: f64, lasts_s: f64, fraction: &dyn Fn(Span) -> f64| {
        let mut at = 0.0;
        while at < lasts_s {
            seen.push(from_s + at, 400.0 * fraction(Span::from_secs(at)));
            at += STEP_S;
        }
    };
    log(0.0, RUNS_S, &|_| 1.0);
    from_s += RUNS_S;
    for idle_s in pauses_s {
        command.push(from_s, 0.0);
        log(from_s, *idle_s, &|since| timing.stop().flow_ratio(since));
        from_s += idle_s;
        command.push(from_s, 40.0);
        let start = timing.start(&Pause { idle: Span::from_secs(*idle_s), flow_before: flow });
        log(from_s, RUNS_S, &|since| start.flow_ratio(since));
        from_s += RUNS_S;
    }
    [command, seen]
}

fn refused(machine: StartStop, pauses_s: &[f64]) -> StartStopFitError {
    let [command, flow] = recording(machine, pauses_s);
    fit(&command, &flow).unwrap_err()
}

#[test]
fn the_parameters_of_a_recording_without_noise_are_found_again() {
    let [command, flow] = recording(MACHINE, &PAUSES_S);
    let fit = fit(&command, &flow).unwrap();
    let found = fit.parameters;
    for (found, wanted, within) in [
        (found.first_flow_s, 0.2, 0.01),
        (found.rise_s, 0.25, 0.01),
        (found.void_mm3, 600.0, 6.0),
        (found.idle_time_constant_s, 20.0, 0.4),
        (found.stop_s, 0.15, 0.005),
        (found.fall_s, 0.2, 0.005),
        (found.drool_s, 0.15, 0.01),
        (found.drool_time_constant_s, 1.0, 0.05),
    ] {
        assert!((found - wanted).abs() < within, "{found} {wanted} {fit:?}");
    }
    assert_eq!((fit.starts.len(), fit.stops.len()), (8, 8));
    assert!(fit.starts.iter().all(|start| (start.delay_s - start.modelled_s).abs() < 0.01));
    let came = 400.0 * MACHINE.total_after_stop_s();
    let longest = fit.stops.iter().find(|stop| stop.observed_s > 5.9).unwrap();
    assert!((longest.volume_mm3 - came).abs() < 8.0, "{} {came}", longest.volume_mm3);
}

#[test]
fn a_flow_that_does_not_drool_is_found_as_well() {
    let machine = StartStop { drool_s: 0.0, ..MACHINE };
    let [command, flow] = recording(machine, &PAUSES_S);
    let found = fit(&command, &flow).unwrap().parameters;
    assert_eq!(found.check(), Ok(()));
    for at_s in [0.1, 0.2, 0.3, 0.5, 1.0, 3.0] {
        assert!(
            (found.remaining_flow(at_s) - machine.remaining_flow(at_s)).abs() < 0.01,
            "{at_s} {found:?}"
        );
    }
}

#[test]
fn the_unit_of_the_command_does_not_matter() {
    let [mut command, flow] = recording(MACHINE, &PAUSES_S);
    let before = fit(&command, &flow).unwrap();
    command.values.iter_mut().for_each(|value| *value *= 0.03);
    assert_eq!(fit(&command, &flow).unwrap(), before);
}

#[test]
fn pauses_that_do_not_determine_the_void_are_refused() {
    use StartStopFitError as Error;
    assert_eq!(
        refused(MACHINE, &[10.0, 20.0]),
        Error::TooFewStarts { found: 2, needed: 5, left_out: 1 }
    );
    let error = refused(MACHINE, &[10.0, 12.0, 11.0, 15.0, 10.0, 9.0]);
    assert!(matches!(error, Error::PausesTooSimilar { .. }), "{error}");
    assert!(error.to_string().contains("from 9 to 15 s"), "{error}");
    // The void opens far more slowly than the longest pause.
    let slow = StartStop { idle_time_constant_s: 2000.0, void_mm3: 6000.0, ..MACHINE };
    let error = refused(slow, &PAUSES_S);
    assert!(matches!(error, Error::TimeConstantUndetermined { .. }), "{error}");
    assert!(error.to_string().ends_with("Add pauses of several times that"), "{error}");
    // All of it is open before the shortest pause is over.
    let quick = StartStop { idle_time_constant_s: 0.1, ..MACHINE };
    let error = refused(quick, &PAUSES_S);
    assert!(matches!(error, Error::DelayDoesNotGrow { .. }), "{error}");
    let error = refused(StartStop { void_mm3: 0.0, ..MACHINE }, &PAUSES_S);
    assert!(matches!(error, Error::DelayDoesNotGrow { .. }), "{error}");
}

#[test]
fn a_flow_that_does_not_go_with_the_command_is_refused() {
    use StartStopFitError as Error;
    let [command, flow] = recording(MACHINE, &PAUSES_S);
    let dry = |from_s: f64, to_s: f64| {
        let mut flow = flow.clone();
        for (time_s, value) in flow.time_s.iter().zip(&mut flow.values) {
            if (from_s..to_s).contains(time_s) {
                *value = 0.0;
            }
        }
        flow
    };
    // The third run, from 47 to 52 s, is dry.
    let error = fit(&command, &dry(42.0, 47.1)).unwrap_err();
    assert!(matches!(error, Error::NoFlow { .. }), "{error}");
    let mut standing = flow.clone();
    standing.values.iter_mut().for_each(|value| *value += 100.0);
    let error = fit(&command, &standing).unwrap_err();
    assert!(matches!(error, Error::FlowContinues { .. }), "{error}");
    assert!(error.to_string().contains("still 20 % of that before"), "{error}");
    let mut off = command.clone();
    off.values.fill(0.0);
    assert_eq!(fit(&off, &flow), Err(Error::NeverCommanded { max: 0.0 }));
    let short = flow.within(0.0, 0.3);
    let error = fit(&command, &short).unwrap_err();
    assert_eq!(error, Error::TooFewSamples { what: "the flow", found: 16, needed: 50 });
}

#[test]
fn a_run_that_is_too_short_for_an_even_flow_is_left_out() {
    let [mut command, flow] = recording(MACHINE, &PAUSES_S);
    let all = fit(&command, &flow).unwrap();
    // The last run is stopped 0.5 s after it began.
    let last_s = *command.time_s.last().unwrap();
    command.push(last_s + 0.5, 0.0);
    let fit = fit(&command, &flow).unwrap();
    assert_eq!(fit.starts.len(), all.starts.len() - 1);
}

#[test]
fn a_run_in_which_the_command_changes_is_left_out() {
    let [mut command, flow] = recording(MACHINE, &PAUSES_S);
    let all = fit(&command, &flow).unwrap();
    let at_s = all.starts[3].at_s + 1.0;
    let after = command.time_s.partition_point(|time_s| *time_s < at_s);
    command.time_s.insert(after, at_s);
    command.values.insert(after, 30.0);
    let fit = fit(&command, &flow).unwrap();
    assert_eq!(fit.starts.len(), all.starts.len() - 1);
    assert_eq!(fit.stops.len(), all.stops.len() - 1);
}

#[test]
fn a_start_of_which_samples_are_missing_is_left_out() {
    let [command, mut flow] = recording(MACHINE, &PAUSES_S);
    let all = fit(&command, &flow).unwrap();
    let start = all.starts[2];
    let lost = |time_s: &f64| (start.at_s..start.at_s + 1.5).contains(time_s);
    let kept: Vec<bool> = flow.time_s.iter().map(|time_s| !lost(time_s)).collect();
    let mut keep = kept.iter();
    flow.time_s.retain(|_| *keep.next().unwrap());
    let mut keep = kept.iter();
    flow.values.retain(|_| *keep.next().unwrap());
    let fit = fit(&command, &flow).unwrap();
    assert_eq!(fit.starts.len(), all.starts.len() - 1);
    assert!((fit.parameters.void_mm3 - all.parameters.void_mm3).abs() < 3.0);
}

#[test]
fn samples_that_are_further_apart_than_a_start_lasts_are_refused() {
    let [command, mut flow] = recording(StartStop { rise_s: 0.02, ..MACHINE }, &PAUSES_S);
    let mut count = 0;
    let mut eighth = |_: &f64| {
        count += 1;
        count % 8 == 1
    };
    flow.time_s.retain(&mut eighth);
    count = 0;
    flow.values.retain(|_| {
        count += 1;
        count % 8 == 1
    });
    let error = fit(&command, &flow).unwrap_err();
    assert!(matches!(error, StartStopFitError::TooSparse { .. }), "{error}");
}
