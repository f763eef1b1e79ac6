//! The reference of cell keys says what the program reads: every key, its words, its range,
//! its default and whether it is required.

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use truebead::cell::Cell;
use truebead::document::describe::{KeyKind, KeySpec};
use truebead::drivers::Devices;

/// Ends of a range from here on only keep out typing errors; the reference leaves them out.
const UNBOUNDED: f64 = 1e5;
/// Smaller lower ends only keep out zero.
const ABOVE_ZERO: f64 = 1e-2;

/// A row of a table of the reference.
struct Row {
    values: String,
    default: String,
}

/// The rows of a page by their keys, of several tables where a page has them.
fn rows(page: &str) -> BTreeMap<String, Vec<Row>> {
    let mut rows: BTreeMap<String, Vec<Row>> = BTreeMap::new();
    for line in page.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = line.split(" | ").map(str::trim).collect();
        let [keys, values, default, ..] = cells.as_slice() else { continue };
        for key in keys.split('`').skip(1).step_by(2) {
            let row = Row { values: (*values).to_owned(), default: (*default).to_owned() };
            rows.entry(key.to_owned()).or_default().push(row);
        }
    }
    rows
}

/// The name of a key in the reference: one row stands for a command's keys in all its units.
fn documented(table: &str, key: &str) -> String {
    if table != "extruder" {
        return key.to_owned();
    }
    let units = ["rpm", "v", "mpa", "mm3_per_s", "kg_per_s", "filling"];
    let of_command = |prefix: &str, suffix: &str| {
        key.strip_prefix(prefix)
            .and_then(|rest| rest.strip_suffix(suffix))
            .is_some_and(|unit| units.contains(&unit))
    };
    if of_command("max_", "_per_s") {
        "max_UNIT_per_s".to_owned()
    } else if of_command("max_", "") {
        "max_UNIT".to_owned()
    } else if of_command("min_", "") {
        "min_UNIT".to_owned()
    } else if of_command("constant_", "") {
        "constant_UNIT".to_owned()
    } else {
        key.to_owned()
    }
}

fn plain(text: &str) -> String {
    text.replace(',', "")
}

fn has_number(text: &str, number: f64) -> bool {
    plain(text)
        .split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)))
        .filter_map(|word| word.trim_end_matches('.').parse::<f64>().ok())
        .any(|found| (found - number).abs() <= 1e-9 * number.abs())
}

/// What a row lacks of what the program reads; nothing where all is there.
fn missing(spec: &KeySpec, row: &Row) -> Vec<String> {
    let mut lacks = Vec::new();
    match &spec.kind {
        KeyKind::Choice(words) => {
            lacks.extend(
                words.iter().filter(|word| !row.values.contains(&format!("\"{word}\""))).cloned(),
            );
        }
        KeyKind::Number(range) => {
            let (low, high) = (*range.start(), *range.end());
            if low.abs() >= ABOVE_ZERO && low.abs() < UNBOUNDED && !has_number(&row.values, low) {
                lacks.push(format!("from {low}"));
            }
            if high.abs() < UNBOUNDED && !has_number(&row.values, high) {
                lacks.push(format!("to {high}"));
            }
        }
        _ => {}
    }
    if let Some(default) = &spec.default {
        let stands = match default.parse::<f64>() {
            Ok(number) => has_number(&row.default, number),
            Err(_) => row.default.contains(&format!("\"{default}\"")),
        };
        if !stands {
            lacks.push(format!("default {default}"));
        }
    }
    if spec.is_required && spec.when.is_empty() && !row.default.contains("required") {
        lacks.push("required".to_owned());
    }
    lacks
}

#[test]
fn the_reference_says_what_the_program_reads() {
    let specs = Cell::keys(Devices::default);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/src/reference/cell");
    let mut wrong = Vec::new();
    let mut pages: BTreeMap<String, BTreeMap<String, Vec<Row>>> = BTreeMap::new();
    for spec in &specs {
        let read = |table: &str| {
            let file = folder.join(format!("{}.md", table.replace(['.', '_'], "-")));
            rows(&fs::read_to_string(file).unwrap_or_default())
        };
        let page = pages.entry(spec.table.clone()).or_insert_with(|| read(&spec.table));
        let name = documented(&spec.table, spec.key);
        // A plant of a kind has the keys of the strategy for it, and refers to them.
        let referred = if spec.table == "extruder_plant" && !page.contains_key(&name) {
            let mut referred = read("extruder.pressure");
            referred.append(&mut read("extruder.screw"));
            referred.remove(&name).unwrap_or_default()
        } else {
            Vec::new()
        };
        let spec = &KeySpec {
            is_required: spec.is_required && referred.is_empty(),
            default: spec.default.clone().filter(|_| referred.is_empty()),
            ..spec.clone()
        };
        let Some(found) = page.get(&name).or((!referred.is_empty()).then_some(&referred)) else {
            wrong.push(format!("{}.{}: not in the reference", spec.table, name));
            continue;
        };
        let lacks: Vec<Vec<String>> = found.iter().map(|row| missing(spec, row)).collect();
        if let Some(least) = lacks.iter().min_by_key(|lacks| lacks.len())
            && !least.is_empty()
        {
            wrong.push(format!("{}.{name}: the reference lacks {least:?}", spec.table));
        }
    }
    for (table, page) in &pages {
        let known = |key: &str| {
            specs.iter().any(|spec| spec.table == *table && documented(table, spec.key) == *key)
        };
        wrong.extend(
            page.keys().filter(|key| !known(key)).map(|key| format!("{table}.{key}: no such key")),
        );
    }
    assert!(specs.len() > 150, "{}", specs.len());
    assert!(wrong.is_empty(), "{} differ: {wrong:#?}", wrong.len());
}
