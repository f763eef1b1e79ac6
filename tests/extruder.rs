//! The extruder side as a user meets it: cell files, simulation, messages.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

const CELL: &str = include_str!("../cells/extruder.toml");

fn truebead(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("truebead").unwrap().current_dir(folder).args(args).output().unwrap()
}

/// A cell's text with some parts of it replaced.
fn changed(cell: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(cell.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// `[extruder_plant]` of the shipped cell.
fn plant() -> &'static str {
    &CELL[CELL.find("[extruder_plant]").unwrap()..CELL.find("[simulation]").unwrap()]
}

/// Simulates a cell with some parts of it replaced; gives status, standard
/// error and the summary, if there is one.
fn simulated_cell(
    cell: &str,
    changes: &[(&str, &str)],
) -> (Option<i32>, String, serde_json::Value) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cell.toml"), changed(cell, changes)).unwrap();
    let output = truebead(folder.path(), &["simulate", "cell.toml", "--out", "out"]);
    let summary = fs::read_to_string(folder.path().join("out/summary.json"))
        .map_or(serde_json::Value::Null, |text| serde_json::from_str(&text).unwrap());
    let said = String::from_utf8(output.stderr).unwrap();
    (output.status.code(), said, summary)
}

/// The same for the cell whose command is constant.
fn simulated(changes: &[(&str, &str)]) -> (Option<i32>, String, serde_json::Value) {
    simulated_cell(CELL, changes)
}

#[test]
fn both_sides_run_together() {
    let (status, said, summary) = simulated(&[]);
    assert_eq!(status, Some(0), "{said}");
    let side = &summary["extruder"];
    assert!(side["states_s"]["running"].as_f64().unwrap() > 10.0, "{side}");
    assert!(side["commands"].as_u64().unwrap() > 500, "{side}");
    assert_eq!(summary["faults"], 0);
    assert!(summary["width_error_rms_settled_mm"].as_f64().unwrap() < 1.0, "{summary}");
}

#[test]
fn a_pump_that_never_starts_stops_the_robot_with_the_reason() {
    let (status, said, summary) = simulated(&[("start_delay_s = 0.1", "start_delay_s = 9.0")]);
    assert_eq!(status, Some(1), "{said}");
    assert_eq!(summary["fault_reasons"]["extruder_did_not_start"], 1, "{summary}");
    assert_eq!(summary["extruder"]["fault_reasons"]["did_not_start"], 1, "{summary}");
}

#[test]
fn the_robot_slows_down_where_less_flows() {
    let (_, _, full) = simulated(&[]);
    let (_, _, less) = simulated(&[("constant_rpm = 60.0", "constant_rpm = 50.0")]);
    let took = |summary: &serde_json::Value| summary["duration_s"].as_f64().unwrap();
    assert!(took(&less) > 1.05 * took(&full), "{less}");
    let settled = less["width_error_rms_settled_mm"].as_f64().unwrap();
    assert!(settled < 1.0, "{less}");
}

