//! The extruder side as a user meets it: cell files, simulation, messages.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test may fail")]

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use assert_cmd::cargo::cargo_bin;

const CELL: &str = include_str!("../cells/extruder.toml");

fn truebead(folder: &Path, args: &[&str]) -> Output {
    Command::cargo_bin("truebead").unwrap().current_dir(folder).args(args).output().unwrap()
}

/// Folder of the shipped cells.
fn cells() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/cells"))
}

/// A cell's text with some parts of it replaced.
fn changed(cell: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(cell.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// A number of a summary.
fn number(of: &serde_json::Value, key: &str) -> f64 {
    of[key].as_f64().unwrap()
}

/// Sum of the times that an object of a summary has.
fn seconds(of: &serde_json::Value) -> f64 {
    of.as_object().unwrap().values().map(|time| time.as_f64().unwrap()).sum()
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
    // Where a cell names a file, it is that beside the shipped ones.
    let beside = |text: String| {
        text.replace("\"../models", &format!("\"{}/../models", cells().display()))
            .replace("\"excite.csv", &format!("\"{}/excite.csv", cells().display()))
    };
    fs::write(folder.path().join("cell.toml"), beside(changed(cell, changes))).unwrap();
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
fn every_violation_is_reported_at_once_with_its_line() {
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
    for (profile, printed) in [
        ("time_s,screw_rpm\n0,60\n5,fast\n9,60\n", "line 3"),
        ("time_s,drive_v\n0,60\n5,60\n", "expected a quantity in rpm"),
        ("time_s,screw_rpm\n0,60\n5,600\n9,600\n", "expected 0 to 90"),
    ] {
        fs::write(folder.path().join("steps.csv"), profile).unwrap();
        let output = truebead(folder.path(), &["simulate", "cell.toml", "--out", "out2"]);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains("steps.csv") && said.contains(printed), "{said}");
    }
}

#[test]
fn a_profile_that_changes_faster_than_the_limits_allow_is_warned_of() {
    let cell = include_str!("../cells/extruder-excite.toml");
    let rate = cell.lines().find(|line| line.starts_with("max_rpm_per_s")).unwrap();
    let (status, said, _) = simulated_cell(cell, &[]);
    assert!(status == Some(0) && !said.contains("warning"), "{said}");
    let (_, said, _) = simulated_cell(cell, &[(rate, "max_rpm_per_s = 5.0")]);
    assert!(said.contains("are not made to their end"), "{said}");
}

#[test]
fn readings_are_filtered_before_the_strategy_goes_by_them() {
    let cell = include_str!("../cells/extruder-adaptive.toml");
    let with = |readings: &str| {
        let table = format!("[extruder.readings]\n{readings}\n[extruder_plant]");
        simulated_cell(cell, &[("[extruder_plant]", &table)])
    };
    let filters = "spike_half_width = 2\nsmooth_window = 9";
    let (status, said, summary) = with(filters);
    assert_eq!(status, Some(0), "{said}");
    assert!(off(&summary).abs() < 0.03, "{summary}");
    for (wrong, printed) in [
        ("", "extruder.readings.spike_half_width"),
        ("smooth_window = 8", "expected an odd number from 3 to 101"),
        ("spike_half_width = 0", "extruder.readings.spike_half_width"),
        ("smooth_window = 9\nspike_sigmas = 3.0", "spike_half_width beside it"),
        ("smooth_windw = 9\nspike_half_width = 2", "smooth_windw"),
    ] {
        let (status, said, _) = with(wrong);
        assert_eq!(status, Some(2), "{said}");
        assert!(said.contains(printed), "{printed}: {said}");
    }
}

#[test]
fn a_simulation_leaves_no_recording_of_another_beside_its_results() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cell.toml"), CELL).unwrap();
    let first = truebead(folder.path(), &["simulate", "cell.toml", "--out", "out", "--record"]);
    assert_eq!(first.status.code(), Some(0), "{first:?}");
    for more in [&[][..], &["--record"]] {
        let args = [&["simulate", "cell.toml", "--out", "out"], more].concat();
        let again = truebead(folder.path(), &args);
        assert_eq!(again.status.code(), Some(2), "{again:?}");
        let said = String::from_utf8(again.stderr).unwrap();
        assert!(said.contains("recording.mcap is there already"), "{said}");
    }
}

#[test]
fn a_plant_that_never_reports_what_is_gone_by_is_refused() {
    for (from, to, printed) in [
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
        assert!(said.contains("line ") && said.contains(printed), "{said}");
    }
    let cell = include_str!("../cells/extruder-adaptive.toml");
    let (status, said, _) = simulated_cell(cell, &[("flow_sensor_noise_mm3_per_s = 200.0", "")]);
    assert_eq!(status, Some(2), "{said}");
    assert!(said.contains("extruder.strategy") && said.contains("flow_sensor_noise"), "{said}");
}

#[test]
fn check_names_the_commands_that_a_cell_is_ready_for_and_what_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let checked = |changes: &[(&str, &str)]| {
        fs::write(folder.path().join("cell.toml"), changed(CELL, changes)).unwrap();
        let output = truebead(folder.path(), &["check", "cell.toml"]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let both = checked(&[]);
    assert!(both.contains("ready for run\n") && both.contains("ready for simulate\n"));
    let link = "driver = \"line\"                 # driver, address: for a live run only\n\
                address = \"127.0.0.1:5654\"\n";
    let simulates = checked(&[(link, "")]);
    assert!(simulates.contains("ready for simulate\n"), "{simulates}");
    assert!(simulates.contains("not for run;") && simulates.contains("extruder.driver"));
    let runs = checked(&[(plant(), "")]);
    assert!(runs.contains("ready for run\n"), "{runs}");
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
    // With some of the changes the bead is out of its tolerance.
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(0 | 3)), "{said}");
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
    // A screw that follows with a delay is known by its encoder.
    let plant = "start_delay_s = 0.1";
    let late = format!("{plant}\nscrew_lag_s = 0.3");
    let blind = foreseen(&[(plant, &late)]);
    let key = "robot_follows = \"flow\"";
    let seen = foreseen(&[(plant, &late), (key, &format!("{key}\npredicted_from = \"encoder\""))]);
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

/// What a user of a shipped cell relies on: it runs from the first to the last
/// moment of the bead, nothing is missed, limits hardly act, and the robot
/// brings the width to its target with the flow that comes.
fn runs_through(cell: &str, changes: &[(&str, &str)], settled_mm: f64) -> serde_json::Value {
    let (status, said, summary) = simulated_cell(cell, changes);
    assert_eq!(status, Some(0), "{said}");
    let side = &summary["extruder"];
    let times = &side["states_s"];
    let (running, starting) = (number(times, "running"), number(times, "starting"));
    let took = number(&summary, "duration_s");
    assert!((0.02..0.15).contains(&starting) && running + starting > took - 0.1, "{summary}");
    assert_eq!(seconds(&side["held_for_s"]), 0.0, "{side}");
    assert!(seconds(&side["limited_by_s"]) < 0.25 * took, "{side}");
    assert!(side["fault_reasons"].as_object().unwrap().is_empty() && summary["faults"] == 0);
    assert!(side["commands"].as_f64().unwrap() > 49.0 * running, "{side}");
    assert!(number(&summary, "width_error_rms_settled_mm") < settled_mm, "{summary}");
    summary
}

/// Relative error of the flow on average since control began.
fn off(summary: &serde_json::Value) -> f64 {
    let kept = &summary["extruder"]["flow_controlled"];
    number(kept, "error_mean_mm3_per_s") / number(kept, "mean_mm3_per_s")
}

#[test]
fn the_inverse_of_a_model_gives_the_flow_of_a_plant_that_is_nearly_it() {
    let cell = include_str!("../cells/extruder-feedforward.toml");
    let summary = runs_through(cell, &[], 0.06);
    // The plant gives 6 % less than the model says.
    assert!(off(&summary).abs() < 0.08, "{summary}");
}

#[test]
fn a_screw_that_was_weighed_needs_no_model() {
    // 1300 mm³/s for each rpm.
    let weighed = "strategy = \"feedforward\"\nmm3_per_turn = 78000.0";
    let constant = "strategy = \"constant\"\nconstant_rpm = 60.0";
    let summary = runs_through(CELL, &[(constant, weighed)], 0.7);
    assert!(off(&summary).abs() < 0.03, "{summary}");
    let folder = tempfile::tempdir().unwrap();
    let checked = |changes: &[(&str, &str)]| {
        fs::write(folder.path().join("cell.toml"), changed(CELL, changes)).unwrap();
        let output = truebead(folder.path(), &["check", "cell.toml"]);
        let [said, errors] = [output.stdout, output.stderr].map(|t| String::from_utf8(t).unwrap());
        (output.status.code(), said + &errors)
    };
    let (status, said) = checked(&[(constant, weighed)]);
    assert!(status == Some(0) && said.contains("which take 61.8"), "{said}");
    assert!(!said.contains("WARNING"), "{said}");
    let slim = weighed.replace("78000", "7800");
    let (_, said) = checked(&[(constant, &slim)]);
    assert!(said.contains("WARNING") && said.contains("[extruder] allows 0 to 90 rpm"), "{said}");
    for (wrong, printed) in [
        (format!("{weighed}\nmodel = \"m.toml\""), "one of model, library and mm3_per_turn"),
        (weighed.replace("78000.0", "-1.0"), "extruder.mm3_per_turn"),
        (format!("{weighed}\nmaterial = \"PLA\""), "mm3_per_turn stands in for a model"),
    ] {
        let (status, said) = checked(&[(constant, &wrong)]);
        assert!(status == Some(2) || said.contains("not for run"), "{said}");
        assert!(said.contains(printed), "{said}");
    }
}

#[test]
fn pulses_that_cannot_be_cancelled_are_named_by_check() {
    let folder = tempfile::tempdir().unwrap();
    let warning = |changes: &[(&str, &str)]| {
        let counted = ("layer_height_mm = 20.0", "layer_height_mm = 20.0\npulses_per_turn = 1.0");
        let lag = ("start_delay_s = 0.1", "start_delay_s = 0.1\nscrew_lag_s = 0.2");
        fs::write(
            folder.path().join("cell.toml"),
            changed(CELL, &[&[counted, lag], changes].concat()),
        )
        .unwrap();
        let output = truebead(folder.path(), &["check", "cell.toml"]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains("ready for simulate"), "{said}");
        let (_, after) = said.split_once("pulses_per_turn has no effect:")?;
        Some(after.lines().nth(1).unwrap().trim().to_owned())
    };
    assert_eq!(warning(&[]), None);
    let distance = "strategy = \"distance\"\nexponent = 0.25";
    let pi = "strategy = \"pi\"\nkp_per_s = 0.75\nki_per_s2 = 0.6\nerror_unit_mm = 0.126582";
    let ignored = format!("{distance}\npulsation = \"ignore\"");
    let pulses = "pulses_per_turn = 1.0";
    let fast = [("min_rpm = 0.0", "min_rpm = 40.0"), (pulses, "pulses_per_turn = 3.0")];
    let cases: [(&[(&str, &str)], &str); 4] = [
        (&[(distance, pi)], "only [control] strategy = \"distance\" cancels"),
        (&[(distance, &ignored)], "[control] pulsation is \"ignore\""),
        (&[(pulses, "pulses_per_turn = 0.06")], "after 11.1 s at every rpm"),
        (&fast, "within 0.500 s at every rpm"),
    ];
    for (changes, reason) in cases {
        let said = warning(changes).unwrap();
        assert!(said.contains(reason), "{said}");
    }
}

#[test]
fn a_pressure_that_is_held_gives_the_flow_although_gain_and_load_change() {
    let cell = include_str!("../cells/extruder-pressure.toml");
    let held = runs_through(cell, &[], 0.06);
    // What the sensor's noise hides is left as it is.
    assert!(off(&held).abs() < 0.03, "{held}");
    let law = "strategy = \"pressure\"";
    let table = &cell[cell.find("[extruder.pressure]").unwrap()..];
    let table = &table[..table.find("[extruder_plant]").unwrap()];
    let open = [(law, "strategy = \"constant\"\nconstant_rpm = 27.0"), (table, "")];
    let (_, _, open) = simulated_cell(cell, &open);
    assert!(off(&open).abs() > 5.0 * off(&held).abs(), "{open}");
}

#[test]
fn a_screw_is_held_at_its_filled_length_and_the_robot_takes_the_flow_that_comes() {
    let cell = include_str!("../cells/extruder-screw.toml");
    let summary = runs_through(cell, &[], 1.5);
    assert!(off(&summary).abs() < 0.10, "{summary}");
}

#[test]
fn a_slip_that_grows_is_learnt() {
    let cell = include_str!("../cells/extruder-adaptive.toml");
    let learnt = runs_through(cell, &[], 0.7);
    let dull = [("learning_rate = 0.5", "learning_rate = 0.0")];
    let (_, _, dull) = simulated_cell(cell, &dull);
    assert!(off(&learnt).abs() < 0.03, "{learnt}");
    assert!(off(&dull).abs() > 2.0 * off(&learnt).abs(), "{dull}");
}

/// The flow of this cell takes a second to rise, and two to be learnt: no wave begins there.
#[test]
fn a_flow_that_is_being_learnt_is_not_taken_for_a_pulsation() {
    let cell = include_str!("../cells/extruder-adaptive.toml");
    for seed in 1..=5 {
        let with_seed = format!("[simulation]\nseed = {seed}");
        let (status, said, summary) = simulated_cell(cell, &[("[simulation]", &with_seed)]);
        assert_eq!(status, Some(0), "{said}");
        let tolerance = &summary["tolerance"];
        let out = number(tolerance, "out_of_tolerance_mm") / number(tolerance, "judged_mm");
        assert!(out < 0.03, "seed {seed}: {tolerance}");
    }
}

#[test]
fn a_profile_tells_how_far_it_was_played() {
    let cell = include_str!("../cells/extruder-excite.toml");
    let share = |changes: &[(&str, &str)]| {
        let summary = runs_through(cell, changes, 0.4);
        let profile = &summary["extruder"]["profile"];
        (number(profile, "played_fraction"), number(profile, "after_end_s"))
    };
    let path = cell.lines().find(|line| line.starts_with("path_mm")).unwrap();
    let (cut_off, none) = share(&[(path, "path_mm = 4000.0")]);
    assert!((0.5..0.7).contains(&cut_off) && none == 0.0, "{cut_off} {none}");
    let (whole, more) = share(&[(path, "path_mm = 8000.0")]);
    assert!(whole == 1.0 && (2.0..12.0).contains(&more), "{whole} {more}");
}

#[test]
fn the_width_of_a_bead_that_a_profile_moved_is_not_judged() {
    let folder = tempfile::tempdir().unwrap();
    let cell = cells().join("extruder-excite.toml");
    let output = truebead(folder.path(), &["simulate", cell.to_str().unwrap(), "--out", "out"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("A profile moved the extruder") && !page.contains("% of the target"));
    assert!(page.contains("verdict good"), "{}", &page[..3000]);
}

#[test]
fn a_model_that_is_used_beyond_its_data_is_warned_of() {
    let cell = include_str!("../cells/extruder-feedforward.toml");
    let (_, said, _) = simulated_cell(cell, &[]);
    assert!(!said.contains("warning"), "{said}");
    let thinner = [("layer_height_mm = 1.5", "layer_height_mm = 1.0")];
    let (status, said, _) = simulated_cell(cell, &thinner);
    assert_eq!(status, Some(0), "{said}");
    assert!(said.contains("warning") && said.contains("from 25 to 35 rpm"), "{said}");
}

#[test]
fn a_simulation_that_is_ended_leaves_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let cell = changed(CELL, &[("path_mm = 2000.0", "path_mm = 9000000.0")]);
    fs::write(folder.path().join("cell.toml"), cell).unwrap();
    let mut child = std::process::Command::new(cargo_bin("truebead"))
        .current_dir(folder.path())
        .args(["simulate", "cell.toml", "--out", "out", "--record"])
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let begun = folder.path().join("out/widths.csv.partial");
    while !begun.exists() {
        assert_eq!(child.try_wait().unwrap(), None);
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::thread::sleep(std::time::Duration::from_millis(300));
    // The shell's own `kill`: the program of that name is missing on a bare system.
    let interrupt = std::process::Command::new("sh")
        .args(["-c", &format!("kill -INT {}", child.id())])
        .status()
        .unwrap();
    assert!(interrupt.success());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let mut names: Vec<_> = fs::read_dir(folder.path().join("out"))
        .unwrap()
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["recording.mcap", "report.html", "summary.json", "widths.csv"]);
}

#[test]
fn a_bad_rate_is_reported_alone() {
    let (status, said, _) =
        simulated(&[("layer_height_mm", "control_rate_hz = 1e6\nlayer_height_mm")]);
    assert_eq!(status, Some(2));
    assert!(said.contains("control_rate_hz") && !said.contains("unknown"), "{said}");
}

#[test]
fn check_calls_no_cell_sound_whose_model_is_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let cell = include_str!("../cells/extruder-feedforward.toml");
    fs::write(folder.path().join("cell.toml"), cell.replace("../models", "nowhere")).unwrap();
    let output = truebead(folder.path(), &["check", "cell.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let answer = String::from_utf8(output.stdout).unwrap();
    assert!(!answer.contains("sound"), "{answer}");
}
