//! Why a cell cannot be assembled.

use std::io;
use std::path::PathBuf;

use crate::document::Problems;
use crate::extruder::rheology::RheologyError;
use crate::extruder::screw::ScrewError;
use crate::io::calibration_file::CalibrationFileError;
use crate::io::model_file::ModelFileError;
use crate::numeric::lti::ModelError;

/// Why a cell cannot be assembled from its file and the files that it names.
#[derive(Debug, thiserror::Error)]
pub enum AssemblyError {
    /// Parts of the cell that do not fit together: what was found, where, and what was expected.
    #[error("{0}")]
    Unfit(String),
    /// The cell file breaks its rules.
    #[error(transparent)]
    Cell(#[from] Problems),
    /// The cell's calibration file cannot be used.
    #[error("{}: calibration.file", cell.display())]
    Calibration {
        /// The cell file.
        cell: PathBuf,
        /// What is wrong with the calibration.
        source: CalibrationFileError,
    },
    /// A calibration file cannot be read again.
    #[error("calibration file {}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The extruder's model cannot be read.
    #[error(transparent)]
    Model(#[from] ModelFileError),
    /// The model is not valid for its use.
    #[error(transparent)]
    Dynamics(#[from] ModelError),
    /// The nozzle or the screw cannot give the demanded flow.
    #[error(transparent)]
    Rheology(#[from] RheologyError),
    /// The settings of the screw are not valid.
    #[error(transparent)]
    Screw(#[from] ScrewError),
}

impl AssemblyError {
    /// Whether a file is wrong, as opposed to work that failed.
    pub fn is_in_file(&self) -> bool {
        matches!(self, Self::Unfit(_) | Self::Cell(_) | Self::Calibration { .. } | Self::Model(_))
    }

    /// Parts of the cell that do not fit together.
    #[expect(clippy::needless_pass_by_value, reason = "an error or a new text at every call")]
    pub fn unfit(what: impl ToString) -> Self {
        Self::Unfit(what.to_string())
    }
}
