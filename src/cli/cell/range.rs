//! Whether a cell uses a model where it was identified.

use crate::cli::cell::ExtruderSide;
use crate::config::cell::ExtruderPart;
use crate::config::extruder::Strategy;
use crate::identify::file as model;

/// What to say where the command that the model has for the wanted flow lies
/// outside the inputs that it was identified with; none where it lies within
/// them, and where the strategy has no model.
pub fn beyond_model(part: &ExtruderPart, side: &ExtruderSide) -> anyhow::Result<Option<String>> {
    let (Strategy::Feedforward(_), Some(file)) = (&part.extruder.strategy, &side.file) else {
        return Ok(None);
    };
    let model = model::parse(&file.source, &file.text)?;
    let flow = part.demand.nominal().get();
    let (input, output) = model.operating_point;
    let command = input + (flow - output) / model.transfer.dc_gain();
    let (low, high) = model.input_range;
    let unit = part.extruder.drive.unit_word();
    let (min, max) = part.extruder.limits.range();
    if !(min..=max).contains(&command) {
        return Ok(Some(format!(
            "{}: {flow:.1} mm³/s take {command:.4} {unit}, but [extruder] allows {min} to {max} \
             {unit}; the bead will not have its flow",
            file.source
        )));
    }
    Ok((!(low..=high).contains(&command)).then(|| {
        format!(
            "{}: {flow:.1} mm³/s take {command:.4} {unit}, but it was identified from {low} to \
             {high} {unit}; what it says there is a guess",
            file.source
        )
    }))
}
