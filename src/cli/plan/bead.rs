//! A bead of a job before it is planned.

use std::path::Path;

use crate::cli::arguments::WrongArguments;
use crate::plan::SpeedProfile;

/// A bead before it is planned.
#[derive(Debug)]
pub struct JobBead {
    /// What it is called.
    pub name: String,
    /// Its nominal speed.
    pub nominal: SpeedProfile,
    /// Path and position \[mm\].
    pub position: Vec<(f64, [f64; 3])>,
}

/// The error of a wrong job, with its file's name.
pub fn wrong_job(job: &Path, what: &impl ToString) -> WrongArguments {
    wrong!("job {}: {}", job.display(), what.to_string())
}
