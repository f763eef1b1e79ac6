//! `truebead lab accuracy` on a few frames: that every set is measured, that what
//! nothing disturbs is measured to its bound, and that what is disturbed is not
//! far off, and not silently wrong in the few frames here.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;

use assert_cmd::Command;
use serde_json::Value;

fn accuracy(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.args(["lab", "accuracy"]).args(args);
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
            assert_eq!((number("frames"), number("measured_fraction")), (60.0, 1.0), "{set}");
            assert_eq!(number("silent_fraction"), 0.0, "{set}");
            // Sixty frames tell a scatter to nine percent.
            assert!(number("rmse_over_free_bound") < 1.4, "{figures}");
            assert!((0.7..1.35).contains(&number("rms_over_sigma")), "{figures}");
            assert!(number("bias_px").abs() < 0.5 * number("rmse_px"), "{figures}");
        } else if set == "rough" || set.starts_with("curve") {
            assert_eq!((number("frames"), number("measured_fraction")), (60.0, 1.0), "{set}");
            assert!(number("rmse_px") < 0.04, "{figures}");
            assert!((0.7..1.4).contains(&number("rms_over_sigma")), "{figures}");
            assert_eq!(number("silent_fraction"), 0.0, "{set}");
        } else {
            assert_eq!((number("frames"), number("silent_fraction")), (30.0, 0.0), "{set}");
            if set.starts_with("corner") {
                assert_eq!(number("measured_fraction"), 0.0, "{set}");
            } else if set.starts_with("rough") {
                assert_eq!(number("measured_fraction"), 1.0, "{figures}");
                assert!(number("rmse_px") < 0.08, "{figures}");
                assert!((0.4..1.5).contains(&number("rms_over_sigma")), "{figures}");
            } else {
                assert!(number("measured_fraction") > 0.9, "{figures}");
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

/// The sets whose every parameter is drawn, on few frames: a verdict may be either.
#[test]
fn drawn_sets_are_counted_and_judged_and_frames_kept() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let args = ["--random", "all", "--frames", "300", "--keep-frames", "2", "--out", folder];
    let status = accuracy(&args).output().unwrap().status.code();
    let json = fs::read(out.path().join("random.json")).unwrap();
    let figures: Vec<Value> = serde_json::from_slice(&json).unwrap();
    let whole: Vec<&Value> = figures.iter().filter(|figures| figures["part"] == "all").collect();
    assert_eq!(whole.len(), 18);
    for figures in &whole {
        let rejected = figures["rejected"].as_object().unwrap().values();
        let rejected: u64 = rejected.map(|count| count.as_u64().unwrap()).sum();
        let measured = 300.0 * figures["measured_fraction"].as_f64().unwrap();
        assert!((measured + f64::from(u32::try_from(rejected).unwrap()) - 300.0).abs() < 1e-6);
    }
    let missed = figures.iter().any(|figures| !figures["missed"].as_array().unwrap().is_empty());
    assert_eq!(status, Some(i32::from(missed)));
    let lines = fs::read_to_string(out.path().join("random.md")).unwrap();
    assert!(lines.contains("# grooves") && lines.contains("left_groove_px 2.000 to 40.000"));
    let table = fs::read_to_string(out.path().join("frames/torn.csv")).unwrap();
    let row = table.lines().nth(2).unwrap();
    assert!(table.starts_with("file,status,width_px,sigma_px,truth_px,length_px,roughness_px"));
    assert!(row.starts_with("torn-000001.png,") && table.lines().count() == 3, "{table}");
    assert!(out.path().join("frames/torn-000001.png").is_file());
}

#[test]
fn a_drawn_frame_does_not_depend_on_how_many_there_are() {
    let kept = |frames: &str| {
        let out = tempfile::tempdir().unwrap();
        let folder = out.path().to_str().unwrap();
        let args = ["--random", "ribs,jpeg", "--frames", frames, "--keep-frames", "2"];
        accuracy(&[&args[..], &["--out", folder]].concat()).output().unwrap();
        fs::read(out.path().join("frames/ribs-strong-000001.png")).unwrap()
    };
    assert_eq!(kept("3"), kept("9"));
    let output = accuracy(&["--random", "torn,tor"]).assert().code(2).get_output().clone();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("--random tor:") && said.contains("ground-texture-weak"), "{said}");
}

/// Roughness and its length within their limits after 50 correlation lengths of bead, and
/// widths as far from the bead's own mean as roughness says.
#[test]
fn successive_frames_tell_roughness() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    accuracy(&["--roughness", "--beads", "100", "--out", folder]).assert().success();
    let json = fs::read(out.path().join("roughness.json")).unwrap();
    let figures: Vec<Value> = serde_json::from_slice(&json).unwrap();
    let all: Vec<&Value> = figures.iter().filter(|figures| figures["part"] == "all").collect();
    assert_eq!(all.len(), 2, "apart and overlapping");
    for figures in all {
        let number = |key: &str| figures[key].as_f64().unwrap();
        assert!(number("determined_fraction") > 0.9, "{figures}");
        assert!(number("roughness_error") <= 0.20, "{figures}");
        assert!(number("length_error") <= 0.30, "{figures}");
        assert!((0.85..=1.15).contains(&number("width_z")), "{figures}");
        // Sigmas of the estimates hold, however often each piece is seen.
        assert!((0.75..=1.25).contains(&number("roughness_z")), "{figures}");
        assert!((0.75..=1.25).contains(&number("length_z")), "{figures}");
    }
}
