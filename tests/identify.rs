//! `truebead extruder identify` and `models`: from a log to a model that a
//! cell can look up, and what bad data are answered with.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use truebead::identify::model_file;
use truebead::sim::flow_log;
use truebead::sim::hash::{mix, normal_pair};

use common::{said, truebead};

/// The command for a log in a folder, which finds one form quickly.
fn identify(log: &Path, more: &[&str]) -> Command {
    let columns = ["--input", "screw_rpm", "--output", "flow_mm3_per_s", "--model", "sopdt"];
    let mut command = truebead(&["extruder", "identify"]);
    command.arg(log).args(columns).args(more);
    command.arg("--out").arg(log.with_extension("out"));
    command
}

/// A log of the simulated extruder, with its lines changed.
fn log(folder: &Path, change: impl FnOnce(&mut Vec<String>)) -> PathBuf {
    let mut lines: Vec<String> =
        flow_log::binary().unwrap().to_csv().lines().map(str::to_owned).collect();
    change(&mut lines);
    let path = folder.join("log.csv");
    fs::write(&path, lines.join("\n") + "\n").unwrap();
    path
}

/// The answer to a log that no model can be found in.
fn refused(change: impl FnOnce(&mut Vec<String>), more: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let log = log(folder.path(), change);
    let said = said(&mut identify(&log, more), 1);
    assert!(said.starts_with("error: ") && said.contains("log.csv"), "{said}");
    assert!(!log.with_extension("out").exists());
    said
}

/// Every line after the names with its cells changed.
fn each(lines: &mut [String], change: impl Fn(usize, [f64; 3]) -> [f64; 3]) {
    for (k, line) in lines.iter_mut().skip(1).enumerate() {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let [time, rpm, flow] = change(k, [cells[0], cells[1], cells[2]]);
        *line = format!("{time},{rpm},{flow}");
    }
}

