//! The cell that a recording was made with, from what is attached to it.

use std::path::Path;

use super::arguments::WrongArguments;
use crate::calibration::{Calibration, file};
use crate::cell::Cell;
use crate::cell::file::{CalibrationSource, Purpose};
use crate::io::recording::Recording;

/// The cell of a recording and its calibration, as they were in the run.
pub fn attached_cell(
    recording: &Recording,
    purpose: Purpose,
) -> anyhow::Result<(Cell, Calibration)> {
    let file = recording.file();
    let Some(text) = recording.cell() else {
        let what = format!("{file}: the attachment cell.toml is missing");
        return Err(WrongArguments::new(what).into());
    };
    let name = format!("cell.toml in {file}");
    let cell = Cell::parse(Path::new(&name), text, purpose)?;
    let calibration = match &cell.calibration {
        CalibrationSource::Scale { mm_per_px, sigma } => {
            Calibration::Scale { mm_per_px: *mm_per_px, sigma: *sigma }
        }
        CalibrationSource::File(_) => {
            let text = recording.calibration().ok_or_else(|| {
                let what = format!("{file}: its calibration is not attached");
                WrongArguments::new(what)
            })?;
            file::parse(&format!("the calibration in {file}"), text)?
        }
    };
    Ok((cell, calibration))
}
