//! The planned trajectory of robot and extruder, bead by bead, and the speed override.

use super::controller::Controller;
use super::extruder_control::{ExtruderControl, NO_OVERRIDE};
use crate::core::{Mm, ROBOT_LAG, Stamp};
use crate::extruder::trajectory::{PlannedPoint, PlannedTrajectory};

/// Fraction of its planned length from which a bead counts as laid. The robot's last report
/// comes before the end of the bead, so 1 would never be reached; a small value would skip
/// a bead that was interrupted.
const COMPLETE_FRACTION: f64 = 0.9;

impl Controller {
    /// The plan of the bead that is being laid.
    fn trajectory(&self) -> Option<&PlannedTrajectory> {
        let plan = self.extruder.as_ref()?.plan.as_ref()?;
        Some(plan.bead(self.bead.number).as_ref())
    }

    /// The next bead begins. The robot does not report which bead of its program that is:
    /// a bead that was interrupted is taken to be laid again.
    pub(super) fn next_bead(&mut self) {
        let laid = self.bead.laid;
        if self.trajectory().is_some_and(|plan| laid >= plan.end() * COMPLETE_FRACTION) {
            self.bead.number += 1;
        }
        self.bead.laid = Mm::ZERO;
        if let Some(side) = &mut self.extruder {
            side.planned = None;
        }
    }

    /// What is planned for where the nozzle is now.
    pub(super) fn planned(&self, now: Stamp) -> Option<PlannedPoint> {
        Some(self.trajectory()?.at(self.laid_at(now)?))
    }

    /// The speed override: the factor by which a plan, a start or a stop multiplies the
    /// width controller's speed, which is for the flow at the start speed. None where the
    /// robot's position along its plan is not known.
    pub(super) fn speed_override(&self, now: Stamp) -> Option<f64> {
        let extruder = self.extruder.as_ref();
        let factor = extruder.map_or(NO_OVERRIDE, |side| side.supervisor.robot_speed_ratio());
        let Some(plan) = self.trajectory() else { return Some(factor) };
        let path = self.laid_at(now)? + self.robot.state?.speed_mm_per_s * ROBOT_LAG;
        let planned = plan.speed(path, self.setup.cell.setpoint_period);
        Some(factor * (planned / self.setup.cell.start_speed))
    }

    /// Flow at the nozzle over the flow at the start speed, without a unit. The bead is as
    /// wide as one laid at the speed divided by this ratio.
    pub(super) fn flow_ratio(&self, now: Stamp) -> f64 {
        let Some(ExtruderControl { supervisor, demand, .. }) = &self.extruder else { return 1.0 };
        let planned = self.planned(now).map_or(1.0, |planned| planned.flow / demand.nominal());
        supervisor.flow_ratio() * planned
    }

    /// Length of bead that is left, where the bead's length is known.
    pub(super) fn left(&self, now: Stamp) -> Option<Mm> {
        let end = self.trajectory().map(PlannedTrajectory::end).or(self.setup.bead_length)?;
        Some(end - self.laid_at(now)?)
    }
}
