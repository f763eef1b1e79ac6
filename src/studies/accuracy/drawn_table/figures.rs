//! The outcome of a frame, and figures of some frames of a set.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::studies::accuracy::drawn::DrawnParameter;

/// Smallest error of a silently wrong width in standard deviations. Derived: 2·Φ(−5) is one frame
/// in 1.7 million.
const SILENT_SIGMAS: f64 = 5.0;
/// Smallest error of a silently wrong width \[px\].
const SILENT_PX: f64 = 0.3;

/// The outcome of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnOutcome {
    /// Its number within the set.
    pub frame: u64,
    /// The random parameters of the frame.
    pub parameters: Vec<DrawnParameter>,
    /// Error and standard deviation, or why it was refused.
    pub width: Result<Deviation, FrameRejection>,
}

/// Error of a measured width \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Measured less true width.
    pub error_px: f64,
    /// Standard deviation that the measurement reports.
    pub sigma_px: f64,
}

impl Deviation {
    /// Whether the width is silently wrong: off by more than `SILENT_PX` and by more than
    /// `SILENT_SIGMAS` standard deviations.
    pub fn is_silent(&self) -> bool {
        self.error_px.abs() > SILENT_PX && self.error_px.abs() > SILENT_SIGMAS * self.sigma_px
    }
}

/// Why a frame gave no width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRejection {
    /// The status in `widths.csv`.
    pub status: &'static str,
    /// Whether its message names the camera's gamma.
    pub names_gamma: bool,
}

/// Figures of some frames of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DrawnFigures {
    /// The set's name.
    pub set: &'static str,
    /// The part of the set that these frames are.
    pub part: SetPart,
    /// Their number.
    pub frames: usize,
    /// Fraction that gave a width.
    pub measured_fraction: f64,
    /// Mean error \[px\].
    pub bias_px: Option<f64>,
    /// Root of the mean square of the error \[px\].
    pub rmse_px: Option<f64>,
    /// Root of the mean square of the error over its standard deviation.
    pub z: Option<f64>,
    /// Frames whose width is off by more than 5 standard deviations and 0.3 px.
    pub silent: usize,
    /// How many frames were refused, by status.
    pub rejected: BTreeMap<&'static str, usize>,
    /// How many refusals do not name the camera's gamma.
    pub without_gamma: usize,
    /// Frames with the largest errors over sigma.
    pub worst: Vec<u64>,
    /// The requirements that are missed.
    pub missed: Vec<String>,
}

/// Some frames of a set.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SetPart {
    /// Every frame.
    All,
    /// Frames whose value lies within a third of the parameter's range; the thirds are equal in
    /// the logarithm.
    Third {
        /// The parameter's name, with its unit.
        parameter: &'static str,
        /// Lower end of the third.
        from: f64,
        /// Upper end of the third.
        to: f64,
    },
    /// Frames in which the parameter is 0.
    Zero {
        /// The parameter's name, with its unit.
        parameter: &'static str,
    },
}
