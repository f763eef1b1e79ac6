//! Starts and stops of an extruder from logged data, as text and as a page.

mod page;
mod text;

pub use page::page;
pub use text::text;

use crate::core::Quantity;
use crate::identify::digits::three_digits;
use crate::identify::model_file::Conditions;
use crate::identify::series::TimeSeries;
use crate::identify::start_stop::file::{
    ParameterKey, START_PARAMETERS, STOP_PARAMETERS, StartStopFile,
};
use crate::identify::start_stop::{StartStopFit, StartStopFitError, fit};

/// A standard error above this fraction of a parameter is reported.
const LOOSE_FRACTION: f64 = 0.3;
/// With fewer starts a standard deviation is hardly determined. Derived: its own relative error
/// is 1/√(2(n − 1)) = 0.27 for n = 8.
const FEW_STARTS: usize = 8;

/// Logged data with their names.
#[derive(Debug, Clone)]
pub struct StartLogs {
    /// The data's source.
    pub source: String,
    /// The extruder's command.
    pub input: Quantity,
    /// The flow, as it was logged.
    pub output: Quantity,
    /// The command, in its own unit.
    pub command: TimeSeries,
    /// The flow \[mm³/s\].
    pub flow: TimeSeries,
}

/// Starts and stops with their warnings.
#[derive(Debug)]
pub struct StartStudy {
    /// The data.
    pub logs: StartLogs,
    /// The parameters, and what they were found from.
    pub fit: StartStopFit,
    /// The same as a file keeps it.
    pub file: StartStopFile,
    /// Warnings before they are used.
    pub warnings: Vec<String>,
}

/// Fits starts and stops. Fails where the data do not determine them.
pub fn study(logs: StartLogs, setting: Conditions) -> Result<StartStudy, StartStopFitError> {
    let fit = fit(&logs.command, &logs.flow)?;
    let file = StartStopFile::of(&fit, setting);
    let warnings = all_warnings(&fit);
    Ok(StartStudy { logs, fit, file, warnings })
}

fn all_warnings(fit: &StartStopFit) -> Vec<String> {
    let mut warnings = Vec::new();
    if fit.starts.len() < FEW_STARTS {
        warnings.push(format!(
            "{} starts leave the standard errors themselves uncertain; {FEW_STARTS} or more determine \
             them",
            fit.starts.len()
        ));
    }
    let loose =
        |one: &&ParameterKey| (one.of)(&fit.sigma) > LOOSE_FRACTION * (one.of)(&fit.parameters);
    for one in START_PARAMETERS.iter().chain(&STOP_PARAMETERS).filter(loose) {
        warnings.push(format!(
            "{} is {} ± {} {}: hardly known; more {} of the same kind determine it",
            one.key,
            three_digits((one.of)(&fit.parameters)),
            three_digits((one.of)(&fit.sigma)),
            one.unit,
            if STOP_PARAMETERS.iter().any(|stop| stop.key == one.key) { "stops" } else { "starts" }
        ));
    }
    warnings
}

impl StartStudy {
    /// Starts without information: the first one, whose pause began before the record, and those
    /// without an even flow after them.
    pub const fn left_out(&self) -> usize {
        self.fit.runs.saturating_sub(self.fit.starts.len())
    }

    /// The flow for which delays are given \[mm³/s\].
    pub fn flow_mm3_per_s(&self) -> f64 {
        let [low, high] = self.file.data.flow_range_mm3_per_s;
        f64::midpoint(low, high)
    }
}
