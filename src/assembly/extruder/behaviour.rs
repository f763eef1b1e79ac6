//! The model of a cell's extruder: from a file, or a screw that carries the same volume with every
//! turn.

use crate::assembly::error::AssemblyError;
use crate::cell::extruder::{FeedforwardKeys, ModelSource};
use crate::cell::file::ExtruderPart;
use crate::core::{Rpm, Unit};
use crate::extruder::feedforward::ScrewSpeed;
use crate::extruder::rheology::DragFlow;
use crate::extruder::strategy::OperatingPoint;
use crate::identify::model_file as model;
use crate::io::bead_columns::COMMAND;
use crate::io::recorder::ExtruderFile;
use crate::numeric::lti::TransferFunction;

/// Message for a strategy without its file.
pub(super) const WITHOUT_FILE: &str = "found a strategy without its file";

/// A linear model of an extruder about an operating point.
#[derive(Debug, Clone, PartialEq)]
pub struct Behaviour {
    /// From the cell's command to mm³/s.
    pub transfer: TransferFunction,
    /// Command and flow about which it holds.
    pub operating_point: OperatingPoint,
}

/// The model of a cell's extruder about its operating point, from the command to mm³/s.
pub fn behaviour(
    keys: &FeedforwardKeys,
    part: &ExtruderPart,
    cell: &str,
    file: Option<&ExtruderFile>,
) -> Result<Behaviour, AssemblyError> {
    match (&keys.model, file) {
        (ModelSource::Screw(screw), _) => drag_flow_behaviour(*screw),
        (_, Some(file)) => model_behaviour(keys, part, cell, file),
        (_, None) => Err(extruder_error(cell, WITHOUT_FILE)),
    }
}

/// An error about `[extruder]` of a cell.
pub(super) fn extruder_error(cell: &str, what: &str) -> AssemblyError {
    AssemblyError::unfit(format!("{cell}: [extruder]: {what}"))
}

/// An error about a file of the extruder.
pub(super) fn wrong_file(file: &ExtruderFile, what: &str) -> AssemblyError {
    AssemblyError::unfit(format!("{}: {what}", file.source))
}

/// A screw that carries the same volume with every turn, as a model from rpm to
/// mm³/s.
fn drag_flow_behaviour(screw: DragFlow) -> Result<Behaviour, AssemblyError> {
    let one = screw.flow(Rpm::constant(1.0))?;
    Ok(Behaviour {
        transfer: TransferFunction::gain(one.get())?,
        operating_point: OperatingPoint::default(),
    })
}

/// The model of a file, from the cell's command to mm³/s.
fn model_behaviour(
    keys: &FeedforwardKeys,
    part: &ExtruderPart,
    cell: &str,
    file: &ExtruderFile,
) -> Result<Behaviour, AssemblyError> {
    let model = model::parse(&file.source, &file.text)?;
    let (unit, flow) = (part.extruder.drive.unit(), Unit::Mm3PerS);
    if model.input.unit != unit || model.output.unit != flow {
        let what = format!(
            "found a model from {} to {}, expected one from {unit} to {flow}",
            model.input, model.output
        );
        return Err(extruder_error(cell, &what));
    }
    let gain = model.transfer.dc_gain();
    if gain < 0.0 {
        let what = format!(
            "found a model with a gain of {gain:.4}, less flow from more {unit}; expected one \
             above 0: look at the sign of a column"
        );
        return Err(extruder_error(cell, &what));
    }
    if keys.predicted_from == ScrewSpeed::Measured && model.input.name == COMMAND {
        let what = "found a model whose input was the command, expected one of the screw as it \
                    was measured (identify --input screw_rpm) for predicted_from = \"encoder\"";
        return Err(extruder_error(cell, what));
    }
    let (command, flow_mm3_per_s) = model.operating_point;
    let about = OperatingPoint { command, flow_mm3_per_s };
    Ok(Behaviour { transfer: model.transfer, operating_point: about })
}