#[test]
fn the_example_becomes_a_model_that_is_found_in_a_library() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let example = said(&mut truebead(&["extruder", "identify", "--example", &at("example")]), 0);
    assert!(example.contains("gain 19.05"), "{example}");
    let answer = said(
        &mut truebead(&[
            "extruder",
            "identify",
            &at("example/log.csv"),
            "--input",
            "screw_rpm",
            "--output",
            "flow_mm3_per_s",
            "--validate",
            &at("example/other.csv"),
            "--model",
            "fopdt",
            "--model",
            "sopdt",
            "--material",
            "PLA",
            "--nozzle-mm",
            "0.4",
            "--temperature-c",
            "210",
            "--out",
            &at("models/pla"),
            "--library",
            &at("models"),
        ]),
        0,
    );
    for part in ["chosen     sopdt", "dead_time_s", "mm³/s per rpm", "validated", "model.toml"] {
        assert!(answer.contains(part), "{part} in {answer}");
    }
    let json = fs::read_to_string(at("models/pla/identify.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!((json["model"]["dc_gain"].as_f64().unwrap() - 19.05).abs() < 0.4);
    assert_eq!(json["compared"].as_array().unwrap().len(), 2);
    assert!(fs::read_to_string(at("models/pla/report.html")).unwrap().contains("<svg"));
    let text = fs::read_to_string(at("models/pla/model.toml")).unwrap();
    assert!(model_file::parse("model.toml", &text).unwrap().transfer.is_stable());
    // In the library of a cell.
    let kept = "models/pla-0.4mm-210c-rpm-to-mm3_per_s.toml";
    assert!(answer.contains(kept), "{answer}");
    assert_eq!(fs::read_to_string(at(kept)).unwrap(), text);
    fs::rename(at(kept), at("models/pla-210.toml")).unwrap();
    fs::write(at("models/petg.toml"), text.replace("\"PLA\"", "\"PETG\"")).unwrap();
    let list = said(&mut truebead(&["extruder", "models", &at("models")]), 0);
    assert!(list.contains("petg.toml") && list.contains("pla-210.toml"), "{list}");
    let wanted = |temperature: &'static str| {
        let look = ["--material", "pla", "--nozzle-mm", "0.4", "--temperature-c", temperature];
        let mut command = truebead(&["extruder", "models", &at("models")]);
        command.args(look);
        command
    };
    let found = said(&mut wanted("207"), 0);
    assert!(found.contains("pla-210.toml") && found.contains("+3 °C off"), "{found}");
    let absent = said(&mut wanted("230"), 1);
    assert!(absent.contains("no model for pla") && absent.contains("petg.toml"), "{absent}");
    fs::write(at("models/again.toml"), &text).unwrap();
    let twice = said(&mut wanted("210"), 1);
    assert!(twice.contains("2 models for pla") && twice.contains("again.toml"), "{twice}");
    fs::write(at("models/wrong.toml"), text.replace("numerator", "nominator")).unwrap();
    fs::remove_file(at("models/again.toml")).unwrap();
    let list =
        truebead(&["extruder", "models", &at("models")]).assert().code(2).get_output().clone();
    let [listed, wrong] = [list.stdout, list.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(wrong.contains("transfer.nominator: found an unknown key"), "{wrong}");
    assert!(listed.contains("petg.toml") && !listed.contains("wrong.toml"), "{listed}");
    let found = wanted("210").assert().code(0).get_output().clone();
    let warned = String::from_utf8(found.stderr).unwrap();
    assert!(warned.contains("warning: not looked at") && warned.contains("wrong.toml"), "{warned}");
}

#[test]
fn no_model_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let log = log(folder.path(), |_| {});
    let library = folder.path().join("library");
    let holds_for = "--material PLA --nozzle-mm 0.4 --temperature-c 210 --library";
    let keep = |out: &str, form: &str, code: i32| {
        let mut command = truebead(&["extruder", "identify"]);
        let columns = ["--input", "screw_rpm", "--output", "flow_mm3_per_s", "--model", form];
        command.arg(&log).args(columns).args(holds_for.split(' ')).arg(&library);
        said(command.arg("--out").arg(folder.path().join(out)), code)
    };
    let first = keep("first", "sopdt", 0);
    let taken = keep("first", "fopdt", 2);
    assert!(taken.contains("model.toml is there already and would be lost"), "{taken}");
    let kept = library.join("pla-0.4mm-210c-rpm-to-mm3_per_s.toml");
    let text = fs::read_to_string(&kept).unwrap();
    assert!(first.contains(kept.to_str().unwrap()), "{first}");
    keep("again", "sopdt", 0);
    let other = keep("other", "fopdt", 1);
    assert!(other.contains("another model for the same") && other.contains("other/model.toml"));
    assert_eq!(fs::read_to_string(&kept).unwrap(), text);
    assert_eq!(fs::read_dir(&library).unwrap().count(), 1);
}

#[test]
fn cells_that_are_no_numbers_are_named_with_line_and_column() {
    let said = refused(|lines| lines[411] = "8.20,35.000,NaN".to_owned(), &[]);
    assert!(said.contains("line 412, column flow_mm3_per_s: found \"NaN\""), "{said}");
    let said = refused(|lines| lines[411] = "8.20,off,530.1".to_owned(), &[]);
    assert!(said.contains("line 412, column screw_rpm: found \"off\""), "{said}");
}

#[test]
fn gaps_are_named_and_bridged_where_that_is_told() {
    let cut = |lines: &mut Vec<String>| drop(lines.drain(1000..1050));
    let said_so = refused(cut, &[]);
    assert!(said_so.contains("line 1000: a gap of 1.020 s after 19.960 s"), "{said_so}");
    assert!(said_so.contains("--max-gap-s"), "{said_so}");
    let folder = tempfile::tempdir().unwrap();
    let answer = said(&mut identify(&log(folder.path(), cut), &["--max-gap-s", "2"]), 0);
    assert!(answer.contains("1 gap bridged by straight lines"), "{answer}");
}

