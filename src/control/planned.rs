//! A job that robot and extruder were planned for together, bead by bead.

use super::controller::Controller;
use super::extruder_side::{ExtruderSide, NO_OVERRIDE};
use crate::core::readback::ROBOT_LAG;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::extruder::trajectory::{PlannedPoint, PlannedTrajectory};

/// Share of its plan from which a bead was laid: the robot's last report comes a little
/// before its end.
const COMPLETE_FRACTION: f64 = 0.9;

impl Controller {
    /// The plan of the bead that is being laid.
    fn course(&self) -> Option<&PlannedTrajectory> {
        let plan = self.extruder.as_ref()?.plan.as_ref()?;
        Some(plan.bead(self.bead.number).as_ref())
    }

    /// The next bead begins. One that was broken off, by whatever it was, is laid again:
    /// no robot says which bead of its program it begins.
    pub(super) fn next_bead(&mut self) {
        let laid = self.bead.laid;
        if self.course().is_some_and(|course| laid >= course.end() * COMPLETE_FRACTION) {
            self.bead.number += 1;
        }
        self.bead.laid = Mm::ZERO;
        if let Some(side) = &mut self.extruder {
            side.planned = None;
        }
    }

    /// What is planned for where the nozzle is now.
    pub(super) fn planned(&self, now: Stamp) -> Option<PlannedPoint> {
        Some(self.course()?.at(self.laid_at(now)?))
    }

    /// The share of a speed of the width controller, which is one for the start speed's
    /// flow, at which a plan, a start or a stop has the robot go; none where it is not
    /// known how far along its plan the robot is.
    pub(super) fn speed_override(&self, now: Stamp) -> Option<f64> {
        let share =
            self.extruder.as_ref().map_or(NO_OVERRIDE, |side| side.supervisor.robot_speed_ratio());
        let Some(course) = self.course() else { return Some(share) };
        let path = self.laid_at(now)? + self.robot.state?.speed_mm_per_s * ROBOT_LAG;
        let planned = course.speed(path, self.setup.setpoint_period);
        Some(share * (planned / self.setup.start_speed))
    }

    /// The flow at the nozzle over that of the start speed, by which the bead is wider than
    /// the robot's speed alone tells.
    pub(super) fn flow_ratio(&self, now: Stamp) -> f64 {
        let Some(ExtruderSide { supervisor, demand, .. }) = &self.extruder else { return 1.0 };
        let planned = self.planned(now).map_or(1.0, |planned| planned.flow / demand.nominal());
        supervisor.flow_ratio() * planned
    }

    /// How much of the bead is left, where its length is known.
    pub(super) fn left(&self, now: Stamp) -> Option<Mm> {
        let end = self.course().map(PlannedTrajectory::end).or(self.setup.bead_length)?;
        Some(end - self.laid_at(now)?)
    }
}
