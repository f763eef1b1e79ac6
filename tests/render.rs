//! Rendered frames: `truebead lab render`, the frames in `test_images`, and what
//! the measurement makes of frames whose truth is known.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use truebead::calibration::{Calibration, CalibrationQuality};
use truebead::cell::Cell;
use truebead::cell::file::{CalibrationSource, Purpose};
use truebead::io::calibration_file;
use truebead::scenario::image::{BeadSide, MotionBlur, Spots};
use truebead::sim::frame_series::FrameSeries;
use truebead::vision::{MeasureMethod, Measurer, WidthMeasurement};

const FOLDERS: [&str; 3] = ["straight", "tilted", "dark"];

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("test_images").join(name)
}

fn scenario(name: &str) -> (Cell, Calibration) {
    let path = folder(name).join("scenario.toml");
    let text = fs::read_to_string(&path).unwrap();
    let cell = Cell::parse(&path, &text, Purpose::Measure).unwrap();
    let calibration = match &cell.calibration {
        CalibrationSource::File(path) => calibration_file::read(path).unwrap(),
        CalibrationSource::Scale { mm_per_px, sigma } => {
            Calibration::Scale { mm_per_px: *mm_per_px, sigma: *sigma }
        }
    };
    (cell, calibration)
}

#[test]
fn the_test_images_are_made_again_pixel_by_pixel() {
    for name in FOLDERS {
        let (cell, calibration) = scenario(name);
        let series = FrameSeries::new(&cell, calibration).unwrap();
        let mut table = csv::Reader::from_path(folder(name).join("truth.csv")).unwrap();
        let rows: Vec<Vec<f64>> = table
            .records()
            .map(|row| row.unwrap().iter().map(|value| value.parse().unwrap()).collect())
            .collect();
        assert_eq!(rows.len() as u64, series.frames());
        for (number, row) in (0..).zip(rows) {
            let rendered = series.render(number).unwrap();
            let path = folder(name).join(format!("frame_{number:05}.png"));
            let kept = image::open(&path).unwrap().into_luma8();
            assert!(rendered.frame.to_grey8() == kept.as_raw().as_slice(), "{}", path.display());
            let truth = rendered.truth.unwrap();
            let made = [truth.width_mm, truth.left.x, truth.left.y, truth.right.x, truth.right.y];
            for (made, kept) in made.iter().zip(&row[2..]) {
                assert!((made - kept).abs() < 1e-5, "{}: {made} {kept}", path.display());
            }
        }
    }
}

/// Errors of the measured widths of many frames of a scenario \[mm\], and in
/// standard deviations as the measurement believes them.
fn errors(name: &str, seeds: u64) -> Vec<(f64, f64)> {
    let (mut cell, calibration) = scenario(name);
    let surface = calibration.surface(cell.surface_height, None);
    let mut measurer = Measurer::new(cell.gauge, None);
    let mut errors = Vec::new();
    for seed in 0..seeds {
        cell.simulation.seed = seed;
        let series = FrameSeries::new(&cell, calibration.clone()).unwrap();
        for frame in 0..series.frames() {
            let rendered = series.render(frame).unwrap();
            let found = measurer.measure(&rendered.frame, &surface).unwrap();
            let error = found.width.get() - rendered.truth.unwrap().width_mm;
            errors.push((error, error / found.sigma.get()));
        }
    }
    errors
}

#[test]
fn measured_widths_are_those_of_the_bead() {
    for (name, bearable_mm) in [("straight", 0.01), ("tilted", 0.03), ("dark", 0.03)] {
        let errors = errors(name, 8);
        let n = f64::from(u32::try_from(errors.len()).unwrap());
        let mean = errors.iter().map(|(mm, _)| mm).sum::<f64>() / n;
        let spread = (errors.iter().map(|(mm, _)| mm * mm).sum::<f64>() / n).sqrt();
        let sigmas = (errors.iter().map(|(_, z)| z * z).sum::<f64>() / n).sqrt();
        eprintln!("{name}: bias {mean:.5} mm, RMS {spread:.5} mm, {sigmas:.2} sigma");
        assert!(spread < bearable_mm, "{name}: {spread}");
        assert!(mean.abs() < 4.0 * spread / n.sqrt(), "{name}: bias {mean} of {spread}");
    }
}

