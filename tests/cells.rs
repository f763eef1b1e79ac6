//! Every cell that is shipped is sound for what it says that it is for.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

use truebead::cell::Cell;
use truebead::cell::file::{CalibrationSource, Purpose};
use truebead::io::calibration_file;
use truebead::vision::EdgeKind;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn cells_in(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect()
}

#[test]
fn shipped_cells_are_sound() {
    let cells = cells_in(&root().join("cells"));
    assert!(cells.len() >= 4);
    for path in cells {
        let text = fs::read_to_string(&path).unwrap();
        let only_measures = path.ends_with("process.toml");
        let purpose = if only_measures { Purpose::Measure } else { Purpose::Run };
        let cell = Cell::parse(&path, &text, purpose).unwrap_or_else(|e| panic!("{e}"));
        if let CalibrationSource::File(file) = &cell.calibration {
            calibration_file::read(file).unwrap_or_else(|e| panic!("{e}"));
        }
        assert_eq!(cell.run.is_none(), only_measures);
    }
}

#[test]
fn the_cell_of_the_contract_is_taken_as_it_stands() {
    let text = r#"
[calibration]
file = "calib/cell.toml"
surface_height_mm = 20.0
[gauge]
roi_px = [40, 20, 640, 500]
bead_axis = "vertical"
polarity = "bright"
width_range_mm = [20.0, 60.0]
channel = "grey"
[control]
target_width_mm = 42.0
"#;
    let cell = Cell::parse(Path::new("x/cell.toml"), text, Purpose::Measure).unwrap();
    assert_eq!(cell.target.unwrap().nominal().get(), 42.0);
    assert_eq!(cell.calibration, CalibrationSource::File("x/calib/cell.toml".into()));
}

#[test]
fn a_single_scale_may_have_a_standard_deviation_smaller_than_itself() {
    let text = fs::read_to_string(root().join("cells/process.toml")).unwrap();
    let with = |line: &str| {
        let text = text.replace("[calibration]", &format!("[calibration]\n{line}"));
        Cell::parse(Path::new("cell.toml"), &text, Purpose::Measure)
    };
    for (line, expected) in [("", None), ("mm_per_px_sigma = 0.0002", Some(0.0002))] {
        let CalibrationSource::Scale { sigma, .. } = with(line).unwrap().calibration else {
            unreachable!()
        };
        assert_eq!(sigma, expected);
    }
    for (found, expected) in [
        ("-0.001", "expected a number from 0 to 1000"),
        ("nan", "expected a number from 0 to 1000"),
        ("0.126582", "expected less than mm_per_px"),
    ] {
        let said = with(&format!("mm_per_px_sigma = {found}")).unwrap_err().to_string();
        let line = format!("calibration.mm_per_px_sigma: found {found}, {expected}");
        assert!(said.contains(&line), "no \"{line}\" in\n{said}");
    }
    let of_a_file =
        text.replace("mm_per_px = 0.126582", "file = \"a.toml\"\nmm_per_px_sigma = 0.1");
    let said = Cell::parse(Path::new("cell.toml"), &of_a_file, Purpose::Measure).unwrap_err();
    assert!(said.to_string().contains("expected mm_per_px beside it"), "{said}");
}

#[test]
fn a_target_that_the_gauge_would_refuse_is_reported_with_its_key() {
    let text = fs::read_to_string(root().join("cells/live.toml")).unwrap();
    let with = |target: &str, layers: &str| {
        let text = text.replace("target_width_mm = 42.0", target);
        let text = format!("{text}\n{layers}");
        Cell::parse(Path::new("cells/cell.toml"), &text, Purpose::Run)
    };
    let course = "target_width_mm = 42.0\npath_mm = [0.0, 100.0]\npath_width_mm =";
    let layers = "[layers]\nfirst_z_mm = 20.0\nheight_mm = 10.0\nwidth_mm =";
    let plain = "target_width_mm = 42.0";
    for (target, layers, found) in [
        ("target_width_mm = 62.0".into(), String::new(), "control.target_width_mm: found 62"),
        (format!("{course} [42.0, 19.0]"), String::new(), "control.path_width_mm: found 19"),
        (plain.into(), format!("{layers} [42.0, 61.5]"), "layers.width_mm: found 61.5"),
    ] {
        let said = with(&target, &layers).unwrap_err().to_string();
        let line = format!("{found}, expected within width_range_mm of [gauge], 20 mm to 60 mm");
        assert!(said.contains(&line), "no \"{line}\" in\n{said}");
    }
    assert!(with(&format!("{course} [20.0, 60.0]"), &format!("{layers} [42.0, 50.0]")).is_ok());
}

