//! A bead whose truth is known, as a recording.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use crate::control::ExtruderStep;
use crate::core::RobotMode;

const OFFSET: f64 = 30.0;
const HEIGHT: f64 = 1.5;

/// Speed and way of the robot since the bead began.
fn speed(t: f64) -> f64 {
    100.0 + 30.0 * (1.1 * t).sin()
}

fn way(t: f64) -> f64 {
    100.0 * t + 30.0 / 1.1 * (1.0 - (1.1 * t).cos())
}

fn flow(t: f64) -> f64 {
    400.0 + 60.0 * (2.0 * t).sin()
}

/// When the nozzle passed a position, by bisection.
fn passed(place: f64) -> f64 {
    let halve = |(low, high): (f64, f64), _| {
        let middle = f64::midpoint(low, high);
        if way(middle) < place { (middle, high) } else { (low, middle) }
    };
    (0..60).fold((-1.0, 40.0), halve).0
}

fn robot(mode: RobotMode, t: f64) -> Event {
    Event::Robot(RobotState {
        robot_time_ms: None,
        has_setpoint: false,
        mode,
        speed_mm_per_s: MmPerS::constant(speed(t)),
        path_mm: Mm::constant(way(t)),
        z_mm: Mm::ZERO,
    })
}

fn reported(pump: PumpMode, t: f64) -> Event {
    Event::Extruder(ExtruderReport {
        pump,
        valve_open: true,
        screw_rpm: Some(Rpm::constant(25.0)),
        pressure_mpa: None,
        flow_mm3_per_s: Some(Mm3PerS::constant(flow(t))),
        filled_mm: None,
    })
}

/// A bead that begins at a moment and lasts so long; the pump runs from 0.3 s
/// on.
fn bead(begins_s: f64, lasts_s: f64) -> Vec<RecordedEntry> {
    let mut events: Vec<(f64, Event)> = Vec::new();
    let each = |period_s: f64| {
        let mut t = 0.0;
        std::iter::from_fn(move || {
            t += period_s;
            (t <= lasts_s).then_some(t)
        })
    };
    events.extend(each(0.02).map(|t| (t, robot(RobotMode::Print, t))));
    events.push((lasts_s + 0.02, robot(RobotMode::Idle, lasts_s)));
    events.extend(
        each(0.021)
            .map(|t| (t, reported(if t < 0.3 { PumpMode::Starting } else { PumpMode::On }, t))),
    );
    events.extend(each(0.05).filter(|t| way(*t) > OFFSET).map(|t| {
        let laid_s = passed(way(t) - OFFSET);
        let area = flow(laid_s) / speed(laid_s);
        let pi_4 = std::f64::consts::FRAC_PI_4;
        let width = HEIGHT + (area - pi_4 * HEIGHT * HEIGHT) / HEIGHT;
        let captured_at = Stamp::from_secs(begins_s + t);
        let width_mm = Mm::constant(width);
        let measured = Event::Measured { frame: 0, captured_at, width_mm, sigma_mm: Mm::ZERO };
        // The frame arrives later than it was captured.
        (t + 0.07, measured)
    }));
    events.extend(each(0.02).map(|t| (t, Event::ExtruderTick)));
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    let entry = |(t, event)| {
        let now = Stamp::from_secs(begins_s + t);
        let command = ExtruderCommand { pump_on: true, valve_open: true, value: 20.0 };
        let side = ExtruderStep { command: Some(command), ..ExtruderStep::default() };
        let is_tick = event == Event::ExtruderTick;
        let step = Step { extruder: is_tick.then_some(side), ..Step::default() };
        [
            RecordedEntry::Event { n: 0, now, event },
            RecordedEntry::Step { n: 0, now, step: Box::new(step) },
        ]
    };
    events.into_iter().flat_map(entry).collect()
}

fn facts() -> BeadFacts {
    BeadFacts {
        command: Some(Unit::Rpm),
        layer_height: Some(Mm::constant(HEIGHT)),
        offset: Mm::constant(OFFSET),
    }
}

fn found(entries: Vec<RecordedEntry>, facts: &BeadFacts) -> BeadColumns {
    columns(entries.into_iter().map(Ok), facts).unwrap()
}

fn names(found: &BeadColumns) -> Vec<&str> {
    found.columns.iter().map(|column| column.name.as_str()).collect()
}

#[test]
fn the_flow_that_laid_the_bead_is_found_when_it_was_laid() {
    let found = found(bead(0.0, 20.0), &facts());
    assert!(found.notes.is_empty(), "{:?}", found.notes);
    let all = [
        "command_rpm",
        "screw_rpm",
        "flow_mm3_per_s",
        "speed_mm_per_s",
        "path_mm",
        "width_mm",
        "laid_width_mm",
        "laid_flow_mm3_per_s",
    ];
    assert_eq!(names(&found), all);
    let laid = found.columns.last().unwrap();
    assert!(laid.len() > 350, "{}", laid.len());
    for (time, value) in laid.time_s.iter().zip(&laid.values) {
        assert!((value - flow(*time)).abs() < 0.2, "{time} s: {value} for {}", flow(*time));
    }
    // Nothing from before the pump ran.
    assert!(found.columns.iter().all(|column| column.time_s[0] > 0.3));
    assert!(found.columns[0].is_held && !laid.is_held);
}

#[test]
fn the_longest_of_several_beads_is_taken() {
    let mut entries = bead(0.0, 3.0);
    entries.extend(bead(10.0, 8.0));
    let found = found(entries, &facts());
    assert!(found.notes[0].starts_with("2 beads were laid; the longest"), "{:?}", found.notes);
    let speed = found.columns.iter().find(|column| column.name == "speed_mm_per_s").unwrap();
    assert!(speed.time_s[0] > 10.3 && *speed.time_s.last().unwrap() < 18.1);
}

#[test]
fn columns_that_cannot_be_made_are_named_in_notes() {
    let without = BeadFacts { layer_height: None, ..facts() };
    let columns = found(bead(0.0, 5.0), &without);
    assert_eq!(*names(&columns).last().unwrap(), "laid_width_mm");
    assert!(columns.notes[0].contains("--layer-height-mm"), "{:?}", columns.notes);
    let high = BeadFacts { layer_height: Some(Mm::constant(9.0)), ..facts() };
    let columns = found(bead(0.0, 5.0), &high);
    assert!(
        columns.notes[0].contains("are less than the layer's height of 9"),
        "{:?}",
        columns.notes
    );
    let idle =
        vec![RecordedEntry::Event { n: 0, now: Stamp::START, event: robot(RobotMode::Idle, 0.0) }];
    let columns = found(idle, &facts());
    assert!(columns.columns.is_empty() && columns.notes[0].contains("no bead was laid"));
}
