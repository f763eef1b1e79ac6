//! Results of `truebead plan`: `plan.csv` and a page.

mod page;
mod table;
mod verdict;

pub use page::page;
pub use table::to_csv;

use crate::core::Unit;
use crate::plan::{Plan, SpeedProfile, WidthPrediction};

/// A planned bead of a job.
#[derive(Debug)]
pub struct PlannedBead {
    /// Its name, such as `line 3`, or its position in the job if it has no name there.
    pub name: String,
    /// The speed without a plan, as fast as the robot's acceleration allows.
    pub nominal: SpeedProfile,
    /// Path \[mm\] and position \[mm\] of the job's points, in order.
    pub position: Vec<(f64, [f64; 3])>,
    /// The plan, with commands relative to [`PlanFacts::idle`].
    pub plan: Plan,
    /// Predicted width with the plan.
    pub planned: WidthPrediction,
    /// Predicted width at nominal speed with a constant command.
    pub constant: WidthPrediction,
    /// Predicted width at nominal speed with a command proportional to it.
    pub proportional: WidthPrediction,
}

/// Facts that are common to all beads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanFacts {
    /// Target width \[mm\].
    pub width_mm: f64,
    /// Target cross-section \[mm²\].
    pub area_mm2: f64,
    /// Command at which the model has no flow, in its unit.
    pub idle: f64,
    /// Unit of the command.
    pub unit: Unit,
}

impl PlannedBead {
    /// Path length \[mm\].
    pub fn length_mm(&self) -> f64 {
        self.nominal.end_mm() - self.nominal.start_mm()
    }
}

/// Root mean square of the relative width error over all beads.
pub fn rms<'a>(
    beads: impl IntoIterator<Item = &'a PlannedBead>,
    of: fn(&PlannedBead) -> &WidthPrediction,
) -> f64 {
    let all = beads.into_iter().flat_map(|bead| of(bead).width.iter());
    let (sum, count) =
        all.fold((0.0, 0.0), |(sum, count), (_, error)| (sum + error * error, count + 1.0));
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}
