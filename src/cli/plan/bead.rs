//! A bead of a job before it is planned.

use std::path::Path;

use crate::cli::arguments::WrongArguments;
use crate::plan::SpeedProfile;

/// A bead before it is planned.
#[derive(Debug)]
pub struct JobBead {
    /// Its name.
    pub name: String,
    /// Its nominal speed.
    pub nominal: SpeedProfile,
    /// Path \[mm\] and position \[mm\] of its points.
    pub position: Vec<(f64, [f64; 3])>,
}

/// The error for an invalid job, with its file name.
pub fn wrong_job(job: &Path, what: &impl ToString) -> WrongArguments {
    wrong!("job {}: {}", job.display(), what.to_string())
}