#[test]
fn time_that_falls_or_repeats_or_is_in_another_unit() {
    let said_so = refused(|lines| lines[501] = lines[500].clone(), &[]);
    assert!(said_so.contains("line 502: time repeats at sample 501"), "{said_so}");
    let milliseconds = |lines: &mut Vec<String>| {
        each(lines, |_, [time, rpm, flow]| [(time * 1000.0).round(), rpm, flow]);
    };
    let said_so = refused(milliseconds, &[]);
    assert!(said_so.contains("steps. Is the column in ms?"), "{said_so}");
    let folder = tempfile::tempdir().unwrap();
    let told = log(folder.path(), milliseconds);
    let answer = said(&mut identify(&told, &["--unit", "time_s=ms"]), 0);
    assert!(answer.contains("at 50.00 Hz"), "{answer}");
}

#[test]
fn columns_that_tell_nothing() {
    let said = refused(|lines| each(lines, |_, [t, _, flow]| [t, 30.0, flow]), &[]);
    assert!(said.contains("the input is 30 all the time"), "{said}");
    let said = refused(|lines| each(lines, |_, [t, rpm, _]| [t, rpm, 540.0]), &[]);
    assert!(said.contains("the output is 540 all the time"), "{said}");
    let clipped = |lines: &mut Vec<String>| each(lines, |_, [t, r, flow]| [t, r, flow.min(570.0)]);
    let said = refused(clipped, &[]);
    assert!(said.contains("the output is cut off") && said.contains("570"), "{said}");
    let cut = |lines: &mut Vec<String>| {
        each(lines, |k, [t, _, flow]| {
            let k = f64::from(u32::try_from(k).unwrap());
            [t, (30.0 + 9.0 * (0.05 * k).sin() + 5.0 * (0.13 * k).sin()).clamp(25.0, 35.0), flow]
        });
    };
    let said = refused(cut, &[]);
    assert!(said.contains("the input is cut off") && said.contains("value, 25, in"), "{said}");
    let said = refused(|lines| each(lines, |_, [t, rpm, _]| [t, rpm, rpm]), &[]);
    assert!(said.contains("the same from sample to sample"), "{said}");
    let said = refused(|lines| lines.truncate(40), &[]);
    assert!(said.contains("39 samples: a model takes 50 or more"), "{said}");
    let said = refused(|_| {}, &["--validate-fraction", "0.005"]);
    assert!(said.contains("25 samples are left to validate with"), "{said}");
}

#[test]
fn fits_that_cannot_be_trusted() {
    // A flow that only ever grows with the screw's turns.
    let said = refused(
        |lines| {
            let mut turns = 0.0;
            for line in lines.iter_mut().skip(1) {
                let cells: Vec<&str> = line.split(',').collect();
                turns += cells[1].parse::<f64>().unwrap() - 25.0;
                *line = format!("{},{},{turns}", cells[0], cells[1]);
            }
        },
        &["--model", "fopdt"],
    );
    assert!(said.contains("no model can be trusted"), "{said}");
    assert!(said.contains("edge of stability") || said.contains("does not determine"), "{said}");
    // Numbers that have nothing to do with the input.
    let noise = |k: usize| f64::from(u32::try_from(k * 7919 % 101).unwrap());
    let said = refused(|lines| each(lines, |k, [t, r, _]| [t, r, noise(k)]), &[]);
    assert!(said.contains("no model can be trusted:\n  sopdt: "), "{said}");
}