#[test]
fn another_bead_needs_its_width_and_where_it_begins() {
    let text = fs::read_to_string(root().join("cells/distance.toml")).unwrap();
    let with = |lines: &str| {
        let text = text.replace("[simulation]", &format!("[simulation]\n{lines}"));
        Cell::parse(Path::new("cell.toml"), &text, Purpose::Run)
    };
    let (width, from) = ("other_bead_mm = 45.0", "other_bead_from_mm = 900.0");
    assert!(with(&format!("{width}\n{from}")).unwrap().simulation.other_bead.is_some());
    for (line, missing) in [(width, "other_bead_from_mm"), (from, "other_bead_mm")] {
        let said = with(line).unwrap_err().to_string();
        assert!(said.contains(&format!("expected {missing} as well: both or none")), "{said}");
    }
}

#[test]
fn the_gauge_names_edge_sigma_and_gamma() {
    let text = fs::read_to_string(root().join("cells/process.toml")).unwrap();
    let with = |line: &str| {
        let key = line.split_once(' ').unwrap().0;
        let rest = text.lines().filter(|line| !line.starts_with(key)).collect::<Vec<_>>();
        let text = format!("{}\n{line}\n", rest.join("\n"));
        Cell::parse(Path::new("cell.toml"), &text, Purpose::Measure)
    };
    let gauge = |line: &str| with(line).unwrap().gauge;
    let plain = gauge("channel = \"grey\"");
    assert_eq!((plain.edge, plain.max_sigma, plain.gamma), (EdgeKind::Auto, 0.02, None));
    assert_eq!(gauge("edge = \"groove\"").edge, EdgeKind::Groove);
    assert_eq!(gauge("edge = \"step\"").edge, EdgeKind::Step);
    assert_eq!(gauge("max_sigma = 0.5").max_sigma, 0.5);
    assert_eq!(gauge("gamma = 0.45").gamma, Some(0.45));
    for (line, expected) in [
        ("edge = \"seam\"", "gauge.edge: found \"seam\", expected"),
        ("max_sigma = 0", "gauge.max_sigma: found 0, expected a fraction of the width above 0"),
        ("max_sigma = 0.6", "gauge.max_sigma: found 0.6, expected a number from 0 to 0.5"),
        ("gamma = 0.1", "gauge.gamma: found 0.1, expected a number from 0.2 to 5"),
        ("gamma = \"srgb\"", "gauge.gamma: found \"srgb\", expected a number"),
        (
            "gamma = 0.45\nmethod = \"edge_lines\"",
            "gauge.gamma: found 0.45, expected no gamma beside method = \"edge_lines\"",
        ),
    ] {
        let said = with(line).unwrap_err().to_string();
        assert!(said.contains(expected), "no \"{expected}\" in\n{said}");
    }
}

#[test]
fn one_model_is_named_or_looked_up_and_a_linear_plant_has_its_coefficients() {
    let text = fs::read_to_string(root().join("cells/extruder-feedforward.toml")).unwrap();
    let said = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        let text = text.replace(from, to);
        Cell::parse(Path::new("cell.toml"), &text, Purpose::Run).unwrap_err().to_string()
    };
    let both = said("library = \"../models\"", "model = \"a.toml\"\nlibrary = \"../models\"");
    let beside = said("library = \"../models\"", "model = \"a.toml\"");
    assert!(both.contains("extruder.library: found a library beside a model"), "{both}");
    for said in [both, beside] {
        assert!(said.contains("extruder.nozzle_mm: found a key of a library beside a model"));
        assert!(!said.contains("unknown key"), "{said}");
    }
    let neither = said("library = \"../models\"", "");
    assert!(neither.contains("extruder.library: found nothing, expected the folder"), "{neither}");
    assert!(!neither.contains("unknown key"), "{neither}");
    let bare = said("numerator = [18.0]\n", "");
    let expected = "extruder_plant.numerator: found nothing, expected the coefficients of a linear";
    assert!(bare.contains(expected), "{bare}");
}
