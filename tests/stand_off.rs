//! From images of a board to widths at any height: the whole way that a user goes, with
//! rendered images, whose truth is known, and their noise.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{Rotation3, Vector3};
use truebead::calibration::board::{Board, Markers};
use truebead::calibration::dictionary::Dictionary;
use truebead::calibration::plane::bed_from_board;
use truebead::calibration::{Camera, file};
use truebead::core::{Frame, Mm, Pose};
use truebead::sim::board_studio::{BoardStudio, Exposure};

const SIZE: [u32; 2] = [720, 540];
/// Heights of the surface above the bed: 20 mm, and 20 mm less and more \[mm\].
const HEIGHTS_MM: [f64; 5] = [0.0, 10.0, 20.0, 30.0, 40.0];

fn camera() -> Camera {
    Camera::pinhole([1500.0, 1501.5], [366.0, 261.0]).with_five([-0.18, 0.12, 6e-4, -4e-4, 0.0])
}

fn board() -> Board {
    let marks = Markers { side: Mm::constant(10.5), dictionary: Dictionary::Four };
    Board::new(9, 6, Mm::constant(15.0)).unwrap().with_marks(marks).unwrap()
}

fn held(turn: f64, tilt: f64, at: [f64; 3]) -> Pose {
    let rotation = Rotation3::new(Vector3::new(tilt * turn.cos(), tilt * turn.sin(), 0.1));
    Pose::from_parts(rotation, Vector3::from(at) - rotation * Vector3::new(60.0, 37.5, 0.0))
}

/// Boards all over the image, and the one on the bed, under a camera that is not quite
/// upright.
fn poses() -> (Pose, Vec<Pose>) {
    let bed = held(0.7, 0.09, [4.0, -3.0, 500.0]);
    let around = (0..16_u32).map(|i| {
        let turn = f64::from(i) * 1.1;
        let (x, y) = (45.0 * (1.7 * turn).cos(), 32.0 * (1.3 * turn).sin());
        held(turn, 0.3 + 0.02 * f64::from(i), [x, y, 470.0 + 5.0 * f64::from(i % 7)])
    });
    (bed, around.collect())
}

fn save(frame: &Frame, path: &Path) {
    let (width, height) = (frame.width().try_into().unwrap(), frame.height().try_into().unwrap());
    let picture = image::GrayImage::from_raw(width, height, frame.to_grey8().into_owned());
    picture.unwrap().save(path).unwrap();
}

