//! `truebead calibrate` on real images of a board, and with bad input.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{Point2, Rotation3, Vector2, Vector3};
use truebead::calibration::board::Board;
use truebead::calibration::{Calibration, Camera, board_observation};
use truebead::core::{Channel, Frame, Mm, Pose, Stamp};
use truebead::io::{calibration_file, image_file};
use truebead::sim::board_studio::{BoardStudio, Exposure};

/// Thirteen images of a board with 9x6 inner corners, of squares of 25 mm, if
/// they are there.
fn chessboard() -> Option<PathBuf> {
    sample("chessboard")
}

/// A folder of real images beside the project, if it is there.
fn sample(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
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
fn the_camera_of_the_real_images_is_found() {
    let Some(folder) = chessboard() else { return };
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("calib.toml");
    let run = calibrate(&folder, &out, &[]).assert().success();
    let said = String::from_utf8_lossy(&run.get_output().stdout).into_owned();
    assert!(said.contains("13 of 13 images show the board"), "{said}");
    let calibration = calibration_file::read(&out).unwrap();
    let Calibration::Full { camera, quality, .. } = &calibration else { unreachable!() };
    assert!(quality.unwrap().reprojection_rms_px <= 0.20);
    let share = quality.unwrap().width_relative_sigma.unwrap();
    // The largest where boards were seen, with the design effect of a board that is bent.
    assert!((1e-4..2e-2).contains(&share), "{share}");
    assert!(said.contains("uncertainty of a width"), "{said}");
    // The focal length that OpenCV's own samples give for these images.
    assert!((camera.focal_px[0] - 532.83).abs() < 0.8, "fx {}", camera.focal_px[0]);
    assert!((camera.centre_px[0] - 342.5).abs() < 1.5 && (camera.centre_px[1] - 233.9).abs() < 1.5);
}

/// In one of them the board is close to the edge of the image.
#[test]
fn every_image_of_the_other_camera_is_used() {
    let Some(folder) = sample("chessboard_right") else { return };
    let scratch = tempfile::tempdir().unwrap();
    let run = calibrate(&folder, &scratch.path().join("calib.toml"), &[]).assert().success();
    let said = said(&run);
    assert!(said.contains("13 of 13 images show the board"), "{said}");
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
    let corners = board_observation::observe(&board, "left04.jpg", &picture).unwrap().corners;
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
fn images_without_a_board_end_with_1_and_say_which() {
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

const SIZE: [u32; 2] = [640, 480];

fn camera() -> Camera {
    Camera::pinhole([900.0, 901.0], [322.0, 236.0]).with_five([-0.15, 0.08, 4e-4, -3e-4, 0.0])
}

fn board(columns: usize, rows: usize) -> Board {
    Board::new(columns, rows, Mm::constant(25.0)).unwrap()
}

/// Boards that are tilted to all sides; the last two lie on one plane.
fn poses() -> Vec<Pose> {
    let held = (0..10_u32).map(|i| {
        let turn = f64::from(i) * 0.7;
        let tilt = 0.25 + 0.04 * f64::from(i);
        let rotation = Rotation3::new(Vector3::new(tilt * turn.cos(), tilt * turn.sin(), 0.05));
        let middle = Vector3::new(40.0 * turn.sin(), 30.0 * turn.cos(), 560.0);
        Pose::from_parts(rotation, middle - rotation * Vector3::new(100.0, 62.5, 0.0))
    });
    let flat = Rotation3::new(Vector3::new(0.1, -0.06, 0.0));
    let lies = |x: f64, y: f64, turn: f64| {
        let on_plane = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
        let from_middle = on_plane * Vector3::new(100.0, 62.5, 0.0) + Vector3::new(x, y, 0.0);
        Pose::from_parts(flat * on_plane, Vector3::new(0.0, 0.0, 520.0) - flat * from_middle)
    };
    held.chain([lies(0.0, 0.0, 0.0), lies(20.0, -12.0, 0.2)]).collect()
}

fn save(frame: &Frame, path: &Path) {
    let (width, height) = (frame.width().try_into().unwrap(), frame.height().try_into().unwrap());
    let picture = image::GrayImage::from_raw(width, height, frame.to_grey8().into_owned());
    picture.unwrap().save(path).unwrap();
}

/// A folder with good images, and the studio they were taken in.
fn pictures(folder: &Path) -> BoardStudio {
    let studio = BoardStudio::new(&camera(), SIZE);
    fs::create_dir(folder).unwrap();
    for (pose, seed) in poses().iter().zip(0..) {
        let frame = studio.take(&board(9, 6), pose, Exposure::SHARP, seed).unwrap();
        save(&frame, &folder.join(format!("view{seed:02}.png")));
    }
    studio
}

fn said(run: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&run.get_output().stdout).into_owned()
}

/// Every line of the table of bad images in `docs/src/reference/board-images.md`.
#[test]
fn images_that_are_no_good_are_left_out_and_say_why() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("pictures");
    let studio = pictures(&folder);
    let take = |board: &Board, exposure: Exposure, seed: u64| {
        studio.take(board, &poses()[2], exposure, seed).unwrap()
    };
    let nine = board(9, 6);
    let blurred = Exposure { blur_px: 6.0, ..Exposure::SHARP };
    let moved = Exposure { motion_px: Vector2::new(10.0, 0.0), ..Exposure::SHARP };
    save(&take(&nine, blurred, 1), &folder.join("wrong-blurred.png"));
    save(&take(&nine, moved, 2), &folder.join("wrong-moved.png"));
    save(&take(&nine, Exposure::SHARP, 3), &folder.join("wrong-twin.png"));
    save(&take(&board(7, 4), Exposure::SHARP, 4), &folder.join("wrong-small.png"));
    save(&take(&board(9, 7), Exposure::SHARP, 5), &folder.join("wrong-large.png"));
    image::GrayImage::new(640, 480).save(folder.join("wrong-empty.png")).unwrap();
    fs::write(folder.join("wrong-file.png"), "no picture").unwrap();
    let large = BoardStudio::new(&camera(), [720, 540]);
    let frame = large.take(&nine, &poses()[4], Exposure::SHARP, 6).unwrap();
    save(&frame, &folder.join("wrong-size.png"));
    let out = scratch.path().join("calib.toml");
    let plane = ["--plane", "view10.png", "--plane", "view11.png"];
    let run = calibrate(&folder, &out, &plane).assert().success();
    let said = said(&run);
    for (picture, reason) in [
        ("wrong-blurred.png", "blurred by "),
        ("wrong-moved.png", "the board moved by "),
        ("wrong-twin.png", "the board is where it is in view02.png (within 0."),
        ("wrong-small.png", "a board with 7x4 inner corners shows, not one with 9x6"),
        ("wrong-large.png", "9x7 inner corners shows|the board goes on beyond 9x6"),
        ("wrong-empty.png", "no board with 9x6 inner corners"),
        ("wrong-file.png", "unreadable: "),
        ("wrong-size.png", "size 720x540 px, while most are 640x480 px"),
    ] {
        let line = said.lines().find(|line| line.starts_with(picture)).unwrap_or_default();
        let is_told = reason.split('|').any(|reason| line.contains(reason));
        assert!(is_told, "{picture}: no \"{reason}\" in\n{said}");
    }
    assert!(said.contains("12 of 20 images show the board"), "{said}");
    assert!(said.contains("boards      2 on one plane, to 0.0"), "{said}");
    let page = fs::read_to_string(scratch.path().join("report.html")).unwrap();
    assert!(page.contains("wrong-moved.png") && page.contains("Uncertainty of a width"), "{page}");
    let Calibration::Full { camera: found, quality, .. } = calibration_file::read(&out).unwrap()
    else {
        unreachable!()
    };
    assert!((found.focal_px[0] - 900.0).abs() < 0.6, "{found:?}");
    let quality = quality.unwrap();
    assert!(quality.reprojection_rms_px < 0.03 && quality.width_relative_sigma.unwrap() < 5e-4);
    assert!(quality.seen_px.is_some() && quality.heights_mm.is_some());
}

#[test]
fn check_draws_the_uncertainty_with_the_gauge_and_knows_older_files() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("pictures");
    pictures(&folder);
    let out = scratch.path().join("calib.toml");
    calibrate(&folder, &out, &[]).assert().success();
    let cell = scratch.path().join("cell.toml");
    let text = "[calibration]\nfile = \"calib.toml\"\nsurface_height_mm = 10.0\n[gauge]\n\
                roi_px = [100, 210, 400, 50]\nbead_axis = \"vertical\"\npolarity = \"bright\"\n\
                width_range_mm = [20.0, 60.0]\n";
    fs::write(&cell, text).unwrap();
    let check = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
        said(&command.arg("check").arg(&cell).args(more).assert().success())
    };
    let page = scratch.path().join("check.html");
    let printed = check(&["--report", page.to_str().unwrap()]);
    assert!(printed.contains("in the middle of the gauge"), "{printed}");
    // Rows are named by their middles; the gauge covers five cells of one.
    let row = printed.lines().find(|line| line.trim_start().starts_with("200 "));
    assert_eq!(row.unwrap().matches('[').count(), 5, "{printed}");
    assert!(fs::read_to_string(page).unwrap().contains("Solid: the gauge"));
    let old = fs::read_to_string(&out).unwrap();
    let (old, _) = old.split_once("[uncertainty]").unwrap();
    fs::write(&out, old).unwrap();
    let printed = check(&[]);
    assert!(printed.contains("number for the whole image"), "{printed}");
}