#[test]
fn arguments_that_are_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let log = log(folder.path(), |_| {});
    let other = |input: &str| {
        let mut command = truebead(&["extruder", "identify", log.to_str().unwrap()]);
        command.args(["--input", input, "--output", "flow_mm3_per_s"]);
        command
    };
    let columns = said(&mut other("screw"), 2);
    assert!(
        columns.contains("no column screw; the columns are time_s, screw_rpm, flow_mm3_per_s"),
        "{columns}"
    );
    let same = said(&mut other("flow_mm3_per_s"), 2);
    assert!(same.contains("are both flow_mm3_per_s"), "{same}");
    for (more, expected) in [
        (["--model", "1,2"], "no more zeros than poles"),
        (["--hampel", "0,3"], "half width of 0"),
        (["--smooth", "10,3"], "odd number from 5"),
        (["--unit", "screw_rpm=turns"], "expected one of rpm"),
        (["--unit", "screw=rpm"], "--unit screw: no such column"),
        (["--validate-fraction", "0.95"], "expected 0 to 0.9"),
        (["--validate", "none.csv"], "none.csv"),
        (["--nozzle-mm", "0"], "0.01 to 1000"),
        (["--nozzle-mm", "-1"], "0.01 to 1000"),
        (["--dead-time-s", "-1"], "expected 0 to 10000 s, a range of them"),
        (["--dead-time-s", "-1..2"], "expected 0 to 10000 s, a range of them"),
        (["--max-gap-s", "-1"], "expected 0 to 10000 s"),
        (["--validate", log.to_str().unwrap()], "the data that the model is fitted to"),
    ] {
        let said = said(other("screw_rpm").args(more), 2);
        assert!(said.contains(expected), "{more:?}: {said}");
    }
}

/// A cell of this repository with its profile, some lines changed, and the
/// recording of its simulated run.
fn recorded(folder: &Path, change: impl FnOnce(String) -> String) -> PathBuf {
    let cells = Path::new(env!("CARGO_MANIFEST_DIR")).join("cells");
    let text = fs::read_to_string(cells.join("extruder-excite.toml")).unwrap();
    fs::write(folder.join("cell.toml"), change(text)).unwrap();
    fs::copy(cells.join("excite.csv"), folder.join("excite.csv")).unwrap();
    let out = folder.join("run");
    let run = ["simulate", "--record", "--seed", "7", "--out", out.to_str().unwrap()];
    truebead(&run).arg(folder.join("cell.toml")).assert().code(0);
    out.join("recording.mcap")
}

/// The number behind a name in the table of parameters, and its error.
fn parameter(answer: &str, name: &str) -> (f64, f64) {
    let line = answer.lines().find(|line| line.trim_start().starts_with(name)).unwrap();
    let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    (numbers[0], numbers[1])
}

#[test]
fn from_a_simulated_run_to_a_cell_with_the_model() {
    let folder = tempfile::tempdir().unwrap();
    let recording = recorded(folder.path(), |text| text);
    let recording = recording.to_str().unwrap();
    let list = said(&mut truebead(&["extruder", "columns", recording]), 0);
    for part in ["command_rpm ", "50.00 Hz", "width_mm ", "laid_flow_mm3_per_s ", "mm³/s"] {
        assert!(list.contains(part), "{part} in {list}");
    }
    let out = folder.path().join("model");
    let columns = ["--input", "command_rpm", "--output", "laid_flow_mm3_per_s", "--from-s", "4"];
    let mut command = truebead(&["extruder", "identify", recording, "--model", "sopdt"]);
    let answer = said(command.args(columns).arg("--out").arg(&out), 0);
    // The cell's plant: 18 / (0.656 s² + 0.975 s + 1), 0.25 s of dead time.
    for (name, truth) in
        [("gain", 18.0), ("period_s", 0.656_f64.sqrt()), ("damping", 0.602), ("dead_time_s", 0.25)]
    {
        let (found, sigma) = parameter(&answer, name);
        let off = (found - truth).abs();
        assert!(off < 3.0 * sigma && sigma < 0.12 * truth, "{name}: {found} ± {sigma}");
    }
    assert!(answer.contains("held from sample to sample"), "{answer}");
    assert!(answer.contains("samples that say as much as"), "{answer}");
    // A cell that commands by that model.
    let cells = Path::new(env!("CARGO_MANIFEST_DIR")).join("cells");
    let text = fs::read_to_string(cells.join("extruder-feedforward.toml")).unwrap();
    let of_a_library = ["material", "nozzle_mm", "temperature_c"];
    let by_model = |line: &str| match line {
        line if line.starts_with("library = ") => Some("model = \"model/model.toml\"".to_owned()),
        line if of_a_library.iter().any(|key| line.starts_with(key)) => None,
        line => Some(line.to_owned()),
    };
    let text = text.lines().filter_map(by_model).collect::<Vec<_>>().join("\n");
    let cell = folder.path().join("feedforward.toml");
    fs::write(&cell, text).unwrap();
    let run = folder.path().join("by-model");
    truebead(&["simulate"]).arg(&cell).arg("--out").arg(&run).assert().code(0);
}

