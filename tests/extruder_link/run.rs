//! A live run with a simulated robot and a simulated extruder.

use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::time::Duration;

use wait_timeout::ChildExt;

const CELL: &str = include_str!("../../cells/extruder.toml");

fn truebead() -> Command {
    Command::new(env!("CARGO_BIN_EXE_truebead"))
}

/// A simulated machine that ends with the test.
struct Machine {
    child: Child,
    address: String,
    said: BufReader<ChildStderr>,
}

impl Machine {
    fn start(args: &[&str]) -> Self {
        let mut child = truebead()
            .args(args)
            .args(["--listen", "127.0.0.1:0"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        said.read_line(&mut line).unwrap();
        let address = line.split_whitespace().find(|word| word.starts_with("127.")).unwrap();
        let address = address.trim_end_matches(';').to_owned();
        Self { child, address, said }
    }

    /// Everything that it said after its first line.
    fn end(mut self) -> String {
        self.child.kill().unwrap();
        (&mut self.said).lines().map_while(Result::ok).collect::<Vec<_>>().join("\n")
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A folder with the cell, a robot and an extruder.
struct Bench {
    folder: tempfile::TempDir,
    robot: Machine,
    extruder: Machine,
}

impl Bench {
    /// With some lines of the cell changed, and more for the extruder's own
    /// cell.
    fn new(cell: &str, own: &[(&str, &str)], more: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut theirs = cell.to_owned();
        for (from, to) in own {
            assert!(theirs.contains(from), "{from}");
            theirs = theirs.replace(from, to);
        }
        let file = folder.path().join("extruder.toml");
        fs::write(&file, theirs).unwrap();
        let robot = Machine::start(&["sim", "robot", "--endless", "--pause-s", "0.3"]);
        let mut args = vec!["sim", "extruder", file.to_str().unwrap()];
        args.extend(more);
        let extruder = Machine::start(&args);
        let cell = cell
            .replace("127.0.0.1:5653", &robot.address)
            .replace("127.0.0.1:5654", &extruder.address);
        fs::write(folder.path().join("cell.toml"), cell).unwrap();
        Self { folder, robot, extruder }
    }

    fn start(&self, seconds: &str) -> Child {
        truebead()
            .current_dir(self.folder.path())
            .args(["run", "cell.toml", "--out", "out", "--duration", seconds])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    fn summary(&self) -> serde_json::Value {
        let file = self.folder.path().join("out/summary.json");
        serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap()
    }

    fn replay(&self) -> String {
        let file = self.folder.path().join("out/recording.mcap");
        let output = truebead().arg("replay").arg(file).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}

/// Waits for a run, but not for ever.
fn wait(mut child: Child) -> Output {
    if child.wait_timeout(Duration::from_secs(60)).unwrap().is_none() {
        let _ = child.kill();
        panic!("the program did not end");
    }
    child.wait_with_output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn pulses_that_are_counted_by_an_rpm_that_is_never_reported_are_named_once() {
    let height = "layer_height_mm = 20.0";
    let counted = format!("{height}\npulses_per_turn = 1.0");
    let (cell, plant) = CELL.split_once("[extruder_plant]").unwrap();
    let (plant, simulation) = plant.split_once("[simulation]").unwrap();
    let cell = format!("{}[simulation]{simulation}", cell.replace(height, &counted));
    let own = [
        (counted.as_str(), height),
        ("[simulation]", &format!("[extruder_plant]{plant}[simulation]")),
    ];
    let bench = Bench::new(&cell, &own, &[]);
    let said = said(&wait(bench.start("3")));
    assert!(said.contains("extruder running"), "{said}");
    assert_eq!(said.matches("the extruder reports no rpm").count(), 1, "{said}");
}

#[test]
fn robot_and_extruder_run_together_and_the_recording_replays() {
    let bench = Bench::new(CELL, &[], &[]);
    let output = wait(bench.start("5"));
    let said = said(&output);
    assert!(said.contains("extruder `truebead-sim` is connected"), "{said}");
    assert!(said.contains("extruder running"), "{said}");
    let summary = bench.summary();
    assert_eq!(summary["faults"], 0, "{said}");
    let side = &summary["extruder"];
    assert!(side["states_s"]["running"].as_f64().unwrap() > 0.0, "{side}");
    assert!(side["commands"].as_u64().unwrap() > 0, "{side}");
    assert!(summary["setpoints_sent"].as_u64().unwrap() > 0, "{summary}");
    let page = fs::read_to_string(bench.folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("The extruder"));
    assert!(bench.replay().contains("all the same bit for bit"));
    let Bench { extruder, robot, .. } = bench;
    let heard = extruder.end();
    assert!(heard.contains("pump ON, valve open") && heard.contains("pump OFF"), "{heard}");
    // The pump was commanded to stop; its command did not run out.
    let off = heard.find("pump OFF").unwrap();
    let bye = heard.find("the PC said BYE").unwrap();
    assert!(off < bye, "{heard}");
    assert!(robot.end().contains("-> STOP"));
}

#[test]
fn a_model_goes_into_the_recording_and_the_replay_needs_no_file_of_then() {
    let cell = include_str!("../../cells/extruder-feedforward.toml")
        .replace("library = \"../models\"", "library = \"models\"")
        .replace(
            "max_gap_s = 0.2\n",
            "max_gap_s = 0.2\ndriver = \"line\"\naddress = \"127.0.0.1:5654\"\n",
        )
        .replace("= 220.0", "= 150.0");
    let models = tempfile::tempdir().unwrap();
    let library = models.path().join("models");
    fs::create_dir(&library).unwrap();
    fs::copy("models/example.toml", library.join("example.toml")).unwrap();
    let named = format!("library = \"{}\"", library.display());
    let bench = Bench::new(&cell.replace("library = \"models\"", &named), &[], &[]);
    let output = wait(bench.start("4"));
    let side = bench.summary()["extruder"].clone();
    assert!(side["states_s"]["running"].as_f64().unwrap() > 0.0, "{side} {}", said(&output));
    fs::remove_dir_all(&library).unwrap();
    assert!(bench.replay().contains("all the same bit for bit"));
}

#[test]
fn an_extruder_that_vanishes_stops_the_robot() {
    let long = "max_hold_s = 3.0                # a longer hold";
    assert!(CELL.contains(long));
    let bench = Bench::new(&CELL.replace(long, "max_hold_s = 1.0  # a longer hold"), &[], &[]);
    let mut run = bench.start("15");
    let mut printed = BufReader::new(run.stderr.take().unwrap()).lines().map_while(Result::ok);
    assert!(printed.any(|line| line.contains("extruder running")));
    let Bench { folder, robot, extruder } = bench;
    drop(extruder);
    let rest: Vec<String> = printed.collect();
    assert_eq!(wait(run).status.code(), Some(1), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("extruder holding: link down")), "{rest:?}");
    let file = folder.path().join("out/summary.json");
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(file).unwrap()).unwrap();
    let why = &summary["fault_reasons"]["extruder_held_too_long_link_down"];
    assert_eq!(*why, 1, "{summary}");
    assert!(robot.end().contains("-> STOP"));
}

#[test]
fn a_robot_that_begins_where_no_extruder_answers_is_stopped_with_the_reason() {
    let bench = Bench::new(CELL, &[], &[]);
    let Bench { folder, robot, extruder } = bench;
    drop(extruder);
    let run = truebead()
        .current_dir(folder.path())
        .args(["run", "cell.toml", "--out", "out", "--duration", "5"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let output = wait(run);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("fault: no answer"), "{}", said(&output));
    let summary = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["fault_reasons"]["extruder_no_answer"], 1, "{summary}");
    assert!(robot.end().contains("-> STOP"));
}

#[test]
fn a_pump_that_fails_stops_the_robot_with_the_reason() {
    let bench = Bench::new(CELL, &[], &["--fail-after-s", "1.5"]);
    let output = wait(bench.start("5"));
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let summary = bench.summary();
    assert_eq!(summary["fault_reasons"]["extruder_pump"], 1, "{summary}");
    assert!(bench.replay().contains("all the same bit for bit"));
    let Bench { robot, .. } = bench;
    assert!(robot.end().contains("-> STOP"));
}

#[test]
fn an_extruder_with_narrower_limits_or_another_unit_is_refused() {
    let narrow = [("max_rpm = 90.0", "max_rpm = 70.0")];
    let bench = Bench::new(CELL, &narrow, &[]);
    let output = wait(bench.start("20"));
    let printed = said(&output);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    assert!(
        printed.contains("takes 0 to 70 rpm") && printed.contains("allows 0 to 90"),
        "{printed}"
    );
    let flow = [("command = \"rpm\"", "command = \"flow\""), ("_rpm", "_mm3_per_s")];
    let bench = Bench::new(CELL, &flow, &[]);
    let output = wait(bench.start("20"));
    let printed = said(&output);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    assert!(printed.contains("is commanded in mm3_per_s"), "{printed}");
}

fn refused(cell: &str, command: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("cell.toml"), cell).unwrap();
    let args: &[&str] = if command == "run" { &["--out", "out"] } else { &[] };
    let output = truebead()
        .current_dir(folder.path())
        .args(command.split(' '))
        .arg("cell.toml")
        .args(args)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(!folder.path().join("out").exists());
    said(&output)
}

#[test]
fn what_is_missing_or_wrong_in_a_cell_is_told_before_anything_moves() {
    let bare = CELL.replace("driver = \"line\"                 # driver", "# driver");
    let bare = bare.replace("address = \"127.0.0.1:5654\"", "");
    assert!(refused(&bare, "run").contains("extruder.driver"));
    let mute = CELL.replace("127.0.0.1:5654", "localhost");
    assert!(refused(&mute, "run").contains("extruder.address"));
    let slow =
        CELL.replace("max_gap_s = 0.2 ", "valid_ms = 100\nio_rate_hz = 5.0\nmax_gap_s = 0.2 ");
    assert!(refused(&slow, "run").contains("one and a half periods of io_rate_hz"));
    let both = CELL.replace("127.0.0.1:5654", "127.0.0.1:5653");
    assert!(refused(&both, "run").contains("another than robot.address"));
    let gap = CELL.replace("max_gap_s = 0.2 ", "max_gap_s = 4.0 ");
    assert!(refused(&gap, "run").contains("at most max_hold_s"));
    let cut = CELL.find("[extruder]").unwrap();
    let end = CELL.find("[simulation]").unwrap();
    let none = CELL.replace(&CELL[cut..end], "");
    assert!(refused(&none, "sim extruder").contains("[extruder]: found nothing"));
}
