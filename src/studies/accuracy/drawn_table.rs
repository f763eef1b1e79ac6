//! Figures of frames whose parameters are drawn: over all of a set, and within each
//! third of each range.

mod limits;
mod parts;
mod tables;

use std::collections::BTreeMap;

use serde::Serialize;

use super::drawn::{DrawnSet, Parameter};
use crate::numeric::statistics::Moments;

pub use parts::figures;
pub use tables::{markdown, table};

/// Errors of more standard deviations than this, and of more pixels, are silent.
const SILENT_SIGMAS: f64 = 5.0;
const SILENT_PX: f64 = 0.3;
/// Frames of the largest errors that are listed.
const WORST: usize = 5;

/// What became of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnOutcome {
    /// Its number within the set.
    pub frame: u64,
    /// What was drawn for it.
    pub parameters: Vec<Parameter>,
    /// Error and standard deviation, or why it was refused.
    pub width: Result<Deviation, Refusal>,
}

/// How far off a width is \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Measured less true width.
    pub error_px: f64,
    /// As the measurement reports it.
    pub sigma_px: f64,
}

impl Deviation {
    fn is_silent(&self) -> bool {
        self.error_px.abs() > SILENT_PX && self.error_px.abs() > SILENT_SIGMAS * self.sigma_px
    }
}

/// Why a frame gave no width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// The status in `widths.csv`.
    pub status: &'static str,
    /// Whether its words name the camera's gamma.
    pub names_gamma: bool,
}

/// Figures of some frames of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrawnFigures {
    /// The set's name.
    pub set: &'static str,
    /// Which of its frames.
    pub part: Part,
    /// Their number.
    pub frames: usize,
    /// Share that gave a width.
    pub measured_share: f64,
    /// Mean error \[px\].
    pub bias_px: Option<f64>,
    /// Root of the mean square of the error \[px\].
    pub rmse_px: Option<f64>,
    /// Root of the mean square of the error over its standard deviation.
    pub z: Option<f64>,
    /// Frames whose width is off by more than 5 standard deviations and 0.3 px.
    pub silent: usize,
    /// How many frames were refused, by status.
    pub refused: BTreeMap<&'static str, usize>,
    /// How many refusals do not name the camera's gamma.
    pub without_gamma: usize,
    /// Frames with the largest errors over sigma.
    pub worst: Vec<u64>,
    /// What is missed.
    pub missed: Vec<String>,
}

/// Some frames of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Every frame.
    All,
    /// Those whose value lies within a third, in the logarithm, of its range.
    Third {
        /// The parameter's name, with its unit.
        parameter: &'static str,
        /// From which value on.
        from: f64,
        /// Up to which value.
        to: f64,
    },
    /// Those of which it is 0.
    Zero {
        /// The parameter's name, with its unit.
        parameter: &'static str,
    },
}

impl DrawnFigures {
    fn of(set: &DrawnSet, part: Part, outcomes: &[&DrawnOutcome]) -> Self {
        let (mut errors, mut ratios) = (Moments::default(), Moments::default());
        let mut refused = BTreeMap::new();
        let (mut silent, mut without_gamma) = (0, 0);
        let mut by_ratio = Vec::new();
        for outcome in outcomes {
            match outcome.width {
                Ok(found) => {
                    let ratio = found.error_px / found.sigma_px;
                    errors.add(found.error_px);
                    ratios.add(ratio);
                    silent += usize::from(found.is_silent());
                    by_ratio.push((ratio.abs(), outcome.frame));
                }
                Err(refusal) => {
                    *refused.entry(refusal.status).or_insert(0) += 1;
                    without_gamma += usize::from(!refusal.names_gamma);
                }
            }
        }
        by_ratio.sort_by(|one, other| other.0.total_cmp(&one.0));
        let mut figures = Self {
            set: set.name,
            part,
            frames: outcomes.len(),
            measured_share: super::share(by_ratio.len(), outcomes.len()),
            bias_px: errors.mean(),
            rmse_px: errors.rms(),
            z: ratios.rms(),
            silent,
            refused,
            without_gamma,
            worst: by_ratio.iter().take(WORST).map(|(_, frame)| *frame).collect(),
            missed: Vec::new(),
        };
        figures.missed = limits::misses(&figures, &set.requirements, by_ratio.len());
        figures
    }
}

#[cfg(test)]
mod tests;