#[test]
fn what_a_recording_cannot_be_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let shorter = |text: String| text.replace("path_mm = 7000.0", "path_mm = 1500.0");
    let recording = recorded(folder.path(), shorter);
    let recording = recording.to_str().unwrap();
    let ask = |args: &str, code| {
        let mut command = truebead(&["extruder", "identify", recording]);
        said(command.args(args.split(' ')).arg("--out").arg(folder.path().join("m")), code)
    };
    let told = ask("--input command_v --output width_mm", 2);
    assert!(told.contains("no column command_v; the columns are command_rpm,"), "{told}");
    let told = ask("--input command_rpm", 2);
    assert!(told.contains("needs both --input and --output"), "{told}");
    let told = ask("--input command_rpm --width width_mm --speed a --layer-height-mm 1", 2);
    assert!(told.contains("--width is for tables") && told.contains("laid_flow"), "{told}");
    let told = ask("--input command_rpm --output width_mm --from-s 9.9", 1);
    assert!(told.contains("a model takes 50 or more"), "{told}");
    // A recording is not written over.
    let mut again = truebead(&["simulate", "--record"]);
    again.arg(folder.path().join("cell.toml")).arg("--out").arg(folder.path().join("run"));
    assert!(said(&mut again, 2).contains("recording.mcap is there already"));
}

