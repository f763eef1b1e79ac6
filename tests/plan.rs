//! `truebead plan`: a job from its file to a plan that keeps its limits, and what is
//! answered to jobs and cells that cannot be planned.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::fs;
use std::path::Path;

use common::{said, truebead};

const CELL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/cells/extruder-feedforward.toml");
const JOBS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/jobs");
/// What that cell allows.
const ACCEL: f64 = 500.0;
const RPM: (f64, f64) = (0.0, 60.0);
const RPM_PER_S: f64 = 200.0;

fn plan(job: &str, cell: &str, out: &Path, args: &[&str], code: i32) -> String {
    let mut command = truebead(&["plan", job, "--cell", cell, "--out"]);
    said(command.arg(out).args(args), code)
}

/// A job of this text.
fn job(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Columns of a plan by their names; what is empty is not a number.
fn columns<const N: usize>(out: &Path, names: [&str; N]) -> Vec<[f64; N]> {
    let mut reader = csv::Reader::from_path(out.join("plan.csv")).unwrap();
    let heading = reader.headers().unwrap().clone();
    let places = names.map(|name| heading.iter().position(|found| found == name).unwrap());
    let rows = reader.records().map(Result::unwrap);
    rows.map(|row| places.map(|place| row[place].parse().unwrap_or(f64::NAN))).collect()
}

fn keeps_its_limits(out: &Path) {
    let names = ["time_s", "path_mm", "speed_mm_per_s", "nominal_speed_mm_per_s", "command_rpm"];
    let rows = columns(out, names);
    for pair in rows.windows(2) {
        let [[t0, s0, v0, _, u0], [t1, s1, v1, nominal, u1]] = [pair[0], pair[1]];
        let dt = t1 - t0;
        assert!(dt > 0.0 && s1 >= s0, "{pair:?}");
        // Numbers are written with six decimals.
        assert!((v1 - v0).abs() <= ACCEL * dt + 1e-3, "{pair:?}");
        assert!(v1 <= nominal + 1e-3, "{pair:?}");
        assert!((u1 - u0).abs() <= RPM_PER_S * dt + 1e-3, "{pair:?}");
        assert!((RPM.0..=RPM.1).contains(&u1), "{pair:?}");
        assert!((s1 - s0 - 0.5 * (v0 + v1) * dt).abs() < 0.5 * ACCEL * dt * dt + 1e-3, "{pair:?}");
    }
}

#[test]
fn a_table_is_planned_within_the_limits_of_its_cell() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let job = format!("{JOBS}/corner.csv");
    let answer = plan(&job, CELL, out, &["--nozzle-mm", "20"], 0);
    assert!(answer.contains("length     700.0 mm in 1 bead"), "{answer}");
    for part in ["nominal ", "planned ", "RMS of the width", "slowest ", "command ", "report.html"]
    {
        assert!(answer.contains(part), "{part}: {answer}");
    }
    keeps_its_limits(out);
    // The corner's own point has a row.
    let rows = columns(out, ["path_mm", "x_mm", "y_mm", "z_mm", "width_mm"]);
    let corner = rows.iter().find(|row| (row[0] - 300.0).abs() < 1e-5).unwrap();
    assert!((corner[1] - 300.0).abs() < 1e-5 && corner[2].abs() < 1e-5 && corner[3] == 5.0);
    assert!(rows[0][4].is_nan() && (corner[4] - 3.0).abs() < 0.6, "{corner:?}");
    assert!((rows.last().unwrap()[0] - 700.0).abs() < 1e-5);
    // Without time there is no better plan than to be late.
    let width_rms = |answer: &str| -> f64 {
        let line = answer.lines().find(|line| line.starts_with("error ")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    };
    let none = plan(&job, CELL, out, &["--nozzle-mm", "20", "--budget-s", "0"], 0);
    assert!(none.contains(", 0.00 s added"), "{none}");
    assert!(width_rms(&answer) < 0.5 * width_rms(&none), "{answer}{none}");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for part in
        ["width [mm]", "width error [mm]", "command [rpm]", "The width is predicted to stray"]
    {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.contains("More time (--budget-s)"), "a plan without time is no good one");
}

#[test]
fn every_bead_of_gcode_is_planned_from_rest_to_rest() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let text = "G1 X150 F6000\nG0 Y50\nG1 X50 F3000\n";
    let answer = plan(
        &job(folder.path(), "two.NC", text),
        CELL,
        &out,
        &["--budget-s", "0.3", "--nozzle-mm", "9"],
        0,
    );
    assert!(answer.contains("250.0 mm in 2 beads"), "{answer}");
    let rows = columns(&out, ["bead", "time_s", "x_mm", "speed_mm_per_s"]);
    for (bead, from, to) in [(1.0, 0.0, 150.0), (2.0, 150.0, 50.0)] {
        let rows: Vec<_> = rows.iter().filter(|row| row[0] == bead).collect();
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        assert_eq!([first[1], first[2], first[3]], [0.0, from, 0.0]);
        assert!((last[2] - to).abs() < 1e-3 && last[3] < 1.0, "{last:?}");
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("from line 1 on") && page.contains("from line 3 on"));
    // A corner that may be rounded is passed faster.
    let sharp = format!("{JOBS}/corner.gcode");
    let round =
        plan(&sharp, CELL, &out, &["--corner-mm", "1", "--nozzle-mm", "20", "--budget-s", "0"], 0);
    assert!(round.contains("slowest    34.7 mm/s"), "{round}");
    keeps_its_limits(&out);
}

