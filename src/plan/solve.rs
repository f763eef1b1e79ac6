//! A plan, and its solution.

use super::flow::{KNOT_S, between, whole};
use super::limits::attainable;
use super::prediction::WidthPrediction;
use super::profile::SpeedProfile;
use super::receding_horizon::RecedingHorizon;
use super::task::{PathValue, PlanError, PlanTask};
use crate::numeric::number::to_f64;

/// Speed and command, planned together.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The robot's speed over path; time counts from its start.
    pub speed: SpeedProfile,
    /// The command at knots that are `KNOT_S` apart, from the start on; linear in between.
    pub command: Vec<f64>,
    /// Positions \[mm\] and predicted relative error of the mean width over a nozzle's length about
    /// each.
    pub predicted_width: Vec<PathValue>,
    /// Duration of the plan beyond that of the nominal speed \[s\].
    pub added_s: f64,
}

impl Plan {
    /// The command at a time; constant before the start and after the end.
    pub fn command_at(&self, time_s: f64) -> f64 {
        let last = self.command.len().saturating_sub(1);
        let at = (time_s / KNOT_S).clamp(0.0, to_f64(last));
        let knot = whole(at);
        between(&self.command, knot, at - to_f64(knot))
    }
}

/// Plans speed and command for a nominal speed along a path. The nominal speed is first limited to the
/// robot's acceleration. The plan begins in the steady state of the first speed.
pub fn solve(task: &PlanTask<'_>, nominal: &SpeedProfile) -> Result<Plan, PlanError> {
    task.check()?;
    let nominal = attainable(nominal, task.limits.robot.accel_mm_per_s2)?;
    let squares = nominal.squares();
    task.steady(squares.iter().copied().fold(0.0, f64::max).sqrt())?;
    let start = task.steady(squares.first().copied().unwrap_or(0.0).sqrt())?;
    let (speed, knots) = RecedingHorizon::new(task, &nominal, start)?.plan()?;
    let added_s = speed.duration_s() - nominal.duration_s();
    let command = std::iter::once(start).chain(knots).collect();
    let mut plan = Plan { speed, command, predicted_width: Vec::new(), added_s };
    plan.predicted_width =
        WidthPrediction::new(task, &plan.speed, |time_s| plan.command_at(time_s))?.width;
    Ok(plan)
}
