//! The documents: every link and anchor resolves, every page is in the table of contents,
//! and the reference names every command and every key.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use nalgebra::{Rotation3, Vector3};
use truebead::calibration::Calibration;
use truebead::calibration::board::Board;
use truebead::core::{Mm, Pose};
use truebead::io::calibration_file;
use truebead::sim::board_studio::{BoardStudio, Exposure};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn book() -> PathBuf {
    root().join("docs/src")
}

fn files_below(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path, ending));
        } else if path.extension().is_some_and(|found| found == ending) {
            files.push(path);
        }
    }
    files.sort();
    files
}

/// Pages of the book, and the documents that stand beside the source.
fn documents() -> Vec<PathBuf> {
    let mut all = files_below(&book(), "md");
    for entry in fs::read_dir(root()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|found| found == "md") {
            all.push(path);
        }
    }
    for folder in ["calib", "cells", "jobs", "models", "robot", "test_images"] {
        all.extend(files_below(&root().join(folder), "md"));
    }
    all
}

/// The lines outside fenced blocks.
fn prose(text: &str) -> Vec<&str> {
    let mut is_fenced = false;
    let outside = text.lines().filter(|line| {
        let is_fence = line.trim_start().starts_with("```");
        is_fenced ^= is_fence;
        !is_fenced && !is_fence
    });
    outside.collect()
}

/// A line without what stands between backticks.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect()
}

/// Targets of `[text](target)`.
fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in prose(text) {
        let line = without_code(line);
        let mut rest = line.as_str();
        while let Some(at) = rest.find("](") {
            rest = &rest[at + 2..];
            let end = rest.find(')').unwrap_or(rest.len());
            found.push(rest[..end].to_owned());
        }
    }
    found
}

/// The anchor of a heading, as mdBook and GitHub make it.
fn anchor(heading: &str) -> String {
    let letters = heading.trim().chars().filter_map(|c| match c {
        c if c.is_alphanumeric() || c == '_' || c == '-' => Some(c.to_ascii_lowercase()),
        c if c.is_whitespace() => Some('-'),
        _ => None,
    });
    letters.collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    let headings = prose(text).into_iter().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                parts.pop();
            }
            Component::CurDir => {}
            other => parts.push(other),
        }
    }
    parts
}

#[test]
fn every_link_and_every_anchor_resolves() {
    let mut broken = Vec::new();
    for page in documents() {
        let text = fs::read_to_string(&page).unwrap();
        for link in links(&text) {
            if link.starts_with("http") || link.starts_with("mailto:") {
                continue;
            }
            let (file, place) = link.split_once('#').unwrap_or((link.as_str(), ""));
            let target = if file.is_empty() {
                page.clone()
            } else {
                plain(&page.parent().unwrap().join(file))
            };
            let is_page = target.extension().is_some_and(|ending| ending == "md");
            // What the book does not hold cannot be reached from its pages.
            let leaves_book = page.starts_with(book()) && !target.starts_with(book());
            let is_there = target.exists()
                && !leaves_book
                && (place.is_empty()
                    || is_page && anchors(&fs::read_to_string(&target).unwrap()).contains(place));
            if !is_there {
                broken.push(format!("{}: {link}", page.strip_prefix(root()).unwrap().display()));
            }
        }
    }
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
}

#[test]
fn every_page_is_in_the_table_of_contents_once() {
    let summary = fs::read_to_string(book().join("SUMMARY.md")).unwrap();
    let listed: Vec<PathBuf> = links(&summary).iter().map(|link| book().join(link)).collect();
    let pages: BTreeSet<PathBuf> = files_below(&book(), "md")
        .into_iter()
        .filter(|page| !page.ends_with("SUMMARY.md"))
        .collect();
    assert_eq!(listed.iter().cloned().collect::<BTreeSet<_>>(), pages);
    assert_eq!(listed.len(), pages.len(), "a page is listed twice");
}

#[test]
fn the_two_documents_that_are_read_first_are_short() {
    for (name, most) in [("README.md", 150), ("ARCHITECTURE.md", 200)] {
        let lines = fs::read_to_string(root().join(name)).unwrap().lines().count();
        assert!(lines <= most, "{name} has {lines} lines, {most} are allowed");
    }
}

#[test]
fn the_reference_of_commands_is_what_the_program_says() {
    let check = Command::new(root().join("scripts/reference"))
        .arg("--check")
        .env("TRUEBEAD", env!("CARGO_BIN_EXE_truebead"))
        .output()
        .unwrap();
    assert!(check.status.success(), "{}", String::from_utf8_lossy(&check.stderr));
}