#[test]
fn a_job_that_is_none_is_refused_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let table = fs::read_to_string(format!("{JOBS}/corner.csv")).unwrap();
    let fast = table.replace("5,100\n290", "5,300\n290");
    for (name, text, parts) in [
        ("a.csv", table.replace("5,2\n", "5,slow\n"), ["line 4", "a number is expected"]),
        ("b.csv", table.replace("z_mm", "height"), ["no column z_mm", "speed_mm_per_s"]),
        ("c.csv", fast, ["300.000 mm/s", "at most 220 mm/s, max_speed_mm_per_s"]),
        ("a.gcode", "G1 F600 X1\nG28\n".to_owned(), ["line 2", "G28"]),
        ("b.g", "G1 F600 X1\nG2 X9\n".to_owned(), ["line 2", "I and J"]),
        ("c.txt", table.clone(), ["job", ".csv, .gcode, .nc, .g"]),
    ] {
        let out = folder.path().join("out");
        let words = plan(&job(folder.path(), name, &text), CELL, &out, &[], 2);
        assert!(words.contains(name), "{words}");
        assert!(parts.iter().all(|part| words.contains(part)), "{name}: {words}");
        assert!(!out.exists(), "{name}");
    }
    let words = plan(&format!("{JOBS}/none.csv"), CELL, folder.path(), &[], 2);
    assert!(words.contains("none.csv: No such file"), "{words}");
}

#[test]
fn what_cannot_be_planned_for_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let corner = format!("{JOBS}/corner.csv");
    let cell = |name: &str| format!("{}/cells/{name}", env!("CARGO_MANIFEST_DIR"));
    let words = plan(&corner, &cell("extruder.toml"), folder.path(), &[], 2);
    assert!(words.contains("strategy") && words.contains("\"feedforward\""), "{words}");
    let words = plan(&corner, &cell("barjuei2022.toml"), folder.path(), &[], 2);
    assert!(words.contains("[extruder]") && words.contains("\"feedforward\""), "{words}");
    for (args, part) in [
        (["--budget-s", "-1"], "--budget-s -1: expected 0 or more seconds"),
        (["--nozzle-mm", "0"], "--nozzle-mm 0: expected a length above 0"),
        (["--corner-mm", "1"], "--corner-mm is for G-code"),
    ] {
        let words = plan(&corner, CELL, folder.path(), &args, 2);
        assert!(words.contains(part), "{words}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    // 250 mm/s take 1004 mm³/s and more than the 60 rpm of the cell.
    let faster = fs::read_to_string(CELL).unwrap().replace("= 220.0", "= 400.0");
    let faster = faster.replace("../models", &format!("{}/models", env!("CARGO_MANIFEST_DIR")));
    let cell = job(folder.path(), "cell.toml", &faster);
    let fast = fs::read_to_string(&corner).unwrap().replace("5,100\n", "5,300\n");
    let words = plan(&job(folder.path(), "fast.csv", &fast), &cell, folder.path(), &[], 2);
    assert!(words.contains("300.000 mm/s take") && words.contains("allows 0 to 60 rpm"), "{words}");
}
