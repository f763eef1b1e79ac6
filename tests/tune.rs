//! `truebead tune` as a user types it.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::fs;
use std::path::Path;

use common::{said, truebead};
use serde_json::Value;

/// A cell that ships with the program, in a folder of its own.
fn cell(folder: &Path, name: &str) -> String {
    let from = format!("{}/cells/{name}", env!("CARGO_MANIFEST_DIR"));
    let to = folder.join(name);
    fs::copy(from, &to).unwrap();
    to.to_str().unwrap().to_owned()
}

fn path(folder: &Path, name: &str) -> String {
    folder.join(name).to_str().unwrap().to_owned()
}

#[test]
fn a_simulated_cell_is_found_and_its_recording_replays_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (cell, out) = (cell(folder.path(), "barjuei2022.toml"), path(folder.path(), "out"));
    let before = fs::read(&cell).unwrap();
    let text = said(&mut truebead(&["tune", &cell, "--out", &out, "--simulated"]), 0);
    assert!(text.contains("unstable") && text.contains("strategy = \"distance\""), "{text}");
    assert_eq!(fs::read(&cell).unwrap(), before, "the cell was touched");
    let json = fs::read_to_string(format!("{out}/tune.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    let near = |key: &str, truth: f64| {
        let found = &json["found"][key];
        let [value, sigma] = ["value", "sigma"].map(|part| found[part].as_f64().unwrap());
        assert!((value - truth).abs() < 3.5 * sigma, "{key}: {value} ± {sigma}, true {truth}");
    };
    near("offset_mm", 88.4);
    near("exponent", 0.221);
    near("width_mm", 38.61);
    let margins = &json["loops"][2]["margins"];
    assert!(margins["gain"].as_f64().unwrap() > 2.0);
    assert!(margins["phase_deg"].as_f64().unwrap() > 45.0);
    assert!(fs::metadata(format!("{out}/report.html")).unwrap().len() > 10_000);
    let recording = format!("{out}/recording.mcap");
    let replayed = said(&mut truebead(&["replay", &recording]), 0);
    assert!(replayed.contains("all the same bit for bit"), "{replayed}");
    // The same recording tells the same again; an experiment does not replace it.
    let again = path(folder.path(), "again");
    let once_more =
        said(&mut truebead(&["tune", &cell, "--out", &again, "--recording", &recording]), 0);
    assert_eq!(once_more.lines().next(), text.lines().next());
    let refused = said(&mut truebead(&["tune", &cell, "--out", &out, "--simulated"]), 2);
    assert!(refused.contains("is there already"), "{refused}");
}

#[test]
fn what_is_written_differs_in_the_proposed_keys_only_and_holds_the_width() {
    let folder = tempfile::tempdir().unwrap();
    let (cell, out) = (cell(folder.path(), "barjuei2022.toml"), path(folder.path(), "out"));
    let tuned = path(folder.path(), "tuned.toml");
    let arguments = ["tune", &cell, "--out", &out, "--simulated", "--write", &tuned];
    let _ = said(&mut truebead(&arguments), 0);
    let [before, after] = [&cell, &tuned].map(|file| fs::read_to_string(file).unwrap());
    let comments = |text: &str| text.matches('#').count();
    assert_eq!(comments(&before), comments(&after));
    let of = |text: &str| text.parse::<toml::Table>().unwrap();
    let (before, after) = (of(&before), of(&after));
    let proposed = [
        "strategy",
        "exponent",
        "drift_per_root_m",
        "kp_per_s",
        "ki_per_s2",
        "offset_mm",
        "offset_sigma_mm",
    ];
    for (table, keys) in &after {
        for (key, value) in keys.as_table().unwrap() {
            let is_same = before[table].get(key) == Some(value);
            assert!(is_same || proposed.contains(&key.as_str()), "{table}.{key}");
        }
    }
    let sound = said(&mut truebead(&["check", &tuned]), 0);
    assert!(sound.contains("by distance"), "{sound}");
    let again = path(folder.path(), "again");
    let recording = format!("{out}/recording.mcap");
    let mut arguments = vec!["tune", &cell, "--out", &again, "--recording", &recording, "--write"];
    arguments.push(&tuned);
    let refused = said(&mut truebead(&arguments), 2);
    assert!(refused.contains("would be lost"), "{refused}");
}

#[test]
fn a_copy_elsewhere_whose_paths_would_lead_elsewhere_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let cell = format!("{}/cells/live.toml", env!("CARGO_MANIFEST_DIR"));
    let (out, tuned) = (path(folder.path(), "out"), path(folder.path(), "tuned.toml"));
    let arguments = ["tune", &cell, "--out", &out, "--simulated", "--write", &tuned];
    let refused = said(&mut truebead(&arguments), 2);
    assert!(refused.contains("calibration.file"), "{refused}");
    assert!(!Path::new(&out).exists(), "nothing is run before it is known that it can be written");
}

#[test]
fn steps_that_leave_the_limits_are_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let cell = cell(folder.path(), "distance.toml");
    let text = fs::read_to_string(&cell)
        .unwrap()
        .replace("max_speed_mm_per_s = 150.0", "max_speed_mm_per_s = 130.0");
    fs::write(&cell, text).unwrap();
    let out = path(folder.path(), "out");
    let try_share = |share: &str, code| {
        said(
            &mut truebead(&["tune", &cell, "--out", &out, "--simulated", "--step-fraction", share]),
            code,
        )
    };
    let refused = try_share("0.2", 2);
    assert!(refused.contains("step_fraction") && refused.contains("130 mm/s"), "{refused}");
    assert!(refused.contains("distance.toml:"), "{refused}");
    assert!(try_share("0.5", 2).contains("0.02 to 0.3"));
    let _ = try_share("0.15", 0);
}

#[test]
fn a_recording_at_one_speed_tells_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let cell = cell(folder.path(), "distance.toml");
    let text = fs::read_to_string(&cell).unwrap();
    fs::write(&cell, text.replace("start_length_mm = 200.0", "start_length_mm = 1990.0")).unwrap();
    let [out, tuned] = ["steady", "tuned"].map(|name| path(folder.path(), name));
    let _ = said(&mut truebead(&["simulate", &cell, "--out", &out, "--record"]), 0);
    let recording = format!("{out}/recording.mcap");
    let refused =
        said(&mut truebead(&["tune", &cell, "--out", &tuned, "--recording", &recording]), 1);
    assert!(refused.contains("the speed changed by"), "{refused}");
}