#[test]
fn the_calibrations_share_is_in_the_sigma_of_each_width_and_in_nothing_else() {
    const SHARE: f64 = 0.002;
    let (mut cell, calibration) = scenario("tilted");
    let mut with_sigma = calibration.clone();
    let Calibration::Full { quality, .. } = &mut with_sigma else { unreachable!() };
    *quality = Some(CalibrationQuality {
        reprojection_rms_px: 0.2,
        width_relative_sigma: Some(SHARE),
        seen_px: None,
        heights_mm: None,
        uncertainty: None,
    });
    let frame = FrameSeries::new(&cell, calibration.clone()).unwrap().render(0).unwrap().frame;
    for method in [MeasureMethod::Caliper, MeasureMethod::EdgeLines] {
        cell.gauge.method = method;
        let [without, with] = [&calibration, &with_sigma].map(|calibration| {
            let surface = calibration.surface(cell.surface_height, None);
            Measurer::new(cell.gauge, None).measure(&frame, &surface).unwrap()
        });
        let expected = without.sigma.get().hypot(SHARE * without.width.get());
        assert!((with.sigma.get() / expected - 1.0).abs() < 1e-12, "{method:?}");
        assert_eq!(WidthMeasurement { sigma: without.sigma, ..with }, without);
    }
}

fn render(scenario: &Path, out: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_truebead"));
    command.args(["lab", "render"]).arg(scenario).arg("--out").arg(out).args(more);
    command
}

#[test]
fn a_folder_appears_whole_with_all_that_measuring_it_needs() {
    let scratch = tempfile::tempdir().unwrap();
    let out = scratch.path().join("frames");
    let scenario = folder("tilted").join("scenario.toml");
    render(&scenario, &out, &["--frames", "2"]).assert().success();
    let mut names: Vec<_> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "calibration.toml",
        "frame_00000.png",
        "frame_00001.png",
        "scenario.toml",
        "times.csv",
        "truth.csv",
    ];
    assert_eq!(names, expected);
    let kept = fs::read(folder("tilted").join("frame_00001.png")).unwrap();
    assert!(fs::read(out.join("frame_00001.png")).unwrap() == kept);
    assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 1, "nothing else is left");
}

#[test]
fn a_folder_with_files_and_a_bad_scenario_are_refused_in_words() {
    let scratch = tempfile::tempdir().unwrap();
    let used = scratch.path().join("used");
    fs::create_dir(&used).unwrap();
    fs::write(used.join("notes.txt"), "mine").unwrap();
    let said = |command: &mut Command| {
        let output = command.assert().code(2).get_output().clone();
        String::from_utf8(output.stderr).unwrap()
    };
    let message = said(&mut render(&folder("dark").join("scenario.toml"), &used, &[]));
    assert!(message.contains("holds files already"), "{message}");
    let bad = scratch.path().join("bad.toml");
    let text = fs::read_to_string(folder("dark").join("scenario.toml")).unwrap();
    fs::write(&bad, text.replace("480, 360", "320, 200")).unwrap();
    let message = said(&mut render(&bad, &scratch.path().join("new"), &[]));
    assert!(message.contains("(460, 350)") && message.contains("320 x 200"), "{message}");
    fs::write(&bad, "[render]\nblurr_px = 1\n").unwrap();
    let message = said(&mut render(&bad, &scratch.path().join("new"), &[]));
    assert!(message.contains("line 2") && message.contains("blur_px"), "{message}");
    assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 2, "nothing is left");
}

fn with_render(keys: &str) -> Result<Cell, String> {
    let text = fs::read_to_string(folder("straight").join("scenario.toml")).unwrap();
    let text = format!("{}\n[render]\n{keys}", text.split("[render]").next().unwrap());
    Cell::parse(Path::new("scenario.toml"), &text, Purpose::Measure)
        .map_err(|problems| problems.to_string())
}

#[test]
fn disturbances_are_read_from_the_cell() {
    let keys = "bead_grey = 300.0\nlight_deg = 90.0\nspot_fraction = 0.05\nspot_size_px = 5.0\n\
                shading_side = \"both\"\nmotion_px = 6.0\nmotion_deg = 15.0\ncurve_radius_mm = -80.0\n\
                grain_rows_fraction = 0.3\nshadow_px = 6.0\nneighbour_gap_px = 20.0\n\
                texture_grey = 2.0\nbead_shading_grey_per_px = -1.0";
    let picture = with_render(keys).unwrap().simulation.image;
    assert_eq!((picture.bead_grey, picture.light_deg), (300.0, Some(90.0)));
    assert_eq!(picture.spots, Spots { covered_fraction: 0.05, size_px: 5.0 });
    assert_eq!(picture.motion, MotionBlur { length_px: 6.0, direction_deg: 15.0 });
    assert_eq!((picture.shading.side, picture.shading.bead_grey_per_px), (BeadSide::Both, -1.0));
    assert_eq!((picture.bend.radius_mm, picture.grains.rows_fraction), (-80.0, 0.3));
    assert_eq!((picture.shadow.distance_px, picture.neighbour.gap_px), (6.0, 20.0));
    assert_eq!(picture.texture.sigma_grey, 2.0);
    let both = with_render("curve_radius_mm = 80.0\ncorner_deg = 20.0").unwrap_err();
    assert!(both.contains("corner_deg"), "{both}");
    assert!(with_render("bead_grey = 1001.0").is_err());
}
