//! A copy of the cell with the proposed settings.

use std::path::Path;

use anyhow::Context;
use toml_edit::{DocumentMut, Item, Value, value};

use super::arguments::ControllerArg;
use super::experiment::DISTANCE_KEYS;
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::cli::arguments::{WrongArguments, refuse_replacing};
use crate::io::atomic_file::write_atomic;
use crate::report::tuned::Tuned;

/// Keys of the cell file whose values are paths of other files.
const PATHS: [(&str, &str); 7] = [
    ("calibration", "file"),
    ("camera", "source"),
    ("extruder", "model"),
    ("extruder", "library"),
    ("extruder", "profile"),
    ("extruder", "starts"),
    ("extruder", "plan"),
];

/// Refuses an existing file, and another folder if relative paths of the cell would be wrong
/// there.
pub fn refuse(path: &Path, cell: &Path, loaded: &LoadedCell) -> anyhow::Result<()> {
    refuse_replacing_written(path)?;
    let folder = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        folder.unwrap_or(Path::new(".")).canonicalize()
    };
    let to =
        folder(path).map_err(|error| wrong!("--write {}: its folder: {error}", path.display()))?;
    if folder(cell).is_ok_and(|from| from == to) {
        return Ok(());
    }
    let document: DocumentMut = loaded.text.parse().context("the cell file")?;
    match PATHS.into_iter().find(|(table, key)| is_relative(&document, table, key)) {
        None => Ok(()),
        Some((table, key)) => Err(wrong!(
            "--write {}: {table}.{key} of {} is relative to its folder and would lead elsewhere; \
             name a file beside the cell",
            path.display(),
            cell.display()
        )
        .into()),
    }
}

fn refuse_replacing_written(path: &Path) -> Result<(), WrongArguments> {
    refuse_replacing(path, "file").map_err(|_| {
        wrong!(
            "{} is there already and would be lost; name another file with --write",
            path.display()
        )
    })
}

/// Whether the value of a key is a relative path, not a device or an address.
fn is_relative(document: &DocumentMut, table: &str, key: &str) -> bool {
    let named = document.get(table).and_then(|table| table.get(key)).and_then(Item::as_str);
    let is_other = |name: &str| {
        name == "rendered"
            || ["camera:", "gst:", "http://", "https://"].iter().any(|kind| name.starts_with(kind))
    };
    named.is_some_and(|name| !is_other(name) && Path::new(name).is_relative())
}

/// Writes the copy. Before it gets its name it is read back like any cell.
pub fn write(
    path: &Path,
    loaded: &LoadedCell,
    tuned: &Tuned,
    controller: ControllerArg,
) -> anyhow::Result<()> {
    let text = text(loaded, tuned, controller)?;
    LoadedCell::from_text(path, text.clone(), Purpose::Run)?;
    refuse_replacing_written(path)?;
    write_atomic(path, text.as_bytes())?;
    Ok(())
}

fn text(loaded: &LoadedCell, tuned: &Tuned, controller: ControllerArg) -> anyhow::Result<String> {
    let mut document: DocumentMut = loaded.text.parse().context("the cell file")?;
    let unit = document["control"].get("error_unit_mm").and_then(number).unwrap_or(1.0);
    for (table, key, number) in tuned.settings(controller == ControllerArg::Distance, unit) {
        set(&mut document, table, key, value(number));
    }
    let name = if controller == ControllerArg::Distance { "distance" } else { "pi" };
    set(&mut document, "control", "strategy", value(name));
    let control = document["control"].as_table_like_mut().context("[control] is no table")?;
    control.remove("step_fraction");
    if controller == ControllerArg::Pi {
        for key in DISTANCE_KEYS {
            control.remove(key);
        }
    }
    Ok(document.to_string())
}

fn number(item: &Item) -> Option<f64> {
    item.as_float()
        .or_else(|| item.as_integer().and_then(|whole| i32::try_from(whole).ok()).map(f64::from))
}

/// Sets a key; the comment after it is kept.
fn set(document: &mut DocumentMut, table: &str, key: &str, to: Item) {
    let decor = document[table].get(key).and_then(Item::as_value).map(|old| old.decor().clone());
    document[table][key] = to;
    if let (Some(decor), Some(new)) = (decor, document[table][key].as_value_mut()) {
        *Value::decor_mut(new) = decor;
    }
}
