//! `truebead extruder starts`: from a log of starts and stops to a file, and
//! the refusal of a log that does not determine them.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use truebead::identify::start_stop::file::{self, START_PARAMETERS, STOP_PARAMETERS};
use truebead::sim::melt::MeltParameters;
use truebead::sim::melt_log::{RecordingPlan, example, record, to_csv};

use common::{said, truebead};

/// The command for a log in a folder.
fn starts(log: &Path, more: &[&str]) -> Command {
    let mut command = truebead(&["extruder", "starts", "--input", "screw_rpm"]);
    command.arg(log).args(["--out"]).arg(log.with_extension("out")).args(more);
    command
}

/// A log of the simulated extruder, with its text changed.
fn log(folder: &Path, plan: &RecordingPlan, change: impl FnOnce(String) -> String) -> PathBuf {
    let path = folder.join("log.csv");
    fs::write(&path, change(to_csv(&record(MeltParameters::TYPICAL, 3, plan)))).unwrap();
    path
}

/// The answer to a log whose flow is in a column of this name.
fn answer(
    plan: &RecordingPlan,
    change: impl FnOnce(String) -> String,
    flow: &str,
    code: i32,
) -> String {
    let folder = tempfile::tempdir().unwrap();
    let log = log(folder.path(), plan, change);
    let said = said(&mut starts(&log, &["--output", flow]), code);
    assert_eq!(log.with_extension("out").exists(), code == 0, "{said}");
    said
}

#[test]
fn the_example_becomes_a_file_that_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let printed = said(&mut truebead(&["extruder", "identify", "--example", &at("example")]), 0);
    assert!(printed.contains("starts.csv") && printed.contains("520 mm³ within 18 s"), "{printed}");
    let log = at("example/starts.csv");
    let columns = ["--input", "screw_rpm", "--output", "flow_mm3_per_s"];
    let holds_for = ["--material", "PLA", "--nozzle-mm", "4", "--temperature-c", "210"];
    let fit = |code| {
        let mut command = truebead(&["extruder", "starts", &log]);
        command.args(columns).args(holds_for).args(["--out", &at("found")]);
        said(&mut command, code)
    };
    let answer = fit(0);
    for part in ["11 after pauses of 0.5 to 240 s", "std. error", "mm³", "starts.toml"] {
        assert!(answer.contains(part), "{part} in {answer}");
    }
    let text = fs::read_to_string(at("found/starts.toml")).unwrap();
    let found = file::parse("starts.toml", &text).unwrap();
    assert_eq!(found.conditions.material.as_deref(), Some("PLA"));
    assert_eq!((found.data.starts, found.data.stops), (11, 11));
    for one in START_PARAMETERS.iter().chain(&STOP_PARAMETERS) {
        let sigma = (one.of)(&found.sigma);
        assert!(answer.contains(one.key) && sigma > 0.0 && sigma.is_finite(), "{}", one.key);
    }
    // The model knows one void where there are two, each pause's own varies by 3 %, and melt
    // under pressure goes with them.
    for (idle_s, truth) in [(10.0, 239.0), (30.0, 467.0), (240.0, 646.0)] {
        let void = found.parameters.void_after(idle_s);
        assert!((void - truth).abs() < 65.0, "{idle_s}: {void}");
    }
    assert!((found.parameters.first_flow_s - 0.2).abs() < 0.08, "{:?}", found.parameters);
    let page = fs::read_to_string(at("found/report.html")).unwrap();
    assert!(page.contains("delay of the first flow [s]") && page.matches("<circle").count() >= 11);
    let taken = fit(2);
    assert!(taken.contains("starts.toml is there already and would be lost"), "{taken}");
    assert_eq!(fs::read_to_string(at("found/starts.toml")).unwrap(), text);
}

#[test]
fn logs_that_do_not_tell_starts_and_stops_are_refused_with_the_reason() {
    let few = RecordingPlan { idle_s: vec![2.0, 30.0, 8.0], ..example() };
    let said = answer(&few, |text| text, "flow_mm3_per_s", 1);
    assert!(said.contains("log.csv: 3 starts after a pause that is known"), "{said}");
    let alike = RecordingPlan { idle_s: vec![20.0, 22.0, 24.0, 26.0, 28.0, 30.0], ..example() };
    let said = answer(&alike, |text| text, "flow_mm3_per_s", 1);
    assert!(said.contains("all pauses are alike: from 20 to 30 s"), "{said}");
    let twice = |text: String| {
        let mut lines: Vec<&str> = text.lines().collect();
        lines.insert(100, lines[99]);
        lines.join("\n")
    };
    let said = answer(&few, twice, "flow_mm3_per_s", 1);
    assert!(said.contains("line 101: time repeats"), "{said}");
}

#[test]
fn a_flow_in_another_unit_is_converted_or_refused() {
    let few = RecordingPlan { idle_s: vec![2.0], ..example() };
    let named = |name: &'static str| move |text: String| text.replace("flow_mm3_per_s", name);
    for (name, expected) in [
        ("flow_g_per_min", "found g/min, expected a flow in mm³/s or l/min; divide the mass"),
        ("nozzle_mpa", "found MPa, expected a flow in mm³/s or l/min ("),
        ("flow", "does not end with a unit"),
    ] {
        let said = answer(&few, named(name), name, 2);
        assert!(said.contains(expected), "{name}: {said}");
    }
    // The same numbers in a unit that is 16667 times as large.
    let litres = answer(&example(), named("flow_l_per_min"), "flow_l_per_min", 0);
    let as_is = answer(&example(), |text| text, "flow_mm3_per_s", 0);
    let void = |said: &str| {
        let line = said.lines().find(|line| line.trim_start().starts_with("void_mm3")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
    };
    let ratio = void(&litres) / void(&as_is);
    assert!((ratio / (1e6 / 60.0) - 1.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn arguments_that_are_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let few = RecordingPlan { idle_s: vec![2.0], ..example() };
    let log = log(folder.path(), &few, |text| text);
    let flow = ["--output", "flow_mm3_per_s"];
    for (more, expected) in [
        (vec![], "--output <COLUMN>"),
        (vec!["--output", "screw_rpm"], "are both screw_rpm"),
        (vec!["--output", "flow2_mm3_per_s"], "no column flow2_mm3_per_s"),
        ([&flow[..], &["--model", "fopdt"]].concat(), "unexpected argument"),
        ([&flow[..], &["--smooth", "11,3"]].concat(), "unexpected argument"),
        (
            [&flow[..], &["--noise", "nozzle_mpa"]].concat(),
            "is a command now: `truebead extruder noise",
        ),
    ] {
        let said = said(&mut starts(&log, &more), 2);
        assert!(said.contains(expected), "{more:?}: {said}");
    }
}
