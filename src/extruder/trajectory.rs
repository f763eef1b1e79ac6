//! A planned job: speed and command over the path, from `plan.csv`.

mod job;
mod table;
#[cfg(test)]
mod tests;

pub use job::{PlannedJob, PlannedPoint, PlannedTrajectory};
pub use table::{PlanTableError, read};
