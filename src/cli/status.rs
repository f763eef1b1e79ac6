//! Exit status of the program.

use std::process::ExitCode;

use super::arguments::WrongArguments;
use crate::assembly::AssemblyError;
use crate::document::Problems;
use crate::io::calibration_file::CalibrationFileError;
use crate::io::model_file::ModelFileError;

/// Status of a command that finished, but with too many frames refused or
/// records lost.
pub const WITH_LOSS: u8 = 3;

/// Configuration and arguments are told from failures at work.
pub fn status_of(error: &anyhow::Error) -> ExitCode {
    let wrong = error.chain().any(|cause| {
        cause.is::<WrongArguments>()
            || cause.is::<Problems>()
            || cause.is::<CalibrationFileError>()
            || cause.is::<ModelFileError>()
            || cause.downcast_ref().is_some_and(AssemblyError::is_in_file)
    });
    ExitCode::from(if wrong { 2 } else { 1 })
}
