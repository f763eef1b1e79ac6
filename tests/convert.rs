//! `truebead camera convert`: there and back, with a bed plane from images, and with bad
//! input.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use nalgebra::{Rotation3, Vector3};
use truebead::calibration::board::Board;
use truebead::calibration::{Calibration, CalibrationQuality, Camera, file};
use truebead::core::{Mm, Pose};
use truebead::io::calibration_file;
use truebead::sim::board_studio::{BoardStudio, Exposure};

const SIZE: [u32; 2] = [640, 480];

fn camera() -> Camera {
    let five = [-0.15, 0.08, 4e-4 / 3.0, -3e-5 / 7.0, 1e-2 / 3.0];
    Camera::pinhole([900.0 + 1.0 / 3.0, 901.0], [322.1, 236.7]).with_five(five)
}

/// A board on the bed: shifted along it \[mm\] and turned \[rad\].
fn lies(x: f64, y: f64, turn: f64) -> Pose {
    let flat = Rotation3::new(Vector3::new(0.1, -0.06, 0.0));
    let on_plane = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    let from_middle = on_plane * Vector3::new(100.0, 62.5, 0.0) + Vector3::new(x, y, 0.0);
    Pose::from_parts(flat * on_plane, Vector3::new(0.0, 0.0, 520.0) - flat * from_middle)
}

fn board() -> Board {
    Board::new(9, 6, Mm::constant(25.0)).unwrap()
}

fn take(pose: &Pose, size: [u32; 2], path: &Path) {
    let studio = BoardStudio::new(&camera(), size);
    let frame = studio.take(&board(), pose, Exposure::SHARP, 4).unwrap();
    let picture = image::GrayImage::from_raw(size[0], size[1], frame.to_grey8().into_owned());
    picture.unwrap().save(path).unwrap();
}

/// A calibration with everything in it.
fn calibration(path: &Path) {
    let quality = CalibrationQuality {
        reprojection_rms_px: 0.1 + 0.2,
        width_relative_sigma: Some(4e-4),
        seen_px: Some([3.0, 4.0, 630.0, 470.0]),
        heights_mm: Some([0.0, 50.0]),
        uncertainty: None,
    };
    let bed = Pose::new(Vector3::new(3.0, 0.1, -0.2), Vector3::new(1.5, -2.25, 400.125));
    let text = file::to_toml(&camera(), &bed, SIZE, Mm::ZERO, Some(quality), &[]);
    fs::write(path, text).unwrap();
}

/// Runs the command in a folder.
fn convert(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.current_dir(folder).args(["camera", "convert"]).args(arguments.split_whitespace());
    command
}

fn errors(run: &Assert) -> String {
    String::from_utf8_lossy(&run.get_output().stderr).into_owned()
}

const BOARD: &str = "--board 9x6 --square-mm 25";

#[test]
fn there_and_back_every_digit_stays_and_what_does_not_is_said() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    calibration(&folder.join("calib.toml"));
    let mut run = convert(folder, "calib.toml --to ros --camera-name left_2 --out info.yaml");
    let said = errors(&run.assert().success());
    for words in ["the bed plane and the robot's z", "the uncertainty of a width", "keep the .toml"]
    {
        assert!(said.contains(words), "no \"{words}\" in {said}");
    }
    convert(folder, "info.yaml --to opencv --out opencv.yml").assert().success();
    let name = convert(folder, "opencv.yml --to ros --out back.yaml").assert().success();
    assert_eq!(errors(&name), "", "nothing is lost");
    let back = fs::read_to_string(folder.join("back.yaml")).unwrap();
    let info = fs::read_to_string(folder.join("info.yaml")).unwrap();
    assert_eq!(back, info.replace("left_2", "camera"));
    let own = convert(folder, "info.yaml --to ros --out own.yaml").assert().success();
    assert_eq!(errors(&own), "");
    assert_eq!(fs::read_to_string(folder.join("own.yaml")).unwrap(), info);

    take(&lies(0.0, 0.0, 0.0), SIZE, &folder.join("bed.png"));
    let arguments = format!("back.yaml --plane bed.png {BOARD} --robot-z-mm -7 --out back.toml");
    let said = errors(&convert(folder, &arguments).assert().success());
    assert!(said.contains("sigma_mm will not contain it"), "{said}");
    let read = calibration_file::read(&folder.join("back.toml")).unwrap();
    let Calibration::Full { image_size_px, camera: found, robot_z, quality, .. } = read else {
        unreachable!()
    };
    assert_eq!((image_size_px, found, robot_z.get()), (SIZE, camera(), -7.0));
    let quality = quality.unwrap();
    assert!(quality.reprojection_rms_px < 0.05, "{quality:?}");
    assert_eq!((quality.width_relative_sigma, quality.seen_px), (None, None));
}