fn truebead(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.args(arguments);
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Pictures of boards, taken live: every board is seen for as long as it is held.
fn film(folder: &Path) {
    fs::create_dir(folder).unwrap();
    let studio = BoardStudio::new(&camera(), SIZE);
    let (bed, around) = poses();
    let shown = std::iter::once((bed, 5)).chain(around.into_iter().map(|pose| (pose, 2)));
    let mut number = 0;
    for (pose, looks) in shown {
        for _ in 0..looks {
            let frame = studio.take(&board(), &pose, Exposure::SHARP, number).unwrap();
            save(&frame, &folder.join(format!("{number:04}.png")));
            number += 1;
        }
    }
}

/// Frames of a bead on a surface, as the true camera sees them; their true widths \[mm\].
fn beads(folder: &Path, height_mm: f64) -> (PathBuf, Vec<f64>) {
    let bed = bed_from_board(&poses().0, Mm::ZERO);
    let truth = file::to_toml(&camera(), &bed, SIZE, Mm::ZERO, None, &[]);
    fs::write(folder.join("truth.toml"), truth).unwrap();
    let scenario = folder.join("scenario.toml");
    fs::write(
        &scenario,
        format!(
            "{}[render]\nframe_spacing_mm = 200.0\nslant_deg = 2.0\n\
             [simulation]\nseed = 5\npath_mm = 1800.0\n",
            cell("truth.toml", height_mm, "")
        ),
    )
    .unwrap();
    let frames = folder.join(format!("frames-{height_mm}"));
    truebead(&["lab", "render", text(&scenario), "--out", text(&frames)]).assert().success();
    let widths = column(&frames.join("truth.csv"), 2);
    (frames, widths)
}

fn cell(calibration: &str, height_mm: f64, more: &str) -> String {
    format!(
        "[calibration]\nfile = \"{calibration}\"\nsurface_height_mm = {height_mm:.1}\n{more}\n\
         [gauge]\nroi_px = [60, 30, 600, 480]\nbead_axis = \"vertical\"\npolarity = \"bright\"\n\
         width_range_mm = [20.0, 60.0]\n"
    )
}

/// Widths and standard deviations that `process` finds \[mm\].
fn measured(folder: &Path, frames: &Path, cell: &str) -> (Vec<f64>, Vec<f64>) {
    let path = folder.join("cell.toml");
    fs::write(&path, cell).unwrap();
    let out = folder.join("measured");
    let _ = fs::remove_dir_all(&out);
    truebead(&["process", text(frames), "--cell", text(&path), "--out", text(&out)])
        .assert()
        .success();
    let table = out.join("widths.csv");
    (column(&table, 3), column(&table, 4))
}

fn column(path: &Path, number: usize) -> Vec<f64> {
    let mut table = csv::Reader::from_path(path).unwrap();
    table.records().map(|row| row.unwrap()[number].parse().unwrap()).collect()
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a count of frames")]
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

#[test]
fn widths_are_right_at_any_height_after_a_calibration_that_was_taken_live() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    film(&folder.join("film"));
    let out = folder.join("calib.toml");
    let live = truebead(&["calibrate", "--camera", text(&folder.join("film"))])
        .args(["--rate-hz", "1000", "--board", "9x6", "--square-mm", "15", "--marker-mm", "10.5"])
        .args(["--bead-mm", "42", "--surface-height-mm", "0", "--surface-height-mm", "40"])
        .args(["--max-width-sigma-mm", "0.02", "--out", text(&out)])
        .assert()
        .success();
    let said = String::from_utf8_lossy(&live.get_output().stdout).into_owned();
    assert!(said.contains("view 1: the bed plane, 54 corners -> view-001.png"), "{said}");
    assert!(said.contains("PASS: "), "{said}");
    // It ends as soon as that is so, and the images are there.
    let views = fs::read_dir(folder.join("calib-images")).unwrap().count();
    assert!((8..=17).contains(&views), "{views}");
    assert!(!fs::read_to_string(folder.join("report.html")).unwrap().contains("http-equiv"));

    let mut worst = 0.0_f64;
    for height_mm in HEIGHTS_MM {
        let (frames, truth) = beads(folder, height_mm);
        let (widths, sigmas) = measured(folder, &frames, &cell("calib.toml", height_mm, ""));
        assert_eq!(widths.len(), truth.len());
        let error = mean(widths.iter().zip(&truth).map(|(width, truth)| width / truth - 1.0));
        worst = worst.max(error.abs());
        assert!(error.abs() < 0.001, "{height_mm} mm: {:.4} %", 100.0 * error);
        // With a height that is 1 mm wrong, and said to be known no better than that.
        for wrong_mm in [height_mm - 1.0, height_mm + 1.0] {
            let doubt = "surface_height_sigma_mm = 1.0";
            let (off, doubted) = measured(folder, &frames, &cell("calib.toml", wrong_mm, doubt));
            let each = off.iter().zip(&truth).zip(doubted.iter().zip(&sigmas));
            for ((width, truth), (doubted, sigma)) in each {
                let error = (width - truth).abs();
                assert!(error > 0.04 && error < 2.0 * doubted, "{error} {doubted}");
                assert!(*doubted > 2.0 * sigma, "{doubted} {sigma}");
            }
        }
    }
    println!("largest mean error at {HEIGHTS_MM:?} mm: {:.4} %", 100.0 * worst);
}

#[test]
fn a_live_calibration_refuses_wrong_options() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    let out = folder.join("calib.toml");
    let calibrate = |more: &[&str]| {
        let mut command = truebead(&["calibrate", "--board", "9x6", "--square-mm", "15"]);
        command.args(["--out", text(&out)]).args(more);
        let run = command.assert();
        let output = run.get_output();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code().unwrap(), said)
    };
    for (more, code, words) in [
        (&[][..], 2, "<INPUT>"),
        (&["--camera", "camera:x"], 2, "expected camera: and a whole number"),
        (&["--camera", "rendered"], 2, "shows a bead, not a board"),
        (&["--camera", "no/such/folder"], 1, "is not there"),
        (&["--camera", "x", "--plane", "y.png"], 2, "cannot be used with"),
        (&["--camera", "x", "--rate-hz", "0"], 2, "expected 0.1 to 1000"),
        (&["--camera", "x", "--dictionary", "5x5"], 2, "--marker-mm"),
        (&["film", "--images", "x"], 2, "--images x: only with --camera"),
        (&["--camera", "x", "--marker-mm", "15"], 2, "40 to 90 %"),
        (&["--camera", "x", "--marker-mm", "9", "--dictionary", "apriltag"], 2, "4x4, 5x5, 6x6"),
    ] {
        let (status, said) = calibrate(more);
        assert!(status == code && said.contains(words), "{more:?}: {status} {said}");
    }
    // Frames without a board, and a folder that has something in it already.
    let film = folder.join("film");
    fs::create_dir(&film).unwrap();
    image::GrayImage::new(640, 480).save(film.join("0.png")).unwrap();
    let (status, said) = calibrate(&["--camera", text(&film)]);
    assert!(status == 1 && said.contains("has not shown the board lying still"), "{said}");
    assert!(!folder.join("calib-images").exists() && !out.exists());
    let (status, said) = calibrate(&["--camera", text(&film), "--images", text(&film)]);
    assert!(status == 2 && said.contains("expected an empty folder"), "{status} {said}");
}
