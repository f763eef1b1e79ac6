//! The strategy of an extruder from its cell and the file that the cell names:
//! from the disk for a run, from the recording for a replay.

mod behaviour;
mod job;
mod starts;

use std::fs;

pub use behaviour::{Behaviour, behaviour};
use behaviour::{WITHOUT_FILE, extruder_error, wrong_file};

use super::error::AssemblyError;
use crate::cell::extruder::{ExtruderSettings, FeedforwardKeys, ModelSource, Strategy};
use crate::cell::file::{ExtruderPart, RunPart};
use crate::core::Span;
use crate::extruder::feedforward::{
    ExtruderModel, FeedforwardError, FlowForecast, InverseSettings, ScrewSpeed, Tracker,
};
use crate::extruder::strategy::{
    AdaptiveNozzle, ConstantCommand, InverseFeedforward, Playback, PressureLoop, ScrewFill,
};
use crate::extruder::{ExtruderSetup, ExtruderStrategy};
use crate::identify::command_profile;
use crate::io::model_file;
use crate::io::recorder::ExtruderFile;
use crate::io::recorder::format::{
    MODEL_ATTACHMENT, PLAN_ATTACHMENT, PROFILE_ATTACHMENT, STARTS_ATTACHMENT,
};
use crate::numeric::lti::TransferFunction;

/// Names in a recording of the files that an extruder side is made from.
pub fn attachments(extruder: &ExtruderSettings) -> Vec<&'static str> {
    let starts = extruder.starts.as_ref().map(|_| STARTS_ATTACHMENT);
    let plan = extruder.plan.as_ref().map(|_| PLAN_ATTACHMENT);
    [attachment(&extruder.strategy), starts, plan].into_iter().flatten().collect()
}

/// Name of the strategy's file in a recording; `None` for a strategy without a file.
fn attachment(strategy: &Strategy) -> Option<&'static str> {
    match strategy {
        Strategy::Profile { .. } => Some(PROFILE_ATTACHMENT),
        Strategy::Feedforward(FeedforwardKeys { model: ModelSource::Screw(_), .. }) => None,
        Strategy::Feedforward(_) => Some(MODEL_ATTACHMENT),
        _ => None,
    }
}

/// The file of the strategy among those of an extruder side.
pub fn file_of_strategy(files: &[ExtruderFile]) -> Option<&ExtruderFile> {
    files.iter().find(|file| [MODEL_ATTACHMENT, PROFILE_ATTACHMENT].contains(&file.name))
}

/// The files that a cell names for its extruder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExtruderFiles {
    /// The files that the extruder side is made from.
    pub files: Vec<ExtruderFile>,
    /// Warnings about them.
    pub warnings: Vec<String>,
}

/// Reads the files that the cell names for its extruder. `cell` is the cell's name in messages.
pub fn files(part: &ExtruderPart, cell: &str) -> Result<ExtruderFiles, AssemblyError> {
    let mut warnings = Vec::new();
    let file = strategy_file(part, cell, &mut warnings)?;
    let mut files: Vec<ExtruderFile> = file.into_iter().collect();
    for (name, what, makes, path) in [
        (STARTS_ATTACHMENT, "starts", "extruder starts", &part.extruder.starts),
        (PLAN_ATTACHMENT, "plan", "plan", &part.extruder.plan),
    ] {
        let Some(path) = path else { continue };
        let source = format!("{what} {}", path.display());
        let text = fs::read_to_string(path).map_err(|error| {
            AssemblyError::unfit(format!("{source}: {error}; `truebead {makes}` makes one"))
        })?;
        files.push(ExtruderFile { name, source, text });
    }
    Ok(ExtruderFiles { files, warnings })
}

