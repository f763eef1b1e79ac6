//! What the data are: a table, or a recording with its cell.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result};

use super::layer::LayerArgs;
use crate::cell::Cell;
use crate::cell::file::Purpose;
use crate::cli::arguments::WrongArguments;
use crate::core::units::Mm;
use crate::identify::table::DataTable;
use crate::io::bead_columns::{BeadColumns, CellFacts, columns};
use crate::io::recording::Recording;

/// How an MCAP file begins.
const MAGIC: &[u8] = b"\x89MCAP";

/// Data as they were read.
pub enum LogSource {
    /// Columns on moments of their own.
    Recording(BeadColumns),
    /// Rows.
    Table(DataTable),
}

impl LogSource {
    /// Reads either.
    pub fn read(path: &Path, layer: &LayerArgs) -> Result<Self> {
        let name = path.display().to_string();
        let wrong = |what: &dyn std::fmt::Display| WrongArguments::new(format!("{name}: {what}"));
        let mut begins = Vec::new();
        let opened = File::open(path).map_err(|error| wrong(&error))?;
        let head = opened.take(MAGIC.len() as u64).read_to_end(&mut begins);
        head.map_err(|error| wrong(&error))?;
        if begins == MAGIC {
            return recorded(path, layer).map(Self::Recording);
        }
        let bytes = std::fs::read(path).map_err(|error| wrong(&error))?;
        let text = String::from_utf8(bytes).map_err(|_| {
            wrong(&"this is no text; expected a table (CSV) with a line of names, or a recording")
        })?;
        Ok(Self::Table(DataTable::parse(&text).map_err(|error| wrong(&error))?))
    }
}

fn recorded(path: &Path, layer: &LayerArgs) -> Result<BeadColumns> {
    let mut recording = Recording::open(path).map_err(WrongArguments::new)?;
    let facts = facts(&recording, layer)?;
    let name = recording.file().to_owned();
    let mut found = columns(recording.by_ref(), &facts).with_context(|| name.clone())?;
    found.notes.extend(recording.integrity().summary());
    Ok(found)
}

/// What the cell file says that is attached.
fn facts(recording: &Recording, layer: &LayerArgs) -> Result<CellFacts> {
    let file = recording.file();
    if recording.run().is_none() {
        let what = format!(
            "{file}: not a recording of truebead: it has no metadata record \"run\" at its start"
        );
        return Err(WrongArguments::new(what).into());
    }
    let Some(text) = recording.cell() else {
        let what = format!(
            "{file}: the attachment cell.toml is missing, so the units of its commands and the \
             camera's offset are unknown"
        );
        return Err(WrongArguments::new(what).into());
    };
    let name = format!("cell.toml in {file}");
    let cell = Cell::parse(Path::new(&name), text, Purpose::Run).map_err(WrongArguments::new)?;
    let Some(run) = cell.run else {
        let what = format!("{name}: it lacks tables that a run needs");
        return Err(WrongArguments::new(what).into());
    };
    let extruder = run.extruder.as_ref().map(|part| &part.extruder);
    let given = layer.layer_height()?;
    let offset = layer.offset()?;
    Ok(CellFacts {
        command: extruder.map(|extruder| extruder.drive.unit()),
        layer_height: given.or(extruder.map(|extruder| extruder.layer_height)),
        offset: offset.map_or(run.camera.offset, |mm| Mm::new(mm).unwrap_or(run.camera.offset)),
    })
}
