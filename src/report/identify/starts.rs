//! Starts and stops of an extruder from logged data: what was found, as text and
//! as a page.

mod page;
mod text;

pub use page::page;
pub use text::text;

use crate::core::quantity::Quantity;
use crate::identify::file::Setting;
use crate::identify::number::brief;
use crate::identify::series::Series;
use crate::identify::start_stop::file::{Named, START, STOP, StartStopFile};
use crate::identify::start_stop::{StartStopFit, StartStopFitError, fit};

/// A standard error above this share of a parameter is told.
const LOOSE_SHARE: f64 = 0.3;
/// With fewer starts a scatter is hardly known.
const FEW_STARTS: usize = 8;

/// What was logged and what it is called.
#[derive(Debug, Clone)]
pub struct StartLogs {
    /// Where the data are from.
    pub source: String,
    /// What the extruder is told.
    pub input: Quantity,
    /// What comes of it, as it was logged.
    pub output: Quantity,
    /// What the extruder is told, in its own unit.
    pub command: Series,
    /// What comes of it \[mm³/s\].
    pub flow: Series,
}

/// Starts and stops with all that is known of them.
#[derive(Debug)]
pub struct StartStudy {
    /// The data.
    pub logs: StartLogs,
    /// The parameters, and what they were found from.
    pub fit: StartStopFit,
    /// The same as a file keeps it.
    pub file: StartStopFile,
    /// What the reader should know before they are used.
    pub warnings: Vec<String>,
}

/// Fits starts and stops, or says why the data do not tell them.
pub fn study(logs: StartLogs, setting: Setting) -> Result<StartStudy, StartStopFitError> {
    let fit = fit(&logs.command, &logs.flow)?;
    let file = StartStopFile::of(&fit, setting);
    let warnings = doubts(&fit);
    Ok(StartStudy { logs, fit, file, warnings })
}

fn doubts(fit: &StartStopFit) -> Vec<String> {
    let mut doubts = Vec::new();
    if fit.starts.len() < FEW_STARTS {
        doubts.push(format!(
            "{} starts leave the standard errors themselves uncertain; {FEW_STARTS} or more tell \
             them",
            fit.starts.len()
        ));
    }
    let loose = |one: &&Named| (one.of)(&fit.sigma) > LOOSE_SHARE * (one.of)(&fit.parameters);
    for one in START.iter().chain(&STOP).filter(loose) {
        doubts.push(format!(
            "{} is {} ± {} {}: hardly known; more {} of the same kind tell it",
            one.key,
            brief((one.of)(&fit.parameters)),
            brief((one.of)(&fit.sigma)),
            one.unit,
            if STOP.iter().any(|stop| stop.key == one.key) { "stops" } else { "starts" }
        ));
    }
    doubts
}

impl StartStudy {
    /// Starts that tell nothing: the first one, after whatever was before the
    /// record, and those without an even flow after them.
    pub const fn left_out(&self) -> usize {
        self.fit.runs.saturating_sub(self.fit.starts.len())
    }

    /// The flow about which the delays are told \[mm³/s\].
    pub fn flow_mm3_per_s(&self) -> f64 {
        let [low, high] = self.file.seen.flow_range_mm3_per_s;
        f64::midpoint(low, high)
    }
}
