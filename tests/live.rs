//! The program as an operator runs it: the demo, a run against a robot, and
//! what is left when it is killed.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a test may fail and look at the clock"
)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use truebead::io::recording::{RecordedEntry, Recording};
use wait_timeout::ChildExt;

fn truebead() -> Command {
    Command::new(env!("CARGO_BIN_EXE_truebead"))
}

/// Waits for a child, but not for ever.
fn wait(mut child: Child) -> i32 {
    let Some(status) = child.wait_timeout(Duration::from_secs(60)).unwrap() else {
        let _ = child.kill();
        panic!("the program did not end");
    };
    status.code().unwrap_or(-1)
}

fn summary(folder: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(folder.join("summary.json")).unwrap()).unwrap()
}

fn replay(recording: &Path) -> String {
    let output = truebead().arg("replay").arg(recording).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn the_demo_closes_the_loop_and_its_recording_replays_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let status = truebead().args(["demo", "--seconds", "6", "--out"]).arg(&out).status().unwrap();
    assert!(status.success());
    let summary = summary(&out);
    assert_eq!(summary["faults"], 0);
    assert_eq!(summary["target_width_mm"], 42.0);
    assert!(summary["setpoints_sent"].as_u64().unwrap() >= 20);
    assert!(summary["latency_ms"]["p50"].as_f64().unwrap() > 0.0);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("<svg") && !page.contains("src=\"http"));
    assert!(replay(&out.join("recording.mcap")).contains("all the same bit for bit"));
    another_version_is_refused(&out.join("recording.mcap"), folder.path());
    // What was recorded can be measured again, at the heights of then.
    let measured = folder.path().join("again");
    fs::copy("cells/demo.toml", folder.path().join("cell.toml")).unwrap();
    let _ = truebead()
        .arg("process")
        .arg(out.join("recording.mcap"))
        .arg("--cell")
        .arg(folder.path().join("cell.toml"))
        .arg("--out")
        .arg(&measured)
        .status()
        .unwrap();
    same_widths(&out, &measured);
}

/// A recording of another version is refused with status 2, unless it is asked for.
fn another_version_is_refused(recording: &Path, folder: &Path) {
    let mut bytes = fs::read(recording).unwrap();
    let version = truebead().arg("--version").output().unwrap().stdout;
    let version =
        String::from_utf8(version).unwrap().trim_start_matches("truebead ").trim().to_owned();
    let at = bytes.windows(version.len()).position(|part| part == version.as_bytes()).unwrap();
    bytes[at] = b'9';
    let other = folder.join("other.mcap");
    fs::write(&other, bytes).unwrap();
    let refused = truebead().arg("replay").arg(&other).output().unwrap();
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(said.contains(&version) && said.contains("--any-version"), "{said}");
    let asked = truebead().args(["replay", "--any-version"]).arg(&other).status().unwrap();
    assert!(asked.success());
}

/// Every tenth frame was recorded; measured again it has the same width. Frames are
/// identified by their time after the first one: a busy machine may pass some over, and the
/// tenth that was seen is then not the tenth of the camera.
fn same_widths(run: &Path, again: &Path) {
    let rows = |folder: &Path| -> Vec<(f64, String, String)> {
        let mut table = csv::Reader::from_path(folder.join("widths.csv")).unwrap();
        let row = |r: csv::StringRecord| (r[1].parse().unwrap(), r[2].into(), r[3].into());
        table.records().map(|r| row(r.unwrap())).collect()
    };
    let (run, again) = (rows(run), rows(again));
    assert!(again.len() >= 20);
    for (time_s, status, width_mm) in &again {
        let after_s = time_s - again[0].0;
        let twin = run.iter().find(|row| (row.0 - run[0].0 - after_s).abs() < 1e-6);
        let (_, run_status, run_width) = twin.unwrap();
        assert_eq!((status, width_mm), (run_status, run_width), "{after_s} s after the first");
    }
}

#[test]
fn a_simulation_of_widths_replays_with_its_own_gauge() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut simulate = truebead();
    simulate.args(["simulate", "cells/distance.toml", "--record", "--out"]).arg(&out);
    assert!(simulate.status().unwrap().success());
    assert!(replay(&out.join("recording.mcap")).contains("all the same bit for bit"));
}

