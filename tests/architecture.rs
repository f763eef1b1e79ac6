//! Rooms use each other in one direction, and the core opens nothing.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use structure::tree::Tree;
use structure::{circles, constants, uses};

/// Every room with the rooms that it may use. A room stands after all that it uses, so
/// that there is no circle.
const ROOMS: [(&str, &[&str]); 28] = [
    ("core", &[]),
    ("numeric", &[]),
    ("document", &[]),
    ("bridge", &["core"]),
    ("calibration", &["core", "numeric", "document", "bridge"]),
    ("vision", &["core", "numeric", "bridge", "calibration"]),
    ("width_control", &["core", "numeric", "document"]),
    ("identify", &["core", "numeric", "document"]),
    ("extruder", &["core", "numeric", "document", "identify"]),
    ("plan", &["core", "numeric", "document", "extruder"]),
    ("scenario", &["core", "document"]),
    ("control", &["core", "width_control", "extruder"]),
    (
        "cell",
        &[
            "core",
            "numeric",
            "document",
            "calibration",
            "vision",
            "width_control",
            "identify",
            "extruder",
            "scenario",
            "control",
        ],
    ),
    ("link", &["core", "extruder"]),
    ("run", &["core", "extruder", "control"]),
    (
        "sim",
        &[
            "core",
            "numeric",
            "calibration",
            "vision",
            "identify",
            "extruder",
            "scenario",
            "control",
            "cell",
            "link",
            "run",
        ],
    ),
    (
        "trials",
        &["core", "numeric", "calibration", "width_control", "control", "cell", "run", "sim"],
    ),
    ("io", &["core", "document", "calibration", "identify", "extruder", "control", "cell", "run"]),
    (
        "tune",
        &[
            "core",
            "numeric",
            "calibration",
            "width_control",
            "identify",
            "scenario",
            "control",
            "cell",
            "link",
            "run",
            "sim",
        ],
    ),
    ("simulators", &["core", "extruder", "link", "sim", "io"]),
    (
        "drivers",
        &[
            "core",
            "document",
            "bridge",
            "calibration",
            "extruder",
            "scenario",
            "control",
            "cell",
            "link",
            "run",
            "sim",
            "io",
        ],
    ),
    (
        "assembly",
        &[
            "core",
            "numeric",
            "document",
            "calibration",
            "identify",
            "extruder",
            "cell",
            "sim",
            "io",
            "drivers",
        ],
    ),
    ("rows", &["core", "numeric", "vision", "width_control", "extruder", "control", "cell", "io"]),
    (
        "live",
        &[
            "core",
            "calibration",
            "vision",
            "width_control",
            "extruder",
            "control",
            "cell",
            "run",
            "io",
            "drivers",
            "rows",
        ],
    ),
    (
        "rehearsal",
        &[
            "core",
            "calibration",
            "vision",
            "extruder",
            "scenario",
            "control",
            "cell",
            "link",
            "run",
            "sim",
            "drivers",
            "rows",
            "live",
        ],
    ),
    (
        "report",
        &[
            "core",
            "numeric",
            "calibration",
            "vision",
            "width_control",
            "identify",
            "extruder",
            "plan",
            "control",
            "cell",
            "sim",
            "trials",
            "io",
            "tune",
            "rows",
        ],
    ),
    (
        "studies",
        &[
            "core",
            "numeric",
            "document",
            "calibration",
            "vision",
            "width_control",
            "identify",
            "extruder",
            "plan",
            "scenario",
            "control",
            "cell",
            "run",
            "sim",
            "trials",
            "io",
            "assembly",
            "rehearsal",
            "report",
        ],
    ),
    (
        "cli",
        &[
            "core",
            "numeric",
            "document",
            "calibration",
            "vision",
            "width_control",
            "identify",
            "extruder",
            "plan",
            "control",
            "cell",
            "link",
            "run",
            "sim",
            "trials",
            "io",
            "tune",
            "simulators",
            "drivers",
            "assembly",
            "rows",
            "live",
            "report",
            "studies",
        ],
    ),
];

