//! `truebead camera board` and `truebead camera verify`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{Rotation3, Vector3};
use truebead::calibration::board::Board;
use truebead::calibration::plane::bed_from_board;
use truebead::calibration::{Camera, file};
use truebead::core::{Frame, Mm, Pose};
use truebead::sim::board_studio::{BoardStudio, Exposure};

const SIZE: [u32; 2] = [640, 480];

fn truebead() -> Command {
    Command::new(env!("CARGO_BIN_EXE_truebead"))
}

fn camera() -> Camera {
    Camera::pinhole([900.0, 901.0], [322.0, 236.0]).with_five([-0.15, 0.08, 4e-4, -3e-4, 0.0])
}

fn board() -> Board {
    Board::new(9, 6, Mm::constant(20.0)).unwrap()
}

fn pose(higher_mm: f64) -> Pose {
    let rotation = Rotation3::new(Vector3::new(0.08, -0.05, 0.1));
    let middle = Vector3::new(80.0, 50.0, 0.0);
    // The board's z points away from the camera.
    let lift = rotation * Vector3::z() * higher_mm;
    Pose::from_parts(rotation, Vector3::new(0.0, 0.0, 430.0) - rotation * middle - lift)
}

fn save(frame: &Frame, path: &Path) {
    let picture = image::GrayImage::from_raw(640, 480, frame.to_grey8().into_owned()).unwrap();
    picture.save(path).unwrap();
}

/// A calibration file and a image of a board that lies so much above the bed.
fn scene(folder: &Path, higher_mm: f64) -> (PathBuf, PathBuf) {
    let (calibration, picture) = (folder.join("calib.toml"), folder.join("board.png"));
    let bed = bed_from_board(&pose(0.0), Mm::ZERO);
    let text = file::to_toml(&camera(), &bed, SIZE, Mm::ZERO, None, &[]);
    fs::write(&calibration, text).unwrap();
    let frame = BoardStudio::new(&camera(), SIZE)
        .take(&board(), &pose(higher_mm), Exposure::SHARP, 5)
        .unwrap();
    save(&frame, &picture);
    (calibration, picture)
}

fn verify(calibration: &Path, picture: &Path, more: &[&str]) -> Command {
    let mut command = truebead();
    command.args(["camera", "verify"]).arg(picture).arg("--calibration").arg(calibration);
    command.args(["--board", "9x6", "--square-mm", "20"]).args(more);
    command
}

#[test]
fn a_calibration_that_holds_is_distinguished_from_one_that_does_not() {
    let scratch = tempfile::tempdir().unwrap();
    let (calibration, picture) = scene(scratch.path(), 0.0);
    let run = verify(&calibration, &picture, &[]).assert().code(0);
    let said = String::from_utf8_lossy(&run.get_output().stdout).into_owned();
    assert!(said.contains("HOLDS: ") && said.contains("a square measures 20.0"), "{said}");
    // As high as its thickness says is where it should be.
    let (calibration, picture) = scene(scratch.path(), 4.0);
    verify(&calibration, &picture, &["--board-thickness-mm", "4"]).assert().code(0);
    let run = verify(&calibration, &picture, &[]).assert().code(1);
    let said = String::from_utf8_lossy(&run.get_output().stdout).into_owned();
    assert!(said.contains("DOES NOT HOLD") && said.contains("mm higher than 0 mm"), "{said}");
    // Squares of another size than was said.
    verify(&calibration, &picture, &["--board-thickness-mm", "4", "--max-error-percent", "1e-4"])
        .assert()
        .code(1);
}

#[test]
fn what_cannot_be_verified_is_said() {
    let scratch = tempfile::tempdir().unwrap();
    let (calibration, picture) = scene(scratch.path(), 0.0);
    let said = |command: &mut Command, code: i32| {
        let run = command.assert().code(code);
        String::from_utf8_lossy(&run.get_output().stderr).into_owned()
    };
    let none = said(&mut verify(&calibration, Path::new("no.png"), &[]), 2);
    assert!(none.contains("no.png: no such image"), "{none}");
    let missing = said(&mut verify(Path::new("no.toml"), &picture, &[]), 2);
    assert!(missing.contains("no.toml"), "{missing}");
    let zero = said(&mut verify(&calibration, &picture, &["--max-error-percent", "0"]), 2);
    assert!(zero.contains("--max-error-percent: found 0, expected more than 0"), "{zero}");
    image::GrayImage::new(640, 480).save(scratch.path().join("black.png")).unwrap();
    let black = said(&mut verify(&calibration, &scratch.path().join("black.png"), &[]), 1);
    assert!(black.contains("no board with 9x6 inner corners"), "{black}");
    let text = fs::read_to_string(&calibration).unwrap().replace("[640, 480]", "[720, 540]");
    fs::write(&calibration, text).unwrap();
    let other = said(&mut verify(&calibration, &picture, &[]), 1);
    assert!(other.contains("640x480 px, but the calibration is for 720x540 px"), "{other}");
}

#[test]
fn a_printed_board_is_whole_or_not_there() {
    let scratch = tempfile::tempdir().unwrap();
    let make = |name: &str, more: &[&str]| {
        let mut command = truebead();
        let out = scratch.path().join(name);
        command.args(["camera", "board", "--board", "9x6", "--square-mm", "20", "--out"]).arg(&out);
        command.args(more);
        (command, out)
    };
    let (mut command, pdf) = make("board.pdf", &[]);
    command.assert().code(0);
    assert!(fs::read(&pdf).unwrap().starts_with(b"%PDF-"));
    let (mut command, svg) = make("board.svg", &["--paper", "A3"]);
    command.assert().code(0);
    assert!(fs::read_to_string(&svg).unwrap().contains("width=\"420mm\""));
    for (name, more, word) in [
        ("board.txt", &[][..], "ends in .pdf or .svg"),
        ("small.pdf", &["--paper", "150x100"][..], "needs 216 x 180 mm"),
        ("odd.pdf", &["--paper", "a9"][..], "expected a4, a3"),
    ] {
        let (mut command, out) = make(name, more);
        let run = command.assert().code(2);
        let said = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
        assert!(said.contains(word), "{said}");
        assert!(!out.exists());
    }
}

/// A board that is printed is the board that is looked for.
#[test]
fn the_board_that_is_kept_is_the_one_that_is_made() {
    let scratch = tempfile::tempdir().unwrap();
    let boards = [("board", &[][..]), ("charuco", &["--marker-mm", "14"][..])];
    for ((name, more), ending) in boards.into_iter().flat_map(|b| [(b, "svg"), (b, "pdf")]) {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let kept = root.join(format!("calib/{name}_9x6_20mm_a4.{ending}"));
        let out = scratch.path().join(format!("board.{ending}"));
        let run = ["camera", "board", "--board", "9x6", "--square-mm", "20", "--out"];
        truebead().args(run).arg(&out).args(more).assert().code(0);
        assert!(fs::read(&out).unwrap() == fs::read(&kept).unwrap(), "{}", kept.display());
    }
}
