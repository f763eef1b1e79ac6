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

/// Relative standard error of a parameter above which it is reported.
const LOOSE_FRACTION: f64 = 0.3;
/// Number of starts below which a standard deviation is hardly determined. Derived: its own
/// relative error is 1/√(2(n − 1)) = 0.27 for n = 8.
const FEW_STARTS: usize = 8;

/// Logged data with their names.
#[derive(Debug, Clone)]
pub struct StartLogs {
    /// Where the data came from.
    pub source: String,
    /// The extruder's command.
    pub input: Quantity,
    /// The flow, in the quantity of the log.
    pub output: Quantity,
    /// The command, in its own unit.
    pub command: TimeSeries,
    /// The flow \[mm³/s\].
    pub flow: TimeSeries,
}

/// A start-stop model with its warnings.
#[derive(Debug)]
pub struct StartStudy {
    /// The data.
    pub logs: StartLogs,
    /// The fitted parameters, and the starts and stops in the data.
    pub fit: StartStopFit,
    /// The model in the form for a file.
    pub file: StartStopFile,
    /// Warnings for the user of the model.
    pub warnings: Vec<String>,
}

/// Fits a start-stop model. Fails if the data do not determine it.
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
    /// Number of starts that were not used: the first one, whose pause began before the record,
    /// and those without a steady flow after them.
    pub const fn left_out(&self) -> usize {
        self.fit.runs.saturating_sub(self.fit.starts.len())
    }

    /// The flow at which delays are given \[mm³/s\].
    pub fn flow_mm3_per_s(&self) -> f64 {
        let [low, high] = self.file.data.flow_range_mm3_per_s;
        f64::midpoint(low, high)
    }
}
