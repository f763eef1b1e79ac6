//! `truebead extruder excite`: profiles that a cell plays, and what is answered to ones that
//! it cannot.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::fs;

use truebead::identify::command_profile::file::parse;

use common::{said, truebead};

#[test]
fn profiles_are_written_as_a_cell_plays_them() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("profile.csv");
    let excite = |args: &str| {
        let _ = fs::remove_file(&out);
        let mut command = truebead(&["extruder", "excite"]);
        command.args(args.split(' ')).arg("--out").arg(&out);
        command
    };
    let answer = said(
        &mut excite(
            "prbs --low 20 --high 40 --bit-s 0.7 --lead-in-s 5 --lead-out-s 3 --quantity screw_rpm",
        ),
        0,
    );
    assert!(answer.contains("129 values of screw_rpm, 96.9 s"), "{answer}");
    assert!(answer.contains("20 to 40 rpm") && answer.contains("0.0112 to 0.6329 Hz"), "{answer}");
    let (profile, _) = parse(&fs::read_to_string(&out).unwrap()).unwrap();
    assert_eq!([profile.at(4.9), profile.at(5.1), profile.at(96.0)], [30.0, 40.0, 30.0]);
    let gaussian = "gaussian --low 2 --high 4 --hold-s 1.5 --duration-s 90 --quantity drive_v";
    assert!(said(&mut excite(gaussian), 0).contains("60 values of drive_v, 90.0 s"));
    let steps = "steps --levels 20,40,30 --hold-s 15 --quantity rpm";
    let answer = said(&mut excite(steps), 0);
    assert!(answer.contains("20 to 40 rpm") && answer.contains("up to 0.0295 Hz"), "{answer}");
    let unit = said(&mut excite("steps --levels 1,2 --hold-s 1 --quantity speed"), 2);
    assert!(unit.contains("ends with its unit"), "{unit}");
    let endless = said(&mut excite("gaussian --low 2 --high 4 --hold-s 1 --quantity drive_v"), 2);
    assert!(endless.contains("give --duration-s"), "{endless}");
    let one = said(&mut excite("steps --levels 20 --hold-s 15 --quantity rpm"), 2);
    assert!(one.contains("1 level: a step takes two"), "{one}");
    let same = said(&mut excite("steps --levels 20,20 --hold-s 15 --quantity rpm"), 2);
    assert!(same.contains("20 from the beginning to the end"), "{same}");
    let flat = said(&mut excite("prbs --low 4 --high 4 --hold-s 1 --quantity rpm"), 2);
    assert!(flat.contains("levels from 4 to 4"), "{flat}");
}

#[test]
fn a_quantity_that_cannot_be_commanded_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let excite = |args: &str, code: i32| {
        let mut command = truebead(&["extruder", "excite", "prbs", "--low", "20", "--high", "40"]);
        said(command.args(args.split(' ')).arg("--out").arg(folder.path().join("p.csv")), code)
    };
    let short = excite("--hold-s 1e-9 --quantity screw_rpm", 2);
    assert!(short.contains("expected 0.001 s or more"), "{short}");
    for (quantity, what) in [("width_mm", "a width or a length"), ("area_mm2", "a section")] {
        let laid = excite(&format!("--hold-s 1 --quantity {quantity}"), 2);
        assert!(laid.contains(what) && laid.contains("such as screw_rpm"), "{laid}");
    }
    // Shorter than the period of a cell's commands, unless that is set.
    let fast = excite("--hold-s 0.004 --quantity screw_rpm", 0);
    assert!(fast.contains("set io_rate_hz of the cell to 250"), "{fast}");
}

#[test]
fn what_is_there_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let profile = folder.path().join("profile.csv");
    fs::write(&profile, "mine").unwrap();
    let steps =
        ["extruder", "excite", "steps", "--levels", "20,30", "--hold-s", "5", "--quantity", "rpm"];
    let taken = said(truebead(&steps).arg("--out").arg(&profile), 2);
    assert!(taken.contains("profile.csv is there already and would be lost"), "{taken}");
    assert_eq!(fs::read_to_string(&profile).unwrap(), "mine");
    fs::write(folder.path().join("other.csv"), "mine").unwrap();
    let taken = said(truebead(&["extruder", "identify", "--example"]).arg(folder.path()), 2);
    assert!(taken.contains("other.csv is there already and would be lost"), "{taken}");
    assert!(!folder.path().join("log.csv").exists());
}

#[test]
fn a_fault_before_the_start_is_named() {
    let cell = concat!(env!("CARGO_MANIFEST_DIR"), "/cells/extruder.toml");
    let sim = said(&mut truebead(&["sim", "extruder", cell, "--fail-after-s", "-1"]), 2);
    assert!(sim.contains("expected seconds after the start of the pump, 0 to 1e7"), "{sim}");
    let robot = said(&mut truebead(&["sim", "robot", "--pause-s", "-1"]), 2);
    assert!(robot.contains("expected 0 to 3600 seconds"), "{robot}");
}
