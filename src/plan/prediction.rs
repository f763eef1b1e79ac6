//! Prediction for a speed and a command: flow over time and width over path.

use super::flow::{FlowTrajectory, TICK_S, simulate, whole};
use super::profile::SpeedProfile;
use super::task::{PathValue, PlanError, PlanTask};
use crate::core::Span;
use crate::numeric::lti::ModelError;
use crate::numeric::number::to_f64;

/// Distance of the positions at which the width is predicted, in lengths of the nozzle.
const POSITION_SPACING: f64 = 0.05;

/// An extruder's command without a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnplannedCommand {
    /// Constant, for the fastest speed.
    Constant,
    /// Proportional to the robot's speed, within the drive's limits.
    Proportional,
}

/// A prediction.
#[derive(Debug, Clone, PartialEq)]
pub struct WidthPrediction {
    flow: FlowTrajectory,
    /// Positions \[mm\] and relative error of the mean width over a nozzle's length about each.
    pub width: Vec<PathValue>,
}

impl WidthPrediction {
    /// For a speed and a command over time \[s\], which is evaluated in the order of time, from the
    /// steady state of the first command.
    pub fn new(
        task: &PlanTask<'_>,
        speed: &SpeedProfile,
        command: impl FnMut(f64) -> f64,
    ) -> Result<Self, ModelError> {
        let flow = simulate(task.extruder, command, speed.duration_s())?;
        let width = width(task, speed, &flow);
        Ok(Self { flow, width })
    }

    /// For a speed and a command without a plan.
    pub fn unplanned(
        task: &PlanTask<'_>,
        speed: &SpeedProfile,
        how: UnplannedCommand,
    ) -> Result<Self, PlanError> {
        let fastest = speed.squares().iter().copied().fold(0.0, f64::max).sqrt();
        let constant = task.steady(fastest)?;
        let mut last = None;
        let command = |now_s| match how {
            UnplannedCommand::Constant => constant,
            UnplannedCommand::Proportional => {
                let demand = constant * speed.speed_at(speed.path_at(now_s)) / fastest;
                let before = last.unwrap_or(demand);
                let (command, _) = task.limits.drive.apply(demand, before, Span::from_secs(TICK_S));
                last = Some(command);
                command
            }
        };
        Ok(Self::new(task, speed, command)?)
    }

    /// Flow at a moment \[mm³/s\].
    pub fn flow_at(&self, time_s: f64) -> f64 {
        self.flow.flow_at(time_s)
    }
}

fn width(task: &PlanTask<'_>, speed: &SpeedProfile, flow: &FlowTrajectory) -> Vec<PathValue> {
    let half = 0.5 * task.bead.nozzle_mm;
    let full = task.bead.area_mm2 * task.bead.nozzle_mm;
    let every = POSITION_SPACING * task.bead.nozzle_mm;
    let volume = |path_mm: f64| flow.volume_at(speed.time_at(path_mm));
    let first = speed.start_mm() + half;
    let count = whole((speed.end_mm() - half - first) / every);
    let positions = (0..=count).map(|k| first + every * to_f64(k));
    let inside = positions.filter(|at| at + half <= speed.end_mm());
    inside.map(|at| (at, (volume(at + half) - volume(at - half)) / full - 1.0)).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use crate::extruder::limits::CommandLimits;
    use crate::numeric::lti::TransferFunction;
    use crate::plan::profile::profile_of;
    use crate::plan::{BeadGeometry, FlowUncertainty, PlanLimits, RobotMotionLimits};

    #[test]
    fn a_constant_command_lays_too_much_where_the_robot_is_slow() {
        let extruder = TransferFunction::new(&[600.0], &[0.3, 1.0], 0.05).unwrap();
        let task = PlanTask {
            limits: PlanLimits {
                robot: RobotMotionLimits { accel_mm_per_s2: 2000.0, slowest_mm_per_s: 2.0 },
                drive: CommandLimits::new(0.0, 10.0, 20.0).unwrap(),
                budget_s: 1.0,
            },
            bead: BeadGeometry { area_mm2: 45.0, nozzle_mm: 20.0, nozzle_sigma: 0.0 },
            unmodelled: FlowUncertainty { ratio: 0.17, correlation_s: 0.15 },
            extruder: &extruder,
        };
        let speed = profile_of(&[(0.0, 100.0), (60.0, 100.0), (61.0, 50.0), (200.0, 50.0)]);
        let speed = speed.unwrap();
        let constant =
            WidthPrediction::unplanned(&task, &speed, UnplannedCommand::Constant).unwrap();
        let (first, last) = (constant.width[0].1, constant.width.last().unwrap().1);
        assert!(first.abs() < 1e-9 && (last - 1.0).abs() < 1e-9, "{first} {last}");
        assert!((constant.flow_at(1.0) - 4500.0).abs() < 1e-6);
        // Proportional, it is right in the steady state.
        let followed =
            WidthPrediction::unplanned(&task, &speed, UnplannedCommand::Proportional).unwrap();
        assert!(followed.width.last().unwrap().1.abs() < 0.01);
        assert!((followed.flow_at(speed.duration_s()) - 2250.0).abs() < 10.0);
    }
}