#[test]
fn a_calibration_passes_or_fails_by_what_it_leaves_in_a_width() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("pictures");
    pictures(&folder);
    let out = scratch.path().join("calib.toml");
    let bead = ["--bead-mm", "42", "--surface-height-mm", "20"];
    let verdict = |limit: &str, code: i32| {
        let more = [&bead[..], &["--max-width-sigma-mm", limit]].concat();
        said(&calibrate(&folder, &out, &more).assert().code(code))
    };
    let passed = verdict("0.05", 0);
    assert!(passed.contains("PASS: ") && passed.contains("of a bead of 42 mm"), "{passed}");
    let failed = verdict("0.00001", 1);
    assert!(failed.contains("FAIL: "), "{failed}");
    // The plane is that of boards that all lay on the bed, each at a position of its own.
    let apart = ["--plane", "view02.png", "--plane", "view05.png"];
    let run = calibrate(&folder, &out, &apart).assert().code(1);
    let refused = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(refused.contains("do not lie on one plane"), "{refused}");
    let twice = ["--plane", "view10.png", "--plane", "view10.png"];
    let run = calibrate(&folder, &out, &twice).assert().code(1);
    let refused = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(refused.contains("is where it is in view10.png"), "{refused}");
    // A later image of the same name is another one.
    fs::create_dir(scratch.path().join("later")).unwrap();
    let later = scratch.path().join("later/view10.png");
    fs::copy(folder.join("view03.png"), &later).unwrap();
    let named = ["--plane", later.to_str().unwrap()];
    let other = said(&calibrate(&folder, &out, &named).assert().code(0));
    let own = said(&calibrate(&folder, &out, &["--plane", "view03.png"]).assert().code(0));
    let height = |said: &str| {
        said.lines().find(|l| l.contains("above the bed, its view")).map(str::to_owned)
    };
    assert_eq!(height(&other), height(&own));
    // The file is there: what is enough for another bead is known.
    assert!(out.exists());
    let both = out.display().to_string();
    for (name, value) in [
        ("--max-width-sigma-mm", "0"),
        ("--bead-mm", "-4"),
        ("--bead-mm", "x"),
        ("--robot-z-mm", "1e300"),
        ("--report", both.as_str()),
        ("--report", "no/such/folder/report.html"),
    ] {
        calibrate(&folder, &out, &[&format!("{name}={value}")]).assert().code(2);
    }
}