/// Rooms at the edges: they may open files and sockets, read clocks and start threads.
const EDGES: [&str; 8] =
    ["io", "assembly", "simulators", "drivers", "rows", "live", "report", "cli"];
/// What only they may touch.
const EDGES_ONLY: [&str; 6] =
    ["std::fs", "std::net", "Instant::now", "SystemTime", "std::process", "std::thread"];

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn tree() -> Tree {
    Tree::read(&source().join("lib.rs")).unwrap()
}

#[test]
fn every_room_is_in_the_table_and_uses_only_rooms_before_it() {
    let rooms: BTreeSet<&str> = ROOMS.iter().map(|(room, _)| *room).collect();
    let tree = tree();
    let found: BTreeSet<&str> = tree.modules[0].children.keys().map(String::as_str).collect();
    assert_eq!(rooms, found);
    let mut before = BTreeSet::new();
    for (room, may_use) in ROOMS {
        for used in may_use {
            assert!(before.contains(used), "{room} uses {used}, which stands after it");
        }
        before.insert(room);
    }
}

#[test]
fn a_room_uses_what_the_table_allows_and_nothing_else() {
    let used = uses::between_rooms(&tree());
    for ((from, to), file) in &used {
        let allowed = ROOMS.iter().any(|(room, uses)| room == from && uses.contains(&to.as_str()));
        assert!(allowed || from == "crate", "{from} uses {to} in {}", file.display());
    }
    for (from, may_use) in ROOMS {
        for to in may_use {
            let pair = (from.to_owned(), (*to).to_owned());
            assert!(used.contains_key(&pair), "{from} no longer uses {to}: take it off the table");
        }
    }
}

#[test]
fn rooms_form_no_circle() {
    let mut graph = std::collections::BTreeMap::new();
    for (from, to) in uses::between_rooms(&tree()).into_keys() {
        graph.entry(from).or_insert_with(BTreeSet::new).insert(to);
    }
    assert_eq!(circles::circles(&graph), Vec::<Vec<String>>::new());
}

#[test]
fn the_core_opens_nothing_and_reads_no_clock() {
    let tree = tree();
    let files: BTreeSet<&Path> = (0..tree.modules.len())
        .filter(|module| !EDGES.contains(&tree.room(*module)) && tree.room(*module) != "crate")
        .map(|module| tree.modules[module].file.as_path())
        .collect();
    for file in files {
        let text = fs::read_to_string(file).unwrap();
        let shipped = text.split("#[cfg(test)]\nmod").next().unwrap();
        for line in shipped.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for edge in EDGES_ONLY {
                assert!(!line.contains(edge), "{}: {line}", file.display());
            }
        }
    }
}

/// Numeric constants whose origin is not stated, by file: `file count`.
const UNSOURCED: &str = include_str!("unsourced.txt");

#[test]
fn no_file_has_more_constants_without_a_source_than_are_listed() {
    let mut found: BTreeMap<String, usize> = BTreeMap::new();
    for constant in constants::numeric(&tree()).iter().filter(|constant| !constant.sourced) {
        let file = constant.file.strip_prefix(source()).unwrap();
        *found.entry(file.display().to_string()).or_default() += 1;
    }
    let listed: BTreeMap<String, usize> = UNSOURCED
        .lines()
        .map(|line| line.split_once(' ').unwrap())
        .map(|(file, count)| (file.to_owned(), count.parse().unwrap()))
        .collect();
    let changed: Vec<String> = found
        .keys()
        .chain(listed.keys())
        .collect::<BTreeSet<_>>()
        .into_iter()
        .filter(|file| found.get(*file) != listed.get(*file))
        .map(|file| format!("{file}: {:?} found, {:?} listed", found.get(file), listed.get(file)))
        .collect();
    assert!(changed.is_empty(), "cite a source, or lower the list: {changed:#?}");
}
