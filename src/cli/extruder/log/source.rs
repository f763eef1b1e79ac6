//! The source of data: a table, or a recording with its cell.

use std::path::Path;

use anyhow::{Context, Result};

use super::columns::ColumnArgs;
use super::layer::LayerArgs;
use crate::cell::Cell;
use crate::cell::file::Purpose;
use crate::cli::arguments::WrongArguments;
use crate::cli::recorded::{begins_with, open, refuse_foreign};
use crate::core::Mm;
use crate::identify::series::TimeSeries;
use crate::identify::table::DataTable;
use crate::io::bead_columns::{BeadColumns, BeadFacts, columns};
use crate::io::recording::Recording;

/// First bytes of an MCAP file (MCAP specification, § Magic).
const MAGIC: &[u8] = b"\x89MCAP";

/// Data from a file.
pub enum LogSource {
    /// Columns with their own sample times.
    Recording(BeadColumns),
    /// Rows with common sample times.
    Table(DataTable),
}

impl LogSource {
    /// Reads a table or a recording.
    pub fn read(path: &Path, layer: &LayerArgs) -> Result<Self> {
        let name = path.display().to_string();
        let wrong = |what: &dyn std::fmt::Display| wrong!("{name}: {what}");
        if begins_with(path, MAGIC).map_err(|error| wrong(&error))? {
            return recorded(path, layer).map(Self::Recording);
        }
        let bytes = std::fs::read(path).map_err(|error| wrong(&error))?;
        let text = String::from_utf8(bytes).map_err(|_| {
            wrong(&"this is no text; expected a table (CSV) with a line of names, or a recording")
        })?;
        Ok(Self::Table(DataTable::parse(&text).map_err(|error| wrong(&error))?))
    }
}

/// A column of a recording, cut to the requested range. Fails if there is no column of this name.
pub fn recorded_column(
    found: &BeadColumns,
    file: &str,
    wanted: &str,
    columns: &ColumnArgs,
) -> Result<TimeSeries, WrongArguments> {
    let series = found.columns.iter().find(|series| series.name == wanted);
    series.map(|series| columns.cut_series(series)).ok_or_else(|| {
        let known: Vec<_> = found.columns.iter().map(|series| series.name.as_str()).collect();
        wrong!("{file}: there is no column {wanted}; the columns are {}", known.join(", "))
    })
}

fn recorded(path: &Path, layer: &LayerArgs) -> Result<BeadColumns> {
    let mut recording = open(path)?;
    let facts = facts(&recording, layer)?;
    let name = recording.file().to_owned();
    let mut found = columns(recording.by_ref(), &facts).with_context(|| name.clone())?;
    found.notes.extend(recording.integrity().summary());
    Ok(found)
}

/// Facts from the attached cell file.
fn facts(recording: &Recording, layer: &LayerArgs) -> Result<BeadFacts> {
    let file = recording.file();
    refuse_foreign(recording)?;
    let Some(text) = recording.cell() else {
        refuse!(
            "{file}: the attachment cell.toml is missing, so the units of its commands and the \
             camera's offset are unknown"
        );
    };
    let name = format!("cell.toml in {file}");
    let cell = Cell::parse(Path::new(&name), text, Purpose::Run).map_err(WrongArguments::new)?;
    let Some(run) = cell.run else {
        refuse!("{name}: it lacks tables that a run needs");
    };
    let extruder = run.extruder.as_ref().map(|part| &part.extruder);
    let given = layer.layer_height()?;
    let offset = layer.offset()?;
    Ok(BeadFacts {
        command: extruder.map(|extruder| extruder.drive.unit()),
        layer_height: given.or(extruder.map(|extruder| extruder.layer_height)),
        offset: offset.map_or(run.camera.offset, |mm| Mm::new(mm).unwrap_or(run.camera.offset)),
    })
}
