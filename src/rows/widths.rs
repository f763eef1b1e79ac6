//! `widths.csv`: one row per frame, written as the frames come.

use std::path::{Path, PathBuf};

use super::frame_row::{ControlColumns, FrameRow};
use super::names;
use super::output::{LogError, PartialTable};
use crate::vision::{Roughness, WidthMeasurement};

/// Columns of every file; other programs may rely on the first nine.
pub const WIDTH_COLUMNS: [&str; 17] = [
    "frame",
    "time_s",
    "status",
    "width_mm",
    "sigma_mm",
    "left_x_px",
    "left_y_px",
    "right_x_px",
    "right_y_px",
    "roughness_mm",
    "roughness_length_mm",
    "slant_deg",
    "contrast_grey",
    "blur_px",
    "noise_grey",
    "saturated_share",
    "used_share",
];

/// Additional columns of a run with a controller.
pub const CONTROL_COLUMNS: [&str; 7] = [
    "bead_path_mm",
    "nozzle_path_mm",
    "speed_mm_per_s",
    "setpoint_mm_per_s",
    "state",
    "limit",
    "target_mm",
];

/// Number of rows after which the file is flushed if frames have no time.
const FLUSH_ROWS: u32 = 50;
/// Time after which the file is flushed \[s\]: a killed run loses at most this much.
const FLUSH_AFTER_S: f64 = 1.0;

/// Writes `widths.csv.partial` and renames it at the end. A killed run leaves the partial file
/// without its last second.
#[derive(Debug)]
pub struct WidthsWriter {
    table: PartialTable,
    with_control: bool,
    unflushed: u32,
    flushed_at_s: Option<f64>,
}

impl WidthsWriter {
    /// Begins the file in an existing folder. `with_control` adds the columns of a run with a
    /// controller.
    pub fn create(folder: &Path, with_control: bool) -> Result<Self, LogError> {
        let control: &[&str] = if with_control { &CONTROL_COLUMNS } else { &[] };
        let head = WIDTH_COLUMNS.iter().chain(control);
        let table = PartialTable::create(folder, "widths.csv", head)?;
        let mut writer = Self { table, with_control, unflushed: 0, flushed_at_s: None };
        writer.flush()?;
        Ok(writer)
    }

    /// Adds a row.
    pub fn write(&mut self, row: &FrameRow) -> Result<(), LogError> {
        self.table.row(self.fields(row))?;
        self.unflushed += 1;
        let since = row.time_s.zip(self.flushed_at_s).map(|(now, then)| now - then);
        if self.unflushed >= FLUSH_ROWS || since.is_some_and(|span| span >= FLUSH_AFTER_S) {
            self.flush()?;
            self.flushed_at_s = row.time_s;
        } else if self.flushed_at_s.is_none() {
            self.flushed_at_s = row.time_s;
        }
        Ok(())
    }

    /// Gives the file its final name; returns its path.
    pub fn finish(self) -> Result<PathBuf, LogError> {
        self.table.finish()
    }

    fn fields(&self, row: &FrameRow) -> Vec<String> {
        let status = row.outcome.as_ref().map_or_else(|status| *status, |_| "ok");
        let mut fields = vec![row.frame.to_string(), decimals(row.time_s, 9), status.to_owned()];
        let measured =
            row.outcome.as_ref().map(|measured| measured_fields(measured, row.roughness));
        fields.extend(measured.unwrap_or_default());
        if self.with_control {
            fields.extend(control_fields(row.control.as_ref().filter(|_| row.outcome.is_ok())));
        }
        fields
    }

    fn flush(&mut self) -> Result<(), LogError> {
        self.unflushed = 0;
        self.table.flush()
    }
}

fn measured_fields(measured: &WidthMeasurement, roughness: Option<Roughness>) -> [String; 14] {
    [
        Some(measured.width.get()),
        Some(measured.sigma.get()),
        Some(measured.left.x),
        Some(measured.left.y),
        Some(measured.right.x),
        Some(measured.right.y),
        roughness.map(|found| found.roughness.get()),
        roughness.map(|found| found.length.get()),
        Some(measured.slant_rad.to_degrees()),
        Some(measured.hints.contrast_grey),
        Some(measured.hints.blur_px),
        Some(measured.hints.noise_grey),
        Some(measured.hints.saturated_fraction),
        Some(measured.hints.used_fraction),
    ]
    .map(|value| decimals(value, 6))
}

fn control_fields(control: Option<&ControlColumns>) -> [String; 7] {
    let Some(control) = control else { return Default::default() };
    [
        decimals(control.measured_path.map(f64::from), 6),
        decimals(control.nozzle_path.map(f64::from), 6),
        decimals(control.speed.map(f64::from), 6),
        decimals(control.setpoint.map(f64::from), 6),
        control.state.to_string(),
        names::of(control.limit).to_owned(),
        decimals(control.target.map(f64::from), 6),
    ]
}

/// A number with fixed decimals and no negative zero; empty where it is unknown or not finite.
pub fn decimals(value: Option<f64>, places: usize) -> String {
    let Some(value) = value.filter(|value| value.is_finite()) else { return String::new() };
    let text = format!("{value:.places$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|byte| matches!(byte, b'0' | b'.')) => rest.to_string(),
        _ => text,
    }
}

#[cfg(test)]
mod tests;
