//! Exit status of the program.

use std::process::ExitCode;

use super::arguments::WrongArguments;
use crate::assembly::AssemblyError;
use crate::document::Problems;
use crate::io::calibration_file::CalibrationFileError;
use crate::io::model_file::ModelFileError;

/// Status of a command that finished, but rejected too many frames or lost records (the program's
/// contract with its callers: README.md, exit status).
pub const WITH_LOSS: u8 = 3;

/// Status 2 for wrong arguments or configuration, 1 for other failures.
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