#[test]
fn every_violation_is_told_at_once_with_its_line() {
    let (status, said, _) = simulated(&[
        ("max_rpm = 90.0", "max_rpm = -90.0"),
        ("strategy = \"constant\"", "strategy = \"constnat\""),
        ("layer_height_mm = 20.0", "layer_height_mm = 60.0"),
        ("kind = \"direct\"", "kind = \"magic\""),
    ]);
    assert_eq!(status, Some(2));
    for part in ["extruder.max_rpm", "extruder.strategy", "extruder_plant.kind", "line "] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

#[test]
fn a_bead_narrower_than_it_is_high_is_refused() {
    let (status, said, _) = simulated(&[("layer_height_mm = 20.0", "layer_height_mm = 60.0")]);
    assert_eq!(status, Some(2));
    assert!(said.contains("extruder.layer_height_mm"), "{said}");
}

#[test]
fn a_simulation_without_a_plant_says_what_is_missing() {
    let (status, said, _) = simulated(&[(plant(), "")]);
    assert_eq!(status, Some(2));
    assert!(said.contains("[extruder_plant]"), "{said}");
}

#[test]
fn a_profile_is_played_and_a_bad_one_has_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let text = CELL.replace(
        "strategy = \"constant\"\nconstant_rpm = 60.0",
        "strategy = \"profile\"\nprofile = \"steps.csv\"",
    );
    fs::write(folder.path().join("cell.toml"), text).unwrap();
    fs::write(folder.path().join("steps.csv"), "time_s,screw_rpm\n0,60\n5,70\n9,55\n30,55\n")
        .unwrap();
    let output = truebead(folder.path(), &["simulate", "cell.toml", "--out", "out"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    for (profile, told) in [
        ("time_s,screw_rpm\n0,60\n5,fast\n9,60\n", "line 3"),
        ("time_s,drive_v\n0,60\n5,60\n", "expected a quantity in rpm"),
        ("time_s,screw_rpm\n0,60\n5,600\n9,600\n", "expected 0 to 90"),
    ] {
        fs::write(folder.path().join("steps.csv"), profile).unwrap();
        let output = truebead(folder.path(), &["simulate", "cell.toml", "--out", "out2"]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("steps.csv") && said.contains(told), "{said}");
    }
}

#[test]
fn a_plant_that_never_reports_what_is_gone_by_is_refused() {
    for (from, to, told) in [
        (
            "max_gap_s = 0.2 ",
            "max_pressure_mpa = 2.0\nmax_gap_s = 0.2 ",
            "extruder.max_pressure_mpa",
        ),
        (
            "kind = \"direct\"\ngain_mm3_per_s = 1300.0 ",
            "kind = \"screw\"\nfull_flow_mm3_per_s = 1300.0 ",
            "extruder_plant.kind",
        ),
    ] {
        let (status, said, _) = simulated(&[(from, to)]);
        assert_eq!(status, Some(2), "{said}");
        assert!(said.contains("line ") && said.contains(told), "{said}");
    }
    let cell = include_str!("../cells/extruder-adaptive.toml");
    let (status, said, _) = simulated_cell(cell, &[("flow_sensor_noise_mm3_per_s = 200.0", "")]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("extruder.strategy") && said.contains("flow_sensor_noise"), "{said}");
}

#[test]
fn check_says_what_a_cell_suffices_for_and_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let checked = |changes: &[(&str, &str)]| {
        fs::write(folder.path().join("cell.toml"), changed(CELL, changes)).unwrap();
        let output = truebead(folder.path(), &["check", "cell.toml"]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let both = checked(&[]);
    assert!(both.contains("suffices for run\n") && both.contains("suffices for simulate\n"));
    let link = "driver = \"line\"                 # driver, address: for a live run only\n\
                address = \"127.0.0.1:5654\"\n";
    let simulates = checked(&[(link, "")]);
    assert!(simulates.contains("suffices for simulate\n"), "{simulates}");
    assert!(simulates.contains("not for run;") && simulates.contains("extruder.driver"));
    let runs = checked(&[(plant(), "")]);
    assert!(runs.contains("suffices for run\n"), "{runs}");
    assert!(runs.contains("not for simulate;") && runs.contains("extruder_plant"), "{runs}");
}

/// Simulates the shipped cell with the model's inverse, some lines changed.
fn foreseen(changes: &[(&str, &str)]) -> serde_json::Value {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let mut text = include_str!("../cells/extruder-feedforward.toml")
        .replace("../models", &models.display().to_string());
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cell.toml"), text).unwrap();
    let output = truebead(folder.path(), &["simulate", "cell.toml", "--out", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    serde_json::from_str(&summary).unwrap()
}

#[test]
fn a_robot_that_goes_by_the_flow_has_its_width_while_the_extruder_runs_up() {
    let since_control =
        |summary: &serde_json::Value| summary["width_error_rms_mm"].as_f64().unwrap();
    let alone = foreseen(&[("robot_follows = \"flow\"", "robot_follows = \"nothing\"")]);
    let with = foreseen(&[]);
    assert!(since_control(&with) < 0.08, "{with}");
    assert!(2.0 * since_control(&with) < since_control(&alone), "{with} {alone}");
    // A screw that follows late is known by its encoder.
    let plant = "start_delay_s = 0.1";
    let late = format!("{plant}\nscrew_lag_s = 0.3");
    let blind = foreseen(&[(plant, &late)]);
    let key = "robot_follows = \"flow\"";
    let seen = foreseen(&[(plant, &late), (key, &format!("{key}\nforetold_from = \"encoder\""))]);
    assert!(since_control(&seen) < 0.75 * since_control(&blind), "{seen} {blind}");
}

#[test]
fn a_robot_and_a_flow_do_not_follow_each_other() {
    let flow = "follows = \"robot\"\nrobot_follows = \"flow\"\nmax_gap_s = 0.2 ";
    let (status, said, _) = simulated(&[("max_gap_s = 0.2 ", flow)]);
    assert_eq!(status, Some(2));
    assert!(said.contains("extruder.follows"), "{said}");
    assert!(said.contains("expected strategy = \"feedforward\""), "{said}");
}
