//! Warnings: a model that is used outside the range in which it was identified, and a profile that
//! is faster than the limits.

use super::error::AssemblyError;
use super::side::ExtruderSide;
use crate::cell::extruder::{ModelSource, Strategy};
use crate::cell::file::ExtruderPart;
use crate::core::MPa;
use crate::extruder::ExtruderStrategy;
use crate::extruder::strategy::Playback;
use crate::identify::command_profile::ProfilePoint;
use crate::identify::model_file as model;

/// Steady state of a strategy at the demanded flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyState {
    /// Command, in its unit.
    pub command: f64,
    /// Pressure at the nozzle, for a strategy that controls it.
    pub pressure: Option<MPa>,
}

/// Steady state at the demanded flow; `None` for a strategy that does not compute one.
pub fn steady_state(
    part: &ExtruderPart,
    side: &ExtruderSide,
) -> Result<Option<SteadyState>, AssemblyError> {
    let flow = part.demand.nominal();
    match &part.extruder.strategy {
        Strategy::Feedforward(keys) => {
            let command = match (&keys.model, side.file()) {
                (ModelSource::Screw(screw), _) => screw.speed(flow)?.get(),
                (_, Some(file)) => {
                    let model = model::parse(&file.source, &file.text)?;
                    let (input, output) = model.operating_point;
                    input + (flow.get() - output) / model.transfer.dc_gain()
                }
                (_, None) => return Ok(None),
            };
            Ok(Some(SteadyState { command, pressure: None }))
        }
        Strategy::Pressure(settings) => {
            let pressure = settings.nozzle.pressure(flow)?;
            let command = pressure.get() / settings.model.gain();
            Ok(Some(SteadyState { command, pressure: Some(pressure) }))
        }
        _ => Ok(None),
    }
}

/// A warning where the strategy exceeds the limits or the range of its model; `None` otherwise.
pub fn range_warning(
    part: &ExtruderPart,
    side: &ExtruderSide,
) -> Result<Option<String>, AssemblyError> {
    match &side.setup.strategy {
        ExtruderStrategy::Profile(played) => Ok(profile_warning(part, side, played)),
        _ => match steady_state(part, side)? {
            Some(SteadyState { pressure: Some(pressure), .. })
                if part.extruder.max_pressure.is_some_and(|most| pressure > most) =>
            {
                Ok(Some(format!(
                    "[extruder]: {:.1} mm³/s take {:.3} MPa at the nozzle, above max_pressure_mpa; \
                     the pump will be stopped",
                    part.demand.nominal().get(),
                    pressure.get()
                )))
            }
            Some(steady) => steady_warning(part, side, steady.command),
            None => Ok(None),
        },
    }
}

/// A warning where a steady command lies outside the limits, or outside the inputs with which its
/// model was identified.
fn steady_warning(
    part: &ExtruderPart,
    side: &ExtruderSide,
    command: f64,
) -> Result<Option<String>, AssemblyError> {
    let (flow, unit) = (part.demand.nominal().get(), part.extruder.drive.unit_word());
    let source = side.file().map_or("[extruder]", |file| file.source.as_str());
    let (min, max) = part.extruder.limits.range();
    if !(min..=max).contains(&command) {
        return Ok(Some(format!(
            "{source}: {flow:.1} mm³/s take {command:.4} {unit}, but [extruder] allows {min} to \
             {max} {unit}; the bead will not have its flow"
        )));
    }
    let Some(file) = side.file() else { return Ok(None) };
    let (low, high) = model::parse(&file.source, &file.text)?.input_range;
    Ok((!(low..=high).contains(&command)).then(|| {
        format!(
            "{source}: {flow:.1} mm³/s take {command:.4} {unit}, but it was identified from {low} \
             to {high} {unit}; what it says there is a guess"
        )
    }))
}

/// Two times that differ by less are the same \[s\].
const TIME_TOLERANCE_S: f64 = 1e-9;

/// A warning where the next value of a profile begins before the command has reached a value at the
/// rate limit. The first value is no change.
fn profile_warning(part: &ExtruderPart, side: &ExtruderSide, played: &Playback) -> Option<String> {
    let profile = played.profile();
    let rate = part.extruder.limits.rate_per_s();
    let ends = profile.points().iter().skip(2).map(|point| point.from_s);
    let steps = profile.points().windows(2).zip(ends.chain([profile.end_s()]));
    let (mut missed, mut first) = (0_usize, None);
    for (pair, until_s) in steps {
        let [before, ProfilePoint { from_s, value }] = pair else { continue };
        let takes_s = (value - before.value).abs() / rate;
        if takes_s > until_s - from_s + TIME_TOLERANCE_S {
            missed += 1;
            first.get_or_insert((*from_s, (value - before.value).abs(), takes_s, until_s - from_s));
        }
    }
    let (from_s, by, takes_s, has_s) = first?;
    let (unit, source) = (part.extruder.drive.unit_word(), side.file()?.source.as_str());
    Some(format!(
        "{source}: {missed} of its changes are not made to their end: that of {by:.4} {unit} at \
         {from_s:.2} s takes {takes_s:.3} s at max_{unit}_per_s = {rate}, and there are {has_s:.3} s \
         until the next one or the end"
    ))
}