#[test]
fn the_bed_is_where_the_boards_lay() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    calibration(&folder.join("calib.toml"));
    convert(folder, "calib.toml --to opencv --out opencv.yaml").assert().success();
    let poses = [lies(0.0, 0.0, 0.0), lies(20.0, -12.0, 0.2)];
    take(&poses[0], SIZE, &folder.join("a.png"));
    take(&poses[1], SIZE, &folder.join("b.png"));
    let both = format!("opencv.yaml --plane a.png --plane b.png {BOARD}");
    let mut run = convert(folder, &format!("{both} --board-thickness-mm 8 --out calib8.toml"));
    let run = run.assert().success();
    let said = String::from_utf8_lossy(&run.get_output().stdout).into_owned();
    assert!(said.contains("2 on one plane") && said.contains("wrote calib8.toml"), "{said}");
    let read = calibration_file::read(&folder.join("calib8.toml")).unwrap();
    let Calibration::Full { bed, .. } = &read else { unreachable!() };
    for pose in &poses {
        for corner in board().corners_mm() {
            let height = bed.apply_inverse(pose.apply(corner)).z;
            assert!((height - 8.0).abs() < 0.15, "{height} mm above the bed");
        }
    }
    // Nothing of it is written where the boards lie on no plane, or at one position.
    let mut raised = poses[1];
    raised = Pose::from_parts(
        raised.rotation() * Rotation3::new(Vector3::new(0.15, 0.0, 0.0)),
        raised.translation_mm(),
    );
    take(&raised, SIZE, &folder.join("raised.png"));
    take(&poses[0], [600, 480], &folder.join("narrow.png"));
    image::GrayImage::new(640, 480).save(folder.join("black.png")).unwrap();
    for (planes, words) in [
        ("--plane a.png --plane raised.png", "do not lie on one plane"),
        ("--plane a.png --plane a.png", "is where it is in a.png"),
        ("--plane narrow.png", "narrow.png: 600x480 px, but the calibration is for 640x480 px"),
        ("--plane black.png", "no board with 9x6 inner corners"),
    ] {
        let arguments = format!("opencv.yaml {planes} {BOARD} --out none.toml");
        let said = errors(&convert(folder, &arguments).assert().code(1));
        assert!(said.contains(words), "no \"{words}\" in {said}");
    }
    assert!(!folder.join("none.toml").exists());
}

#[test]
fn wrong_arguments_and_files_end_with_2_and_leave_nothing() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path();
    calibration(&folder.join("calib.toml"));
    convert(folder, "calib.toml --to opencv --out opencv.yaml").assert().success();
    let text = fs::read_to_string(folder.join("opencv.yaml")).unwrap();
    fs::write(folder.join("bad.yaml"), text.replace("900.", "-900.")).unwrap();
    fs::write(folder.join("bytes.yaml"), [0xff, 0xfe, 0x00]).unwrap();
    fs::write(folder.join("cv.xml"), "<opencv_storage/>").unwrap();
    fs::write(folder.join("bed.png"), "no picture").unwrap();
    let bed = format!("--plane bed.png {BOARD}");
    for (arguments, words) in [
        ("opencv.yaml --out none.toml", "holds no bed plane"),
        ("calib.toml --out none.yaml", "give --to ros or --to opencv"),
        ("calib.toml --to ros --out none.toml", "ends in .yaml or .yml"),
        ("calib.toml --to ros --out opencv.d/none.yaml", "no folder opencv.d"),
        ("calib.toml --out none.toml", "it is truebead's already"),
        ("opencv.yaml --to ros --out opencv.yaml", "it is the input"),
        ("missing.yaml --to ros --out none.yaml", "missing.yaml: no such file"),
        ("cv.xml --to ros --out none.yaml", "expected a name that ends in .toml, .yaml or .yml"),
        ("calib.toml --to ros --camera-name a/b --out none.yaml", "letters, digits and _"),
        ("calib.toml --to opencv --camera-name a --out none.yaml", "--camera-name: only ROS's"),
        ("opencv.yaml --plane bed.png --out none.toml", "--square-mm"),
        ("opencv.yaml --board 9x6 --to ros --out none.yaml", "--plane"),
        ("bytes.yaml --to ros --out none.yaml", "bytes.yaml: cannot be read: "),
        ("bad.yaml --to ros --out none.yaml", "found a focal length fx of -900."),
        (&format!("opencv.yaml {bed} --to ros --out none.yaml"), "hold no bed plane; leave it out"),
        (&format!("opencv.yaml {bed} --board-thickness-mm=-2 --out none.toml"), "below 0 mm"),
    ] {
        let said = errors(&convert(folder, arguments).assert().code(2));
        assert!(said.contains(words), "{arguments}: no \"{words}\" in {said}");
    }
    assert!(!folder.join("none.toml").exists() && !folder.join("none.yaml").exists());
}
