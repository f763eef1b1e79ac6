//! `truebead accuracy` on a few frames: that every set is measured, that what
//! nothing disturbs is measured to its bound, and that what is disturbed is not
//! far off, and not silently wrong in the few frames here.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;

use assert_cmd::Command;
use serde_json::Value;

fn accuracy(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.arg("accuracy").args(args);
    command
}

#[test]
fn clear_pictures_are_measured_to_their_bound_and_others_not_far_off() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let args = ["--frames", "60", "--silent-frames", "30", "--out", folder];
    // A verdict on so few frames may be either.
    let status = accuracy(&args).output().unwrap().status.code();
    let json = fs::read(out.path().join("accuracy.json")).unwrap();
    let figures: Vec<Value> = serde_json::from_slice(&json).unwrap();
    let lines = fs::read_to_string(out.path().join("accuracy.md")).unwrap();
    assert_eq!(lines.lines().count(), figures.len() + 2);
    let mut all_kept = true;
    for figures in &figures {
        let number = |key: &str| figures[key].as_f64().unwrap();
        let set = figures["set"].as_str().unwrap();
        let clear = ["blur", "slant", "faint", "tilted", "horizontal", "dark-bead"];
        if clear.iter().any(|name| set.starts_with(name)) {
            assert_eq!((number("frames"), number("measured_share")), (60.0, 1.0), "{set}");
            assert_eq!(number("silent_share"), 0.0, "{set}");
            // Sixty frames tell a scatter to nine percent.
            assert!(number("rmse_over_free_bound") < 1.4, "{figures}");
            assert!((0.7..1.35).contains(&number("rms_over_sigma")), "{figures}");
            assert!(number("bias_px").abs() < 0.5 * number("rmse_px"), "{figures}");
        } else if set == "rough" || set.starts_with("curve") {
            assert_eq!((number("frames"), number("measured_share")), (60.0, 1.0), "{set}");
            assert!(number("rmse_px") < 0.04, "{figures}");
            assert!((0.7..1.4).contains(&number("rms_over_sigma")), "{figures}");
            assert_eq!(number("silent_share"), 0.0, "{set}");
        } else {
            assert_eq!((number("frames"), number("silent_share")), (30.0, 0.0), "{set}");
            if set.starts_with("corner") {
                assert_eq!(number("measured_share"), 0.0, "{set}");
            } else if set.starts_with("rough") {
                assert_eq!(number("measured_share"), 1.0, "{figures}");
                assert!(number("rmse_px") < 0.08, "{figures}");
                assert!((0.4..1.5).contains(&number("rms_over_sigma")), "{figures}");
            } else {
                assert!(number("measured_share") > 0.9, "{figures}");
                assert!(number("rmse_px") < 0.15, "{figures}");
            }
        }
        let missed = figures["missed"].as_array().unwrap().len();
        assert_eq!(figures["kept"], missed == 0, "{set}");
        all_kept &= missed == 0;
    }
    assert_eq!(status, Some(i32::from(!all_kept)));
}

#[test]
fn figures_are_the_same_every_time() {
    let run = || accuracy(&["--set", "spots", "--silent-frames", "60"]).output().unwrap().stdout;
    assert_eq!(run(), run());
}

#[test]
fn a_set_that_is_not_there_is_refused_with_those_that_are() {
    let output = accuracy(&["--set", "blurr"]).assert().code(2).get_output().clone();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("blurr") && said.contains("grains-6-dark"), "{said}");
}
