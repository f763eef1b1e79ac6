//! `truebead calibrate` on real pictures of a board, and with bad input.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::Point2;
use truebead::calib::Calibration;
use truebead::calib::board::Board;
use truebead::calib::sighting;
use truebead::frame::Channel;
use truebead::io::{calibration_file, image_file};
use truebead::time::Stamp;
use truebead::units::Mm;

/// Thirteen pictures of a board with 9x6 inner corners, of squares of 25 mm, if
/// they are there.
fn chessboard() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/chessboard");
    if !folder.is_dir() {
        eprintln!("skipped: the pictures of the board are not at {}", folder.display());
        return None;
    }
    Some(folder)
}

fn calibrate(input: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.arg("calibrate").arg(input).arg("--out").arg(out);
    command.args(["--board", "9x6", "--square-mm", "25"]).args(more);
    command
}

#[test]
fn the_camera_of_the_real_pictures_is_found() {
    let Some(folder) = chessboard() else { return };
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("calib.toml");
    let run = calibrate(&folder, &out, &[]).assert().success();
    let said = String::from_utf8_lossy(&run.get_output().stdout).into_owned();
    assert!(said.contains("13 of 13 images show the board"), "{said}");
    let calibration = calibration_file::read(&out).unwrap();
    let Calibration::Full { camera, quality, .. } = &calibration else { unreachable!() };
    assert!(quality.unwrap().reprojection_rms_px <= 0.20);
    let share = quality.unwrap().width_sigma_share.unwrap();
    assert!((1e-4..3e-3).contains(&share), "{share}");
    assert!(said.contains("a width on the bed is known to"), "{said}");
    // The focal length that OpenCV's own samples give for these pictures.
    assert!((camera.focal_px[0] - 532.83).abs() < 0.8, "fx {}", camera.focal_px[0]);
    assert!((camera.centre_px[0] - 342.5).abs() < 1.5 && (camera.centre_px[1] - 233.9).abs() < 1.5);
}

#[test]
fn the_squares_have_their_size_at_any_height_of_the_board() {
    let Some(folder) = chessboard() else { return };
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("calib.toml");
    calibrate(&folder, &out, &["--plane", "left04.jpg"]).assert().success();
    let on_bed = calibration_file::read(&out).unwrap().surface(Mm::ZERO, None);
    let picture =
        image_file::read(&folder.join("left04.jpg"), Channel::Grey, 0, Stamp::START).unwrap();
    let board = Board::new(9, 6, Mm::constant(25.0)).unwrap();
    let corners = sighting::look(&board, "left04.jpg", &picture).unwrap().corners;
    let corners: Vec<_> = corners.iter().map(|corner| corner.px).collect();
    for row in corners.chunks(9) {
        for pair in row.windows(2) {
            let side = (on_bed.to_mm(pair[1]).unwrap() - on_bed.to_mm(pair[0]).unwrap()).norm();
            assert!((side - 25.0).abs() < 0.35, "a square of 25 mm measures {side} mm");
        }
        let length = (on_bed.to_mm(row[8]).unwrap() - on_bed.to_mm(row[0]).unwrap()).norm();
        assert!((length - 200.0).abs() < 0.35, "eight squares measure {length} mm");
    }
    // A board that is 8 mm thick lies on a bed that is 8 mm deeper: its face is
    // the same plane, measured as a surface 8 mm above the bed.
    let thick = ["--plane", "left04.jpg", "--board-thickness-mm", "8"];
    calibrate(&folder, &out, &thick).assert().success();
    let on_thick = calibration_file::read(&out).unwrap().surface(Mm::constant(8.0), None);
    for (x, y) in [(100.0, 100.0), (320.0, 240.0), (500.0, 400.0)] {
        let pair = [Point2::new(x, y), Point2::new(x + 60.0, y)];
        let [a, b] = pair.map(|px| on_bed.to_mm(px).unwrap());
        let [c, d] = pair.map(|px| on_thick.to_mm(px).unwrap());
        assert!(((b - a).norm() - (d - c).norm()).abs() < 1e-9);
    }
}

#[test]
fn wrong_arguments_end_with_2_and_leave_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("calib.toml");
    calibrate(Path::new("no/such/folder"), &out, &[]).assert().code(2);
    calibrate(scratch.path(), &out, &[]).assert().code(2);
    calibrate(scratch.path(), &out, &["--robot-z-mm", "high"]).assert().code(2);
    assert!(!out.exists());
}

#[test]
fn pictures_without_a_board_end_with_1_and_say_which() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("pictures");
    fs::create_dir(&folder).unwrap();
    image::GrayImage::new(64, 48).save(folder.join("black.png")).unwrap();
    fs::write(folder.join("broken.png"), "no picture").unwrap();
    let out = scratch.path().join("calib.toml");
    let run = calibrate(&folder, &out, &[]).assert().code(1);
    let said = String::from_utf8_lossy(&run.get_output().stdout).into_owned();
    assert!(said.contains("black.png") && said.contains("no board with 9x6"), "{said}");
    assert!(said.contains("broken.png") && said.contains("unreadable"), "{said}");
    assert!(!out.exists());
}
