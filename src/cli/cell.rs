//! Loading a cell with all that it refers to.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::WrongArguments;
use crate::calib::{Calibration, SurfaceMap};
use crate::config::Cell;
use crate::config::cell::{CalibrationSource, ExtruderPart, Purpose};
use crate::config::extruder::{FeedforwardKeys, ModelSource, Strategy};
use crate::extruder::Law;
use crate::extruder::feedforward::{Inverse, InverseSettings};
use crate::extruder::law::{
    AdaptiveNozzle, Constant, Foreseen, OperatingPoint, Played, PressureLoop, ScrewFill,
};
use crate::identify::profile;
use crate::identify::quantity::Unit;
use crate::io::{calibration_file, model_file};
use crate::sim::cell::Rig;
use crate::sim::extruder::SimExtruder;
use crate::time::Span;
use crate::units::Mm;

/// A cell, its calibration, and their texts for the recording.
#[derive(Debug, Clone)]
pub struct LoadedCell {
    /// The file as the command named it.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// What stands in it.
    pub cell: Cell,
    /// What a pixel means in it.
    pub calibration: Calibration,
    /// The calibration file's text, where there is one.
    pub calibration_text: Option<String>,
}

impl LoadedCell {
    /// Reads a cell file and its calibration. Everything that is wrong with a
    /// file is reported at once.
    pub fn read(path: &Path, purpose: Purpose) -> anyhow::Result<Self> {
        let text = fs::read_to_string(path).map_err(|error| {
            WrongArguments::new(format!("cell file {}: {error}", path.display()))
        })?;
        Self::from_text(path, text, purpose)
    }

    /// The same, for a text that is there already; `path` is what messages
    /// call it and where relative paths start.
    pub fn from_text(path: &Path, text: String, purpose: Purpose) -> anyhow::Result<Self> {
        let cell = Cell::parse(path, &text, purpose)?;
        let (calibration, calibration_text) = match &cell.calibration {
            CalibrationSource::Scale { mm_per_px, sigma } => {
                (Calibration::Scale { mm_per_px: *mm_per_px, sigma: *sigma }, None)
            }
            CalibrationSource::File(file) => {
                let calibration = calibration_file::read(file)?;
                let text = fs::read_to_string(file)
                    .with_context(|| format!("calibration file {}", file.display()))?;
                (calibration, Some(text))
            }
        };
        Ok(Self { path: path.to_owned(), text, cell, calibration, calibration_text })
    }

    /// The extruder side as a simulated cell has it; none where the cell has
    /// none. Reads the files that the cell names for it.
    pub fn simulated_extruder(&self) -> anyhow::Result<Option<Rig>> {
        let part = self.cell.run.as_ref().and_then(|run| run.extruder.as_ref());
        let Some(part) = part else { return Ok(None) };
        let Some(plant) = &part.plant else {
            return Err(WrongArguments::new(format!(
                "{}: [extruder_plant]: found nothing, expected what answers the extruder's \
                 commands in a simulated cell",
                self.path.display()
            ))
            .into());
        };
        let law = match &part.extruder.strategy {
            Strategy::Constant { value } => Law::Constant(Constant(*value)),
            Strategy::Profile { file } => Law::Profile(read_profile(file, part)?),
            Strategy::Feedforward(keys) => Law::Feedforward(self.foreseen(keys, part)?),
            Strategy::Pressure(settings) => Law::Pressure(PressureLoop::new(**settings)),
            Strategy::Screw(settings) => Law::Screw(ScrewFill::new(settings)?),
            Strategy::Adaptive(parts) => Law::Adaptive(AdaptiveNozzle::new(parts.0, parts.1)),
        };
        let seed = self.cell.simulation.seed;
        Ok(Some(Rig {
            setup: part.extruder.setup(law),
            demand: part.demand,
            plant: SimExtruder::of(plant, seed)?,
            nominal_flow: part.plant_nominal,
        }))
    }

    /// The inverse of the model that the cell names.
    fn foreseen(&self, keys: &FeedforwardKeys, part: &ExtruderPart) -> anyhow::Result<Foreseen> {
        let wrong = |what: String| {
            WrongArguments::new(format!("{}: [extruder]: {what}", self.path.display()))
        };
        let model = match &keys.model {
            ModelSource::File(file) => model_file::read(file)?,
            ModelSource::Library { folder, wanted } => {
                let library = model_file::read_library(folder)?;
                let found = library.find(wanted).map_err(|error| wrong(error.to_string()))?;
                tracing::info!(model = found.entry.name, off_c = found.off_c, "model of the cell");
                found.entry.model.clone()
            }
        };
        let extruder = &part.extruder;
        let (unit, flow) = (extruder.drive.unit(), Unit::Mm3PerS);
        if model.input.unit != unit || model.output.unit != flow {
            return Err(wrong(format!(
                "found a model from {} to {}, expected one from {unit} to {flow}",
                model.input, model.output
            ))
            .into());
        }
        let (command, flow_mm3_per_s) = model.operating_point;
        let settings = InverseSettings {
            time_constant_s: keys.time_constant_s,
            right_zeros: keys.right_zeros,
            known_ahead: Span::ZERO,
            late: keys.late,
            limits: extruder.limits.about(command),
            period: Span::from_secs(1.0 / extruder.rates.feedforward_hz),
        };
        let inverse =
            Inverse::new(&model.transfer, &settings).map_err(|error| wrong(error.to_string()))?;
        Ok(Foreseen::new(inverse, OperatingPoint { command, flow_mm3_per_s }))
    }

    /// The map of the measured surface, for a camera that rides as the cell
    /// says, at the robot's present z.
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

/// A profile of commands; one of another quantity, or beyond the limits, is
/// refused before anything moves.
fn read_profile(file: &Path, part: &ExtruderPart) -> anyhow::Result<Played> {
    let wrong = |what: String| WrongArguments::new(format!("profile {}: {what}", file.display()));
    let text = fs::read_to_string(file).map_err(|error| wrong(error.to_string()))?;
    let (profile, quantity) =
        profile::file::parse(&text).map_err(|error| wrong(error.to_string()))?;
    let unit = part.extruder.drive.unit();
    if quantity.unit != unit {
        return Err(wrong(format!(
            "found {quantity}, expected a quantity in {unit}, the command of [extruder]"
        ))
        .into());
    }
    let ((low, high), (min, max)) = (profile.range(), part.extruder.limits.range());
    if low < min || high > max {
        return Err(wrong(format!(
            "found commands from {low} to {high} {unit}, expected {min} to {max}, the limits \
             of [extruder]"
        ))
        .into());
    }
    Ok(Played::new(profile))
}
