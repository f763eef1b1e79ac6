//! `truebead compare` as a user types it.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod common;

use common::{said, truebead};

/// A cell that ships with the program.
fn cell(name: &str) -> String {
    format!("{}/cells/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn controllers_differ_at_every_width() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    let cells = [cell("barjuei2022.toml"), cell("distance.toml")];
    let args = ["--widths", "42,40", "--seeds", "3", "--out", folder];
    let mut command = truebead(&["compare", &cells[0], &cells[1]]);
    let said = said(command.args(args), 0);
    assert!(said.contains("RMS error over that of the first"), "{said}");
    let json = std::fs::read_to_string(out.path().join("compare.json")).unwrap();
    let numbers: Vec<serde_json::Value> = serde_json::from_str(&json).unwrap();
    assert_eq!(numbers.len(), 2 * 2 * 7);
    let ratio = |controller: &str, width: f64| {
        let found = numbers.iter().find(|number| {
            number["controller"] == controller
                && number["width_mm"] == width
                && number["quantity"] == "RMS error over that of the first"
        });
        found.unwrap()["mean"].as_f64().unwrap()
    };
    for width in [42.0, 40.0] {
        assert_eq!(ratio("barjuei2022", width), 1.0);
        assert!(ratio("distance", width) < 0.35);
    }
    assert!(out.path().join("report.html").metadata().unwrap().len() > 10_000);
}

#[test]
fn a_cell_with_an_extruder_of_its_own_and_widths_that_cannot_be_are_refused() {
    let out = tempfile::tempdir().unwrap();
    let refused = |args: &[&str]| said(truebead(args).arg("--out").arg(out.path()), 2);
    let said = refused(&["compare", &cell("extruder-screw.toml")]);
    assert!(said.contains("found [extruder]"), "{said}");
    let said = refused(&["compare", &cell("distance.toml"), "--widths", "42,-3"]);
    assert!(said.contains("expected 0.1 to 1000 mm"), "{said}");
    let said = refused(&["compare", &cell("distance.toml"), "--widths", "42,200"]);
    assert!(said.contains("width_range_mm of distance"), "{said}");
    let text = std::fs::read_to_string(cell("distance.toml")).unwrap();
    let course =
        text.replacen("[control]", "[control]\npath_mm = [0, 900]\npath_width_mm = [42, 38]", 1);
    let changing = out.path().join("course.toml");
    std::fs::write(&changing, course).unwrap();
    let changing = changing.to_str().unwrap();
    let said = refused(&["compare", changing]);
    assert!(said.contains("expected one width"), "{said}");
    let near = text.replacen("offset_mm = ", "offset_mm = 1.0 # ", 1);
    std::fs::write(changing, near).unwrap();
    let said = refused(&["compare", changing]);
    assert!(said.contains("camera.offset_mm: found 1"), "{said}");
}