/// Calls of a table of a file whose first argument is a key.
const READERS: [&str; 17] = [
    ".number(",
    ".number_or(",
    ".optional_number(",
    ".text(",
    ".optional_text(",
    ".choice(",
    ".required_choice(",
    ".integer_or(",
    ".optional_integer(",
    ".list(",
    ".row(",
    ".table(",
    ".required_table(",
    ".table_or_empty(",
    ".run_table(",
    ".optional_run_table(",
    "delay(",
];

fn keys_of(source: &str) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    let generic = [".numbers::<", ".optional_numbers::<"];
    for reader in READERS.iter().chain(&generic) {
        for (at, _) in source.match_indices(reader) {
            let rest = &source[at + reader.len()..];
            let rest = if reader.ends_with('<') { rest.split_once('(').unwrap().1 } else { rest };
            let quoted = rest.trim_start().strip_prefix('"').and_then(|rest| rest.split_once('"'));
            keys.extend(quoted.map(|(key, _)| key.to_owned()));
        }
    }
    keys
}

#[test]
fn the_reference_names_every_key_that_a_file_may_have() {
    let mut sources = files_below(&root().join("src/cell"), "rs");
    sources.extend(files_below(&root().join("src/scenario"), "rs"));
    sources.extend(files_below(&root().join("src/width_control/strategy"), "rs"));
    sources.extend(files_below(&root().join("src/drivers"), "rs"));
    sources.push(root().join("src/calibration/file.rs"));
    let keys: BTreeSet<String> =
        sources.iter().flat_map(|file| keys_of(&fs::read_to_string(file).unwrap())).collect();
    assert!(keys.len() > 150, "only {} keys were found in the source", keys.len());
    let mut pages = files_below(&book().join("reference/cell"), "md");
    pages.push(book().join("reference/calibration-file.md"));
    let text: String = pages.iter().map(|page| fs::read_to_string(page).unwrap()).collect();
    let missing: Vec<&String> = keys
        .iter()
        .filter(|key| !text.contains(&format!("`{key}`")) && !text.contains(&format!("`[{key}]`")))
        .filter(|key| !text.contains(&format!(".{key}]`")))
        .collect();
    assert!(missing.is_empty(), "keys without a line in docs/src/reference: {missing:?}");
}

/// Makes `test_images/boards` again: a board of 8 mm before the camera of
/// `test_images/tilted`, held to all sides, and at last flat on the bed.
#[test]
#[ignore = "writes test_images/boards"]
fn boards_are_rendered_anew() {
    let tilted = root().join("test_images/tilted/calibration.toml");
    let Calibration::Full { camera, image_size_px, bed, .. } =
        calibration_file::read(&tilted).unwrap()
    else {
        unreachable!()
    };
    let square = 8.0;
    let board = Board::new(9, 6, Mm::constant(square)).unwrap();
    let middle = Vector3::new(4.0 * square, 2.5 * square, 0.0);
    let held = (0..9_u32).map(|i| {
        let turn = f64::from(i) * 0.7;
        let tilt = 0.25 + 0.05 * f64::from(i);
        let rotation = Rotation3::new(Vector3::new(tilt * turn.cos(), tilt * turn.sin(), 0.05));
        let at = Vector3::new(9.0 * turn.sin(), 7.0 * turn.cos(), 395.0 + 12.0 * f64::from(i % 3));
        Pose::from_parts(rotation, at - rotation * middle)
    });
    // Z of the bed points at the camera, that of a board away from it.
    let half_turn = Rotation3::new(Vector3::x() * std::f64::consts::PI);
    let on_bed = Rotation3::new(bed.rotation_rad()) * half_turn;
    let before_camera = Vector3::new(0.0, 0.0, 395.0) - on_bed * middle;
    let above_bed = bed.apply_inverse(before_camera.into()).z;
    let down = on_bed * Vector3::z() * above_bed;
    let flat = Pose::from_parts(on_bed, before_camera + down);
    let folder = root().join("test_images/boards");
    fs::create_dir_all(&folder).unwrap();
    let studio = BoardStudio::new(&camera, image_size_px);
    let exposure = Exposure { noise_grey: 0.5, ..Exposure::SHARP };
    for (pose, seed) in held.chain([flat]).zip(0..) {
        let frame = studio.take(&board, &pose, exposure, seed).unwrap();
        let image = image::GrayImage::from_raw(
            image_size_px[0],
            image_size_px[1],
            frame.to_grey8().into_owned(),
        );
        let name = if seed == 9 {
            "view10-bed.png".to_owned()
        } else {
            format!("view{:02}.png", seed + 1)
        };
        image.unwrap().save(folder.join(name)).unwrap();
    }
}
