//! `widths.csv`: one row for every frame, written as the frames come.

use std::path::{Path, PathBuf};

use super::frame_row::{ControlColumns, FrameRow};
use super::names;
use super::output::{LogError, Partial};
use crate::vision::{Roughness, WidthMeasurement};

/// Columns of every file; the first nine are promised to other programs.
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

/// Further columns of a run with a controller.
pub const CONTROL_COLUMNS: [&str; 7] = [
    "bead_path_mm",
    "nozzle_path_mm",
    "speed_mm_per_s",
    "setpoint_mm_per_s",
    "state",
    "limit",
    "target_mm",
];

/// Rows after which the file is flushed where no time tells sooner.
const FLUSH_ROWS: u32 = 50;
const FLUSH_AFTER_S: f64 = 1.0;

/// Writes `widths.csv.partial`, which a killed run leaves with all but its
/// last second, and renames it at the end.
#[derive(Debug)]
pub struct WidthsWriter {
    csv: csv::Writer<Partial>,
    path: PathBuf,
    with_control: bool,
    unflushed: u32,
    flushed_at_s: Option<f64>,
}

impl WidthsWriter {
    /// Begins the file in a folder that is there. `with_control` adds the
    /// columns of a run.
    pub fn create(folder: &Path, with_control: bool) -> Result<Self, LogError> {
        let partial = Partial::create(folder, "widths.csv")?;
        let mut writer = Self {
            csv: csv::Writer::from_writer(partial),
            path: folder.join("widths.csv.partial"),
            with_control,
            unflushed: 0,
            flushed_at_s: None,
        };
        let control: &[&str] = if with_control { &CONTROL_COLUMNS } else { &[] };
        let written = writer.csv.write_record(WIDTH_COLUMNS.iter().chain(control));
        written.map_err(|error| writer.error(error.into()))?;
        writer.flush()?;
        Ok(writer)
    }

    /// Adds a row.
    pub fn write(&mut self, row: &FrameRow) -> Result<(), LogError> {
        let written = self.write_fields(row);
        written.map_err(|error| self.error(error.into()))?;
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

    /// Gives the file its final name, which it returns.
    pub fn finish(mut self) -> Result<PathBuf, LogError> {
        self.flush()?;
        let path = self.path;
        let partial = self
            .csv
            .into_inner()
            .map_err(|error| LogError::Write { path, source: error.into_error() })?;
        partial.finish()
    }

    fn write_fields(&mut self, row: &FrameRow) -> Result<(), csv::Error> {
        self.csv.write_field(row.frame.to_string())?;
        self.csv.write_field(decimals(row.time_s, 9))?;
        match &row.outcome {
            Ok(measured) => {
                self.csv.write_field("ok")?;
                for field in measured_fields(measured, row.roughness) {
                    self.csv.write_field(field)?;
                }
            }
            Err(status) => {
                self.csv.write_field(status)?;
                for _ in 3..WIDTH_COLUMNS.len() {
                    self.csv.write_field("")?;
                }
            }
        }
        if self.with_control {
            for field in control_fields(row.control.as_ref().filter(|_| row.outcome.is_ok())) {
                self.csv.write_field(field)?;
            }
        }
        self.csv.write_record(None::<&[u8]>)
    }

    fn flush(&mut self) -> Result<(), LogError> {
        self.unflushed = 0;
        self.csv.flush().map_err(|error| self.error(error))
    }

    fn error(&self, source: std::io::Error) -> LogError {
        LogError::Write { path: self.path.clone(), source }
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
        names::limit(control.limit).to_string(),
        decimals(control.target.map(f64::from), 6),
    ]
}

/// A number with fixed decimals; empty where it is unknown or not finite.
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
