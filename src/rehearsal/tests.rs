#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::path::Path;

use super::fault::FaultKind;
use super::*;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::control::{Hold, State};
use crate::core::{Mm, RobotMode};

fn at(s: f64) -> Stamp {
    Stamp::from_secs(s)
}

/// A run of a cell that comes with the program, with a fault between two times.
fn run(cell: &str, path_mm: f64, fault: Option<(FaultKind, f64, f64)>) -> Rehearsed {
    let text = std::fs::read_to_string(Path::new("cells").join(cell)).unwrap();
    let mut loaded = LoadedCell::from_text(Path::new(cell), text, Purpose::Run).unwrap();
    loaded.cell.simulation.path = Mm::constant(path_mm);
    let faults = fault
        .map(|(kind, from, until)| Fault { kind, from: at(from), until: at(until) })
        .into_iter()
        .collect();
    Rehearsal {
        cell: &loaded.cell,
        run: loaded.cell.run.as_ref().unwrap(),
        assumed_run: loaded.cell.run.as_ref().unwrap(),
        calibration: &loaded.calibration,
        extruder: loaded.simulated_extruder().unwrap().map(|side| side.extruder),
        faults,
        duration: Span::from_secs(60.0),
    }
    .run()
    .unwrap()
}

impl Rehearsed {
    /// When a step first had a state, after a time \[s\].
    fn first(&self, after_s: f64, is: impl Fn(&State) -> bool) -> Option<f64> {
        let steps = self.steps.iter().filter(|(now, _, _)| *now >= at(after_s));
        steps.map(|(now, _, step)| (now.secs(), &step.state)).find(|one| is(one.1)).map(|one| one.0)
    }

    /// When the robot first had a mode, after a time \[s\].
    fn robot_first(&self, after_s: f64, mode: RobotMode) -> Option<f64> {
        let states = self.robot.iter().filter(|(now, _)| *now >= at(after_s));
        states
            .map(|(now, state)| (now.secs(), state.mode))
            .find(|one| one.1 == mode)
            .map(|one| one.0)
    }

    fn says(&self, words: &str) -> bool {
        self.notices.iter().any(|(_, line)| line.contains(words))
    }
}

fn holds(state: &State) -> bool {
    matches!(state, State::Holding(_))
}

#[test]
fn a_bead_without_a_fault_is_laid_to_its_end_without_a_hold_and_the_same_every_time() {
    let [one, again] = [(), ()].map(|()| run("distance.toml", 1500.0, None));
    let held = one.first(0.0, |state| holds(state) && *state != State::Holding(Hold::Stopping));
    assert_eq!((&one.ending, held), (&Ending::TimeOver, None), "{:?}", one.notices);
    assert_eq!(one.robot.last().unwrap().1.mode, RobotMode::Idle);
    // What the robot lays after its last report in `PRINT` is not seen.
    assert!((one.bead.end_mm().unwrap() - 1500.0).abs() < 3.0);
    let target_mm = 42.0;
    let late = one.bead.smooth_width_at(1200.0).unwrap();
    assert!((late - target_mm).abs() < 0.5, "{late}");
    assert_eq!(one.steps, again.steps);
    assert_eq!(one.bead.smooth_width_at(1200.0), again.bead.smooth_width_at(1200.0));
}

#[test]
fn the_step_of_a_path_that_jumps_is_in_the_message() {
    let jump = FaultKind::PathShifted(Mm::constant(300.0));
    let jumped = run("distance.toml", 2000.0, Some((jump, 8.0, 99.0)));
    let is_jump = |state: &State| matches!(state, State::Holding(Hold::PathJump { .. }));
    assert!(jumped.first(8.0, is_jump).is_some_and(|held| held < 8.03), "{:?}", jumped.notices);
    assert!(jumped.says("30"), "{:?}", jumped.notices);
    let goes_on = jumped.first(9.0, |state| *state == State::Tracking);
    assert!(goes_on.is_some_and(|on| on < 12.0), "{goes_on:?}");
}

#[test]
fn a_camera_that_is_off_at_the_start_is_waited_for() {
    let waited = run("distance.toml", 1500.0, Some((FaultKind::CameraSilent, 0.0, 4.0)));
    assert!(waited.says("waiting for the camera"), "{:?}", waited.notices);
    assert!(waited.first(4.0, |state| *state == State::Tracking).is_some());
    assert_eq!(waited.robot.last().unwrap().1.mode, RobotMode::Idle);
}

#[test]
fn a_full_disk_ends_the_run_and_stops_the_robot() {
    let full = run("distance.toml", 2000.0, Some((FaultKind::DiskFull, 8.0, 99.0)));
    assert!(matches!(full.ending, Ending::RecordingLost(_)), "{:?}", full.ending);
    assert!(full.robot_first(8.0, RobotMode::Stop).is_some_and(|stopped| stopped < 8.1));
}

#[test]
fn a_pump_that_fails_freezes_the_width_control_and_stops_the_robot() {
    for kind in [FaultKind::PumpFails, FaultKind::ExtruderUnplugged] {
        let failed = run("extruder-pressure.toml", 2000.0, Some((kind, 12.0, 99.0)));
        // A command is valid for 0.3 s at the extruder, and max_hold_s is 3 s.
        let held = failed.first(12.0, |state| holds(state) || matches!(state, State::Fault(_)));
        assert!(held.is_some_and(|held| held <= 12.35), "{kind:?}: {held:?} {:?}", failed.notices);
        let stopped = failed.robot_first(12.0, RobotMode::Stop);
        assert!(stopped.is_some_and(|stopped| stopped < 15.6), "{kind:?}: {stopped:?}");
    }
}
