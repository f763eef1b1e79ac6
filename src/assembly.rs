//! Loading a cell with all that it refers to.

mod error;
pub mod extruder;
mod range;
mod side;

pub use error::AssemblyError;
pub use range::{range_warning, steady_state};
pub use side::{ExtruderSide, SimulatedSide};

use extruder::ExtruderFiles;

use std::fs;
use std::path::{Path, PathBuf};

use crate::calibration::{Calibration, SurfaceMap};
use crate::cell::Cell;
use crate::cell::file::{CalibrationSource, ExtruderPart, Purpose};
use crate::core::Mm;
use crate::document::Problems;
use crate::drivers::Devices;
use crate::io::calibration_file;
use crate::sim::cell::CommandedExtruder;
use crate::sim::extruder::SimExtruder;

/// Reads a cell and the devices that it chooses from a file's text. `path` is its name in messages;
/// relative paths start from its folder.
pub fn read_cell(path: &Path, text: &str, purpose: Purpose) -> Result<(Cell, Devices), Problems> {
    let mut devices = Devices::default();
    let cell = Cell::parse_with(path, text, purpose, &mut devices)?;
    Ok((cell, devices))
}

/// A cell, its calibration, and their texts for the recording.
#[derive(Debug, Clone)]
pub struct LoadedCell {
    /// The file as the command named it.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// Its content.
    pub cell: Cell,
    /// The devices that it chooses.
    pub devices: Devices,
    /// Its calibration.
    pub calibration: Calibration,
    /// The calibration file's text, where there is one.
    pub calibration_text: Option<String>,
}

impl LoadedCell {
    /// Reads a cell file and its calibration. Everything that is wrong with a
    /// file is reported at once.
    pub fn read(path: &Path, purpose: Purpose) -> Result<Self, AssemblyError> {
        let text = fs::read_to_string(path).map_err(|error| {
            AssemblyError::unfit(format!("cell file {}: {error}", path.display()))
        })?;
        Self::from_text(path, text, purpose)
    }

    /// [`Self::read`] for a text that was read already. `path` is its name in messages; relative
    /// paths start from its folder.
    pub fn from_text(path: &Path, text: String, purpose: Purpose) -> Result<Self, AssemblyError> {
        let (cell, devices) = read_cell(path, &text, purpose)?;
        let (calibration, calibration_text) = match &cell.calibration {
            CalibrationSource::Scale { mm_per_px, sigma } => {
                (Calibration::Scale { mm_per_px: *mm_per_px, sigma: *sigma }, None)
            }
            CalibrationSource::File(file) => {
                let calibration = calibration_file::read(file).map_err(|source| {
                    AssemblyError::Calibration { cell: path.to_owned(), source }
                })?;
                let text = fs::read_to_string(file)
                    .map_err(|source| AssemblyError::Unreadable { file: file.clone(), source })?;
                (calibration, Some(text))
            }
        };
        let path = path.to_owned();
        let loaded = Self { path, text, cell, devices, calibration, calibration_text };
        loaded.check_camera_offset()?;
        Ok(loaded)
    }

    /// Refuses control by distance with a camera that sees bead which is not laid yet.
    pub fn check_camera_offset(&self) -> Result<(), AssemblyError> {
        let Some(run) = &self.cell.run else { return Ok(()) };
        let half = self.cell.gauge_length(&self.calibration) * 0.5;
        let offset = run.camera.offset;
        if offset >= half || !run.control.strategy.sees_only_laid_bead() {
            return Ok(());
        }
        Err(AssemblyError::unfit(format!(
            "{}: camera.offset_mm: found {}, expected {:.1} or more with strategy = \"distance\": that \
             is half the length of bead within the gauge, and the camera must look at bead that is laid",
            self.path.display(),
            offset.get(),
            half.get()
        )))
    }

    /// The extruder side of the controller; `None` where the cell has none. Reads the files that
    /// the cell names for it.
    pub fn extruder(&self) -> Result<Option<ExtruderSide>, AssemblyError> {
        let Some(run) = &self.cell.run else { return Ok(None) };
        let Some(part) = &run.extruder else { return Ok(None) };
        let cell = self.path.display().to_string();
        let ExtruderFiles { files, warnings } = extruder::files(part, &cell)?;
        let setup = extruder::setup(run, part, &cell, &files)?;
        Ok(Some(ExtruderSide { setup, files, warnings }))
    }

    /// The extruder's plant in a simulated cell; fails where the cell has none.
    pub fn plant(&self, part: &ExtruderPart) -> Result<SimExtruder, AssemblyError> {
        let Some(plant) = &part.plant else {
            return Err(AssemblyError::unfit(format!(
                "{}: [extruder_plant]: found nothing, expected what answers the extruder's \
                 commands in a simulated cell",
                self.path.display()
            )));
        };
        Ok(SimExtruder::of(plant, self.cell.simulation.seed, part.plant_nominal)?)
    }

    /// The extruder side of a simulated cell; `None` where the cell has none.
    pub fn simulated_extruder(&self) -> Result<Option<SimulatedSide>, AssemblyError> {
        let part = self.cell.run.as_ref().and_then(|run| run.extruder.as_ref());
        let Some(part) = part else { return Ok(None) };
        let plant = self.plant(part)?;
        let Some(side) = self.extruder()? else { return Ok(None) };
        let range_warning = range_warning(part, &side)?;
        let warnings = side.warnings.into_iter().chain(range_warning).collect();
        let (demand, nominal_flow) = (part.demand, part.plant_nominal);
        let extruder = CommandedExtruder { setup: side.setup, demand, plant, nominal_flow };
        Ok(Some(SimulatedSide { extruder, warnings }))
    }

    /// The map of the measured surface, for the cell's camera mount and the robot's current z.
    pub fn surface(&self, robot_z: Option<Mm>) -> SurfaceMap {
        self.cell.surface(&self.calibration, robot_z)
    }

    /// Calibration and height in words, for the head of a report.
    pub fn calibration_words(&self) -> String {
        match &self.cell.calibration {
            CalibrationSource::Scale { mm_per_px, sigma: Some(sigma) } => {
                format!("{mm_per_px} ± {sigma} mm/px at the surface")
            }
            CalibrationSource::Scale { mm_per_px, sigma: None } => {
                format!("{mm_per_px} mm/px at the surface")
            }
            CalibrationSource::File(file) => {
                let (height, sigma) = (self.cell.surface_height, self.cell.surface_height_sigma);
                let sigma = if sigma > Mm::ZERO { format!(" ± {sigma}") } else { String::new() };
                format!("{}, surface {height}{sigma} above the bed", file.display())
            }
        }
    }
}
