//! Recordings as the input of a command, and the cell that is attached to them.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::arguments::WrongArguments;
use crate::calibration::{Calibration, file};
use crate::cell::Cell;
use crate::cell::file::{CalibrationSource, Purpose};
use crate::io::recording::Recording;

/// Opens a recording from the command line.
pub fn open(path: &Path) -> Result<Recording, WrongArguments> {
    Recording::open(path).map_err(WrongArguments::new)
}

/// Refuses a recording of another program.
pub fn refuse_foreign(recording: &Recording) -> Result<(), WrongArguments> {
    if recording.run().is_none() {
        refuse!(
            "{}: not a recording of truebead: it has no metadata record \"run\" at its start",
            recording.file()
        );
    }
    Ok(())
}

/// Warns of missing or damaged parts of a recording that has been read.
pub fn warn_of_damage(recording: &Recording) {
    if let Some(what) = recording.integrity().summary() {
        tell!("warning: {}: {what}", recording.file());
    }
}

/// Whether a file begins with these bytes.
pub fn begins_with(path: &Path, magic: &[u8]) -> std::io::Result<bool> {
    let mut begin = Vec::new();
    File::open(path)?.take(magic.len() as u64).read_to_end(&mut begin)?;
    Ok(begin == magic)
}

/// The attached cell of a recording and its calibration, as they were in the run.
pub fn attached_cell(
    recording: &Recording,
    purpose: Purpose,
) -> anyhow::Result<(Cell, Calibration)> {
    let file = recording.file();
    let Some(text) = recording.cell() else {
        refuse!("{file}: the attachment cell.toml is missing");
    };
    let name = format!("cell.toml in {file}");
    let mut cell = Cell::parse(Path::new(&name), text, purpose)?;
    if recording.run().is_some_and(|run| run.is_live) {
        cell = cell.live();
    }
    let calibration = match &cell.calibration {
        CalibrationSource::Scale { mm_per_px, sigma } => {
            Calibration::Scale { mm_per_px: *mm_per_px, sigma: *sigma }
        }
        CalibrationSource::File(_) => {
            let text = recording
                .calibration()
                .ok_or_else(|| wrong!("{file}: its calibration is not attached"))?;
            file::parse(&format!("the calibration in {file}"), text)?
        }
    };
    Ok((cell, calibration))
}