/// Reads the file that the cell names for its strategy; from a library, the model that matches.
/// `cell` is the cell's name in messages; `warnings` gets warnings about the file.
pub fn strategy_file(
    part: &ExtruderPart,
    cell: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<ExtruderFile>, AssemblyError> {
    let strategy = &part.extruder.strategy;
    let Some(name) = attachment(strategy) else { return Ok(None) };
    let (path, what) = match strategy {
        Strategy::Profile { file } => (file.clone(), "profile"),
        Strategy::Feedforward(FeedforwardKeys { model: ModelSource::File(file), .. }) => {
            // Its error says what to do where there is no file.
            model_file::read(file)?;
            (file.clone(), "model")
        }
        Strategy::Feedforward(FeedforwardKeys {
            model: ModelSource::Library { folder, wanted },
            ..
        }) => {
            let read = model_file::read_library(folder)?;
            let broken = read.broken.iter();
            warnings.extend(broken.map(|broken| format!("this model is not looked at: {broken}")));
            let found = read
                .library
                .find(wanted)
                .map_err(|error| extruder_error(cell, &error.to_string()))?;
            tracing::info!(
                model = found.entry.name,
                off_c = found.temperature_difference_c,
                "model of the cell"
            );
            (folder.join(&found.entry.name), "model")
        }
        _ => return Ok(None),
    };
    let source = format!("{what} {}", path.display());
    let text = fs::read_to_string(&path)
        .map_err(|error| AssemblyError::unfit(format!("{source}: {error}")))?;
    Ok(Some(ExtruderFile { name, source, text }))
}

/// The setup of the extruder side, from the cell and the files that it names. `cell` is the cell's
/// name in messages.
pub fn setup(
    run: &RunPart,
    part: &ExtruderPart,
    cell: &str,
    files: &[ExtruderFile],
) -> Result<ExtruderSetup, AssemblyError> {
    let file = file_of_strategy(files);
    let needed = || file.ok_or_else(|| extruder_error(cell, WITHOUT_FILE));
    let strategy = match &part.extruder.strategy {
        Strategy::Constant { value } => ExtruderStrategy::Constant(ConstantCommand(*value)),
        Strategy::Profile { .. } => ExtruderStrategy::Profile(playback(needed()?, part)?),
        Strategy::Feedforward(keys) => {
            let behaviour = behaviour(keys, part, cell, file)?;
            ExtruderStrategy::Feedforward(Box::new(inverse_feedforward(
                keys, run, part, cell, behaviour,
            )?))
        }
        Strategy::Pressure(settings) => {
            ExtruderStrategy::Pressure(Box::new(PressureLoop::new(**settings)))
        }
        Strategy::Screw(settings) => ExtruderStrategy::Screw(ScrewFill::new(settings)?),
        Strategy::Adaptive(settings) => {
            ExtruderStrategy::Adaptive(AdaptiveNozzle::new(settings.controller, settings.nozzle))
        }
    };
    let named = |name| files.iter().find(|file| file.name == name);
    let plan = named(PLAN_ATTACHMENT).map(|file| job::plan(run, part, file)).transpose()?;
    let starts = named(STARTS_ATTACHMENT);
    let timing = starts.map(|file| starts::timing(run, part, file)).transpose()?;
    if let Some(timing) = &timing {
        starts::check_bead_length(run, plan.as_deref(), timing, cell)?;
    }
    Ok(ExtruderSetup { timing, plan, ..part.extruder.setup(strategy) })
}

/// The inverse of the extruder's model about its operating point.
fn inverse_feedforward(
    keys: &FeedforwardKeys,
    run: &RunPart,
    part: &ExtruderPart,
    cell: &str,
    behaviour: Behaviour,
) -> Result<InverseFeedforward, AssemblyError> {
    let Behaviour { transfer, operating_point: about } = behaviour;
    let extruder = &part.extruder;
    let settings = InverseSettings {
        time_constant_s: keys.time_constant_s,
        right_zeros: keys.right_zeros,
        preview: Span::ZERO,
        max_delay: keys.max_delay,
        limits: extruder.limits.about(about.command),
        period: Span::from_secs(1.0 / extruder.rates.feedforward_hz),
    };
    let tracker = Tracker::new(&transfer, &settings)
        .map_err(|error| extruder_error(cell, &error.to_string()))?;
    let controller = InverseFeedforward::new(tracker, about);
    let forecast = forecast(transfer, keys.predicted_from, run.robot.rate_hz, settings.period)
        .map_err(|error| extruder_error(cell, &error.to_string()))?;
    Ok(controller.with_forecast(forecast))
}

/// Forecast of the flow half a setpoint period of the robot ahead, at most the dead time.
fn forecast(
    model: TransferFunction,
    screw: ScrewSpeed,
    robot_rate_hz: f64,
    period: Span,
) -> Result<FlowForecast, FeedforwardError> {
    let ahead = Span::from_secs(model.dead_time_s().min(0.5 / robot_rate_hz));
    let model = ExtruderModel { drive: TransferFunction::gain(1.0)?, flow: model };
    FlowForecast::new(&model, screw, ahead, period)
}

/// A profile of commands; one of another quantity, or beyond the limits, is
/// refused before anything moves.
fn playback(file: &ExtruderFile, part: &ExtruderPart) -> Result<Playback, AssemblyError> {
    let wrong = |what: String| wrong_file(file, &what);
    let (profile, quantity) =
        command_profile::file::parse(&file.text).map_err(|error| wrong(error.to_string()))?;
    let unit = part.extruder.drive.unit();
    if quantity.unit != unit {
        return Err(wrong(format!(
            "found {quantity}, expected a quantity in {unit}, the command of [extruder]"
        )));
    }
    let ((low, high), (min, max)) = (profile.range(), part.extruder.limits.range());
    if low < min || high > max {
        return Err(wrong(format!(
            "found commands from {low} to {high} {unit}, expected {min} to {max}, the limits \
             of [extruder]"
        )));
    }
    Ok(Playback::new(profile))
}
