//! The extruder side's answer to events, and the state of the bead for it.

use super::controller::Controller;
use super::event::Event;
use super::extruder_control::ExtruderControl;
use super::phase::{Bead, BeadStage, Phase};
use super::step::{ExtruderStep, Hold};
use crate::core::Stamp;
use crate::extruder::{Laying, RobotSpeed};

impl Controller {
    /// The extruder side's answer; none to events of the robot side.
    pub(super) fn extrude(&mut self, now: Stamp, event: &Event) -> Option<ExtruderStep> {
        let planned = self.planned(now);
        if let Some(side) = &mut self.extruder {
            side.planned = planned.or(side.planned);
        }
        let laying = self.laying(now);
        if let (Laying::Ending(_), Some(bead)) = (&laying, self.phase.bead_mut()) {
            bead.stage = BeadStage::Ending;
        }
        let ExtruderControl { supervisor, planned, .. } = self.extruder.as_mut()?;
        let planned = planned.map(|planned| planned.command);
        let mut command = None;
        match event {
            Event::Extruder(report) => supervisor.reported(now, report),
            Event::ExtruderUp => supervisor.link_came_up(),
            Event::ExtruderDown { .. } => supervisor.link_went_down(now),
            Event::ExtruderTick => {
                supervisor.plan(planned);
                command = supervisor.tick(now, laying);
            }
            Event::Stop => command = supervisor.stop(),
            _ => return None,
        }
        Some(ExtruderStep { command, state: supervisor.state(), trace: supervisor.trace() })
    }

    /// Freezes width control while the extruder is silent: nothing flows, whatever the speed.
    /// When it is back, control goes on with what is laid from then on.
    pub(super) fn watch_extruder(&mut self, now: Stamp) {
        let Some(side) = &self.extruder else { return };
        if side.supervisor.is_silent(now) {
            self.phase.hold(now, Hold::ExtruderSilent);
            return;
        }
        let waits = self.phase.bead().is_some_and(Bead::waits_for_extruder);
        if let Some(state) = self.robot.state.filter(|_| waits) {
            self.begin_again(state.path_mm);
            self.resume(now, &state);
        }
    }

    /// Whether bead is laid, and the flow that it needs.
    fn laying(&self, now: Stamp) -> Laying {
        let Some(ExtruderControl { demand, supervisor, planned, .. }) = &self.extruder else {
            return Laying::Idle;
        };
        let bead = match &self.phase {
            Phase::Idle => return Laying::Idle,
            Phase::Ended { .. } => return Laying::Stopped,
            Phase::Bead(bead) if bead.is_faulty() => return Laying::Stopped,
            Phase::Bead(bead) => bead,
        };
        // A robot without a connection stops by itself after this time.
        if self.robot.silent_since.is_some_and(|since| now - since > self.setup.alone_for) {
            return Laying::Stopped;
        }
        let requested = bead.setpoint.map_or(self.setup.cell.start_speed, |last| last.speed);
        // During run-up the extruder is slower than the robot, so the flow is that of the
        // speed to come. In a start or a stop the robot follows the flow, not the reverse.
        let goes_ahead = bead.stage == BeadStage::RunUp || supervisor.is_in_transition();
        let robot = self.robot.state.filter(|_| !goes_ahead);
        let robot =
            robot.map(|robot| RobotSpeed { setpoint: requested, actual: robot.speed_mm_per_s });
        let flow = planned.map_or_else(|| demand.flow(robot), |planned| planned.flow);
        let stop_distance = supervisor.stop_distance(requested);
        let stops = bead.stage == BeadStage::Ending
            || self.left(now).zip(stop_distance).is_some_and(|(left, stop)| left <= stop);
        if stops { Laying::Ending(flow) } else { Laying::Bead(flow) }
    }
}