#[test]
fn a_killed_run_leaves_all_but_the_last_second() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    let began = Instant::now();
    let mut child =
        truebead().args(["-q", "demo", "--seconds", "60", "--out"]).arg(&out).spawn().unwrap();
    assert!(child.wait_timeout(Duration::from_millis(3500)).unwrap().is_none());
    let ran_s = began.elapsed().as_secs_f64();
    child.kill().unwrap();
    child.wait().unwrap();
    let partial = out.join("recording.mcap.partial");
    let last = Recording::open(&partial)
        .unwrap()
        .filter_map(|entry| match entry.unwrap() {
            RecordedEntry::Event { now, .. } => Some(now.secs()),
            _ => None,
        })
        .last()
        .unwrap();
    assert!(last > ran_s - 1.0, "ran {ran_s} s, the last event is at {last} s");
    assert!(replay(&partial).contains("all the same bit for bit"));
    assert!(!out.join("recording.mcap").exists());
    assert!(!out.join("widths.csv").exists());
}

#[test]
fn a_run_against_a_robot_ends_in_order_on_a_signal() {
    let folder = tempfile::tempdir().unwrap();
    let mut robot = truebead()
        .args([
            "sim",
            "robot",
            "--listen",
            "127.0.0.1:0",
            "--endless",
            "--max",
            "160",
            "--min",
            "50",
        ])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut said = BufReader::new(robot.stderr.take().unwrap()).lines();
    let address = said.next().unwrap().unwrap();
    let address = address.split_whitespace().find(|word| word.starts_with("127.")).unwrap();
    let cell = fs::read_to_string("cells/demo.toml").unwrap();
    let cell = cell.replace("127.0.0.1:5653", address.trim_end_matches(';'));
    fs::write(folder.path().join("cell.toml"), cell).unwrap();
    let mut run = truebead()
        .arg("run")
        .arg(folder.path().join("cell.toml"))
        .arg("--out")
        .arg(folder.path().join("out"))
        .spawn()
        .unwrap();
    assert!(run.wait_timeout(Duration::from_millis(3500)).unwrap().is_none());
    signal(&run, "-TERM");
    assert_eq!(wait(run), 0);
    let words: String =
        said.by_ref().map_while(Result::ok).take_while(|l| !l.contains("STOP")).collect();
    assert!(words.contains("PRINT"), "{words}");
    signal(&robot, "-INT");
    assert_eq!(wait(robot), 0);
    assert!(summary(&folder.path().join("out"))["setpoints_sent"].as_u64().unwrap() > 5);
    assert!(folder.path().join("out/recording.mcap").exists());
}

fn signal(child: &Child, which: &str) {
    // The shell's own kill: a small system has no program of that name.
    let line = format!("kill {which} {}", child.id());
    let status = Command::new("sh").args(["-c", &line]).status().unwrap();
    assert!(status.success());
}

#[test]
fn an_output_folder_with_a_recording_is_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("recording.mcap"), b"precious").unwrap();
    let output = truebead().args(["demo", "--out"]).arg(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--out"));
    assert_eq!(fs::read(folder.path().join("recording.mcap")).unwrap(), b"precious");
}

/// A folder of equal frames.
fn equal_frames(count: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for number in 0..count {
        let frame = folder.path().join(format!("frame_{number:05}.png"));
        fs::copy("test_images/straight/frame_00000.png", frame).unwrap();
    }
    folder
}

#[test]
fn equal_frames_that_were_recorded_keep_their_width_and_are_counted() {
    let (frames, out) = (equal_frames(5), tempfile::tempdir().unwrap());
    let status = truebead()
        .arg("process")
        .arg(frames.path())
        .args(["--cell", "test_images/straight/scenario.toml", "--out"])
        .arg(out.path())
        .status()
        .unwrap();
    assert!(status.success());
    let summary = summary(out.path());
    assert_eq!((&summary["measured"], &summary["repeated"]), (&5.into(), &3.into()));
    assert_eq!(summary["rejected"], serde_json::json!({}));
}
