//! Dependencies point one way, and the core opens nothing.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the innermost to the outermost; each may use those before it.
/// `config` comes before `sim`, whose plain parameter types it fills.
const LAYERS: [&[&str]; 11] = [
    &["units", "time"],
    &["frame", "geometry", "model", "document"],
    &["bridge", "calib", "vision", "control", "extruder", "identify", "link", "plan"],
    &["config"],
    &["controller"],
    &["ports", "runner"],
    &["sim"],
    &["tune"],
    &["io", "offline"],
    &["live"],
    &["cli"],
];
/// What only the edges may touch.
const EDGES_ONLY: [&str; 6] =
    ["std::fs", "std::net", "Instant::now", "SystemTime", "std::process", "std::thread"];
const CORE: usize = 8;

fn sources(module: &str) -> Vec<PathBuf> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = vec![src.join(format!("{module}.rs"))];
    let mut folders = vec![src.join(module)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                found.push(path);
            }
        }
    }
    found
}

/// Lines of a file that run outside its tests.
fn code(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).unwrap();
    let tests = path.ends_with("tests.rs") || path.iter().any(|part| part == "tests");
    let shipped = if tests { "" } else { text.split("#[cfg(test)]\nmod").next().unwrap() };
    shipped.lines().filter(|line| !line.trim_start().starts_with("//")).map(str::to_owned).collect()
}

#[test]
fn dependencies_point_one_way() {
    for (layer, modules) in LAYERS.iter().enumerate() {
        let outer: Vec<&str> = LAYERS[layer + 1..].concat();
        for path in modules.iter().flat_map(|module| sources(module)) {
            for line in code(&path) {
                for module in &outer {
                    let simulated_bead = *module == "sim" && path.ends_with("config/rendered.rs");
                    let used = line.contains(&format!("crate::{module}::"));
                    assert!(!used || simulated_bead, "{}: {line}", path.display());
                }
            }
        }
    }
}

#[test]
fn the_core_opens_nothing_and_reads_no_clock() {
    for path in LAYERS[..CORE].concat().iter().flat_map(|module| sources(module)) {
        for line in code(&path) {
            for edge in EDGES_ONLY {
                assert!(!line.contains(edge), "{}: {line}", path.display());
            }
        }
    }
}
