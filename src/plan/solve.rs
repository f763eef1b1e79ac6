//! A plan, and how it is made.

use super::flow::{KNOT_S, float, whole};
use super::limits::attainable;
use super::prediction::WidthPrediction;
use super::profile::SpeedProfile;
use super::receding_horizon::RecedingHorizon;
use super::task::{PathValue, PlanError, PlanTask};

/// Speed and command that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The robot's speed over path; time counts from its start.
    pub speed: SpeedProfile,
    /// The command every [`Plan::EVERY_S`] from the start on; it runs straight between.
    pub command: Vec<f64>,
    /// Places \[mm\] and by which share of the wanted width the mean width over a
    /// nozzle's length about each is off, as far as the model tells.
    pub predicted_width: Vec<PathValue>,
    /// Time that the plan takes longer than the nominal speed \[s\].
    pub added_s: f64,
}

impl Plan {
    /// Time between two values of the command \[s\].
    pub const EVERY_S: f64 = KNOT_S;

    /// The command at a moment; before the start that of the start, after the end that of
    /// the end.
    pub fn command_at(&self, time_s: f64) -> f64 {
        let last = self.command.len().saturating_sub(1);
        let at = (time_s / KNOT_S).clamp(0.0, float(last));
        let knot = whole(at);
        let first = self.command.get(knot).copied().unwrap_or(0.0);
        let next = self.command.get(knot + 1).copied().unwrap_or(first);
        first + (at - float(knot)) * (next - first)
    }
}

/// Plans speed and command for a nominal speed along a path. What the nominal speed asks
/// beyond the robot's acceleration is taken off first. The extruder has settled at the
/// first speed when the plan begins.
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
