//! `truebead camera offset`: from a recorded bead, and from a board under the nozzle.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use nalgebra::{Rotation3, Vector3};
use truebead::calibration::board::Board;
use truebead::calibration::{Camera, file};
use truebead::core::{Mm, Pose};
use truebead::sim::board_studio::{BoardStudio, Exposure};

use common::{said, truebead};

const SIZE: [u32; 2] = [640, 480];

fn offset(input: &Path, more: &[&str]) -> Command {
    let mut command = truebead(&["camera", "offset"]);
    command.arg(input).args(more);
    command
}

/// The line for the cell file.
fn printed_mm(answer: &str) -> f64 {
    let line = answer.lines().find(|line| line.starts_with("offset_mm = ")).unwrap();
    line.trim_start_matches("offset_mm = ").parse().unwrap()
}

/// The offset and its standard deviation.
fn offset_and_sigma(answer: &str) -> (f64, f64) {
    let line = answer.lines().find(|line| line.starts_with("offset ")).unwrap();
    let number = |word: usize| line.split_whitespace().nth(word).unwrap().parse().unwrap();
    (number(1), number(3))
}

/// Whether an answer is that of cells/demo.toml.
fn is_the_demos(answer: &str) -> bool {
    let (offset, sigma) = offset_and_sigma(answer);
    (offset - 88.4).abs() < 3.0 * sigma && sigma < 8.0
}

#[test]
fn a_demo_tells_the_offset_of_its_cell() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("demo");
    truebead(&["-q", "demo", "--seconds", "11", "--out"]).arg(&out).assert().success();
    let recording = out.join("recording.mcap");
    let answer = said(&mut offset(&recording, &[]), 0);
    assert!(is_the_demos(&answer) && answer.contains("has offset_mm = 88.4"), "{answer}");
    // Another cell has another offset, and the same gauge.
    let cell = fs::read_to_string("cells/demo.toml").unwrap();
    let path = folder.path().join("cell.toml");
    fs::write(&path, cell.replace("offset_mm = 88.4", "offset_mm = 120.0")).unwrap();
    let answer = said(&mut offset(&recording, &["--cell", path.to_str().unwrap()]), 0);
    assert!(is_the_demos(&answer) && answer.contains("too much"), "{answer}");
    // A recording that was cut short is used as far as it goes.
    let whole = fs::read(&recording).unwrap();
    let partial = out.join("recording.mcap.partial");
    fs::write(&partial, &whole[..whole.len() * 19 / 20]).unwrap();
    let answer = said(&mut offset(&partial, &[]), 0);
    assert!(is_the_demos(&answer), "{answer}");
    let too_near = said(&mut offset(&recording, &["--max-mm", "40"]), 1);
    assert!(
        too_near.contains("does not determine the offset: the widths fit best at the end"),
        "{too_near}"
    );
    let wrong = said(&mut offset(&recording, &["--nozzle-at", "-1,-1"]), 2);
    assert!(wrong.contains("--nozzle-at means nothing for a recording"), "{wrong}");
}

/// A camera 430 mm above the bed that looks straight down.
fn bed() -> Pose {
    Pose::new(Vector3::new(std::f64::consts::PI, 0.0, 0.0), Vector3::new(0.0, 0.0, 430.0))
}

fn camera() -> Camera {
    Camera::pinhole([900.0, 900.0], [319.5, 239.5])
}

/// A cell whose gauge's middle is the image's, and a image of a board of which the
/// position 4,-1 is 80 mm ahead of it.
fn scene(folder: &Path) -> (PathBuf, PathBuf) {
    let (cell, picture) = (folder.join("cell.toml"), folder.join("board.png"));
    let text = file::to_toml(&camera(), &bed(), SIZE, Mm::ZERO, None, &[]);
    fs::write(folder.join("calib.toml"), text).unwrap();
    let text = "[calibration]\nfile = \"calib.toml\"\nsurface_height_mm = 10.0\n\
                [gauge]\nroi_px = [220, 140, 200, 200]\nbead_axis = \"vertical\"\n\
                polarity = \"bright\"\nwidth_range_mm = [20.0, 60.0]\n";
    fs::write(&cell, text).unwrap();
    let axes = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let origin = bed().apply([-80.0, 80.0 - 20.0, 0.0].into());
    let pose = Pose::from_parts(bed().rotation() * axes, origin.coords);
    let board = Board::new(9, 6, Mm::constant(20.0)).unwrap();
    let frame = BoardStudio::new(&camera(), SIZE).take(&board, &pose, Exposure::SHARP, 5).unwrap();
    let image = image::GrayImage::from_raw(640, 480, frame.to_grey8().into_owned()).unwrap();
    image.save(&picture).unwrap();
    (cell, picture)
}

#[test]
fn a_board_under_the_nozzle_gives_the_offset() {
    let folder = tempfile::tempdir().unwrap();
    let (cell, picture) = scene(folder.path());
    let cell = cell.to_str().unwrap();
    let board = ["--cell", cell, "--board", "9x6", "--square-mm", "20"];
    let with = |more: &[&'static str]| -> Vec<&str> { [&board[..], more].concat() };
    let answer = said(&mut offset(&picture, &with(&["--nozzle-at", "4,-1"])), 0);
    assert!((printed_mm(&answer) - 80.0).abs() < 0.11, "{answer}");
    assert!(answer.contains("± 0.50 mm") && answer.contains("has no offset_mm"), "{answer}");
    let aside = said(&mut offset(&picture, &with(&["--nozzle-at=-1,-1"])), 0);
    assert!(aside.contains("100.0") && aside.contains("WARNING"), "{aside}");
    let behind = said(&mut offset(&picture, &with(&["--nozzle-at", "4,5"])), 1);
    assert!(behind.contains("on the far side of the gauge (40.0 mm behind"), "{behind}");
    let missing = said(&mut offset(&picture, &["--cell", cell]), 2);
    assert!(missing.contains("needs --board") && missing.contains("--nozzle-at"), "{missing}");
    let of_recording = with(&["--nozzle-at", "4,-1", "--max-mm", "300"]);
    let wrong = said(&mut offset(&picture, &of_recording), 2);
    assert!(wrong.contains("--max-mm means nothing for an image"), "{wrong}");
    // A single number does not say where the bed is.
    let text = fs::read_to_string(cell).unwrap();
    fs::write(cell, text.replace("file = \"calib.toml\"", "mm_per_px = 0.4")).unwrap();
    let single = said(&mut offset(&picture, &with(&["--nozzle-at", "4,-1"])), 2);
    assert!(single.contains("mm_per_px, a single number"), "{single}");
}

#[test]
fn what_is_neither_recording_nor_image_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert!(said(&mut offset(folder.path(), &[]), 2).contains("a folder, expected a recording"));
    assert!(said(&mut offset(Path::new("none.mcap"), &[]), 2).contains("none.mcap"));
}