/// A log of a bead that is measured 40 mm behind the nozzle while the speed
/// changes, from the log of an extruder.
fn bead_log(folder: &Path) -> PathBuf {
    let log = flow_log::binary().unwrap();
    let speed = |t: f64| 60.0 + 25.0 * (0.9 * t).sin();
    let way = |t: f64| 60.0 * t + 25.0 / 0.9 * (1.0 - (0.9 * t).cos());
    let area = |k: usize| log.flow_mm3_per_s[k] / speed(log.time_s[k]);
    let mut text = "time_s,screw_rpm,way_mm,wheel_mm_per_s,area_mm2,width_mm\n".to_owned();
    let mut laid = 0;
    for (k, t) in log.time_s.iter().enumerate() {
        while way(log.time_s[laid + 1]) + 40.0 <= way(*t) {
            laid += 1;
        }
        let (from, to) = (way(log.time_s[laid]) + 40.0, way(log.time_s[laid + 1]) + 40.0);
        let share = ((way(*t) - from) / (to - from)).max(0.0);
        let area = area(laid) + (area(laid + 1) - area(laid)) * share;
        let width = (area - std::f64::consts::FRAC_PI_4 * 4.0) / 2.0 + 2.0;
        let (rpm, way, speed) = (log.screw_rpm[k], way(*t), speed(*t));
        writeln!(text, "{t:.2},{rpm},{way:.5},{speed:.5},{area:.5},{width:.5}").unwrap();
    }
    let path = folder.join("bead.csv");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_flow_that_was_measured_on_the_bead_is_the_flow_at_the_nozzle() {
    let folder = tempfile::tempdir().unwrap();
    let log = bead_log(folder.path());
    let ask = |args: &str, code| {
        let mut command = truebead(&["extruder", "identify"]);
        command.arg(&log).args(args.split(' ')).args(["--model", "sopdt", "--input", "screw_rpm"]);
        let out = tempfile::tempdir_in(folder.path()).unwrap();
        said(command.arg("--out").arg(out.path()), code)
    };
    let aligned = "--speed wheel_mm_per_s --position way_mm --measured-at-offset-mm 40";
    for of in ["--area area_mm2", "--width width_mm --layer-height-mm 2"] {
        let answer = ask(&format!("{of} {aligned}"), 0);
        assert!(answer.contains("their bead has not been measured"), "{answer}");
        for (name, truth) in
            [("gain", 19.05), ("period_s", 0.81), ("damping", 0.6), ("dead_time_s", 0.25)]
        {
            let (found, sigma) = parameter(&answer, name);
            assert!((found - truth).abs() < 4.0 * sigma, "{of}: {name} {found} ± {sigma}");
        }
    }
    // Without the way, area and speed are of different moments, and no model tells their product.
    let told = ask("--area area_mm2 --speed wheel_mm_per_s --validate-fraction 0", 1);
    assert!(told.contains("no model can be trusted"), "{told}");
    for (args, code, expected) in [
        ("--area area_mm2", 2, "--speed"),
        ("--area area_mm2 --speed way_mm", 2, "way_mm is in mm, expected mm/s"),
        ("--area area_mm2 --speed wheel_mm_per_s --measured-at-offset-mm 4", 2, "needs --position"),
        ("--output area_mm2 --position way_mm", 2, "--measured-at-offset-mm"),
        ("--output area_mm2 --position way_mm --measured-at-offset-mm -1", 2, "expected 0 to 1e5"),
        ("--output area_mm2 --position time_s --measured-at-offset-mm 1", 2, "time_s"),
        ("--output width_mm --position way_mm --measured-at-offset-mm 90000", 1, "goes on by"),
        ("--width width_mm --speed wheel_mm_per_s", 2, "--layer-height-mm"),
        (
            "--width width_mm --speed wheel_mm_per_s --layer-height-mm 9",
            1,
            "bead.csv, line 2, column width_mm",
        ),
        ("--area thick_mm2 --speed wheel_mm_per_s", 2, "there is no column thick_mm2"),
    ] {
        let told = ask(args, code);
        assert!(told.contains(expected), "{args}: {told}");
    }
    let list = said(truebead(&["extruder", "columns"]).arg(&log), 0);
    assert!(list.contains("area_mm2 ") && list.contains("50.00 Hz"), "{list}");
    assert!(!list.contains("time_s"), "{list}");
}

#[test]
fn the_noise_of_a_pressure_is_told_in_the_keys_of_a_cell() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("standing.csv");
    // 7 kPa of noise on a pressure that gains 1 kPa from reading to reading.
    let mut text = "time_s,nozzle_bar,screw_rpm\n".to_owned();
    let mut pressure = 0.6;
    for i in 0..6000_u32 {
        let [step, noise] = normal_pair(mix(&[11, u64::from(i)]));
        pressure += 0.001 * step;
        let bar = 10.0 * 0.007_f64.mul_add(noise, pressure);
        writeln!(text, "{:.3},{bar:.5},30", f64::from(i) * 0.02).unwrap();
    }
    fs::write(&file, &text).unwrap();
    let of = |more: &[&str], code| {
        let mut command = truebead(&["extruder", "noise"]);
        said(command.arg(&file).args(more), code)
    };
    let told = of(&["--column", "nozzle_bar"], 0);
    let value = |key: &str| {
        let line = told.lines().find(|line| line.starts_with(key)).unwrap();
        line.split_whitespace().nth(2).unwrap().parse::<f64>().unwrap()
    };
    assert!((value("sensor_noise_mpa") / 0.007 - 1.0).abs() < 0.05, "{told}");
    assert!((value("drift_mpa2").sqrt() / 0.001 - 1.0).abs() < 0.25, "{told}");
    for (column, code, words) in
        [("screw_rpm", 2, "expected a pressure"), ("nozzle_mpa", 2, "nozzle_mpa")]
    {
        let told = of(&["--column", column], code);
        assert!(told.contains(words), "{told}");
    }
    let few = of(&["--column", "nozzle_bar", "--from-s", "118"], 1);
    assert!(few.contains("at least 200"), "{few}");
}
