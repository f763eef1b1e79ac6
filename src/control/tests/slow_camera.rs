//! Widths that are older than a gap may be.

use super::*;

/// Widths of an age, ten a second, until the hold must have ended in a fault.
fn states_with_widths_of_age(mut line: Line, age: f64) -> Vec<State> {
    let mut states = Vec::new();
    for _ in 0..80 {
        let _ = line.lay(0.1);
        states.push(line.width_of_age(age, 42.0).state);
        let _ = line.tick();
        states.push(line.controller.state());
    }
    states
}

pub fn too_slow(age: f64) -> Hold {
    Hold::SlowCamera { age: Span::from_secs(age), max_gap: Span::from_secs(0.5) }
}

#[test]
fn widths_that_are_too_old_do_not_end_a_hold_and_the_fault_names_the_camera() {
    let states = states_with_widths_of_age(Line::tracking(), 0.8);
    let held = states.iter().position(|state| matches!(state, State::Holding(_))).unwrap();
    assert!(!states[held..].contains(&State::Tracking));
    assert!(states.contains(&State::Holding(too_slow(0.8))));
    let fault = State::Fault(Fault::HeldTooLong(too_slow(0.8)));
    assert_eq!(states.last(), Some(&fault));
    let lasted = states.iter().position(|state| *state == fault).unwrap() - held;
    // Two states every 0.1 s, for the 3 s of the longest hold.
    assert!((60..66).contains(&lasted), "{lasted}");
}

#[test]
fn widths_that_are_young_enough_are_tracked_whatever_their_age() {
    let states = states_with_widths_of_age(Line::tracking(), 0.25);
    assert!(states.iter().all(|state| *state == State::Tracking));
}

#[test]
fn control_does_not_begin_with_widths_that_are_too_old() {
    let mut line = Line::new();
    line.now = 1.0;
    let _ = line.robot(RobotMode::Print, 0.0, 112.5);
    let states = states_with_widths_of_age(line, 0.8);
    assert!(!states.contains(&State::Tracking));
    assert_eq!(states.last(), Some(&State::Fault(Fault::HeldTooLong(too_slow(0.8)))));
}

#[test]
fn only_timely_widths_in_a_row_end_a_hold() {
    let mut line = Line::tracking();
    let _ = line.lay(0.6);
    let _ = line.tick();
    for age in [0.0, 0.1, 0.6, 0.0, 0.0] {
        let _ = line.lay(0.1);
        assert_ne!(line.width_of_age(age, 42.0).state, State::Tracking, "{age}");
    }
    // A width after a gap is not in a row with those before it.
    let _ = line.lay(0.6);
    assert_ne!(line.width(42.0).state, State::Tracking);
    let _ = line.lay(0.1);
    assert_ne!(line.width(42.0).state, State::Tracking);
    let _ = line.lay(0.1);
    assert_eq!(line.width(42.0).state, State::Tracking);
}
