//! A plan as a cell plays it: speed and command over the path, from `plan.csv`.

mod job;
mod table;
#[cfg(test)]
mod tests;

pub use job::{Planned, PlannedCourse, PlannedJob, Range};
pub use table::{TableError, read};
