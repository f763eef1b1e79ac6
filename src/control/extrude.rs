//! The extruder side of a controller: what it hears of the robot's, and what
//! it answers.

use super::controller::Controller;
use super::event::Event;
use super::extruder_side::ExtruderSide;
use super::phase::{Phase, Segment};
use super::step::ExtruderStep;
use crate::core::time::Stamp;
use crate::extruder::{Laying, RobotSpeed};

impl Controller {
    /// The extruder side's answer to what concerns it.
    pub(super) fn extrude(&mut self, now: Stamp, event: &Event) -> Option<ExtruderStep> {
        let planned = self.planned(now);
        if let Some(side) = &mut self.extruder {
            side.planned = planned.or(side.planned);
        }
        let laying = self.laying(now);
        if let (Laying::Ending(_), Some(bead)) = (&laying, self.phase.bead_mut()) {
            bead.segment = Segment::Ending;
        }
        let ExtruderSide { supervisor, planned, .. } = self.extruder.as_mut()?;
        let planned = planned.map(|planned| planned.command);
        let command = match event {
            Event::Extruder(report) => {
                supervisor.reported(now, report);
                None
            }
            Event::ExtruderUp => {
                supervisor.link_came_up();
                None
            }
            Event::ExtruderDown { .. } => {
                supervisor.link_went_down(now);
                None
            }
            Event::ExtruderTick => {
                supervisor.plan(planned);
                supervisor.tick(now, laying)
            }
            Event::Stop => supervisor.stop(),
            _ => return None,
        };
        Some(ExtruderStep { command, state: supervisor.state(), trace: supervisor.trace() })
    }

    /// What the extruder side has to know of the robot's.
    fn laying(&self, now: Stamp) -> Laying {
        let Some(ExtruderSide { demand, supervisor, planned, .. }) = &self.extruder else {
            return Laying::Idle;
        };
        let bead = match &self.phase {
            Phase::Idle => return Laying::Idle,
            Phase::Ended { .. } => return Laying::Stopped,
            Phase::Bead(bead) if bead.is_faulty() => return Laying::Stopped,
            Phase::Bead(bead) => bead,
        };
        // Nobody knows what a robot does that is not heard, but by then it has stopped.
        if self.robot.silent_since.is_some_and(|since| now - since > self.setup.alone_for) {
            return Laying::Stopped;
        }
        let requested = bead.setpoint.map_or(self.setup.start_speed, |last| last.speed);
        // No extruder keeps up with a robot that starts; it is ready for
        // the speed that comes. Nor does it follow a robot that goes by its flow.
        let goes_ahead = bead.segment == Segment::RunUp || supervisor.is_in_transition();
        let robot = self.robot.state.filter(|_| !goes_ahead);
        let robot =
            robot.map(|robot| RobotSpeed { setpoint: requested, actual: robot.speed_mm_per_s });
        let flow = planned.map_or_else(|| demand.flow(robot), |planned| planned.flow);
        let way = supervisor.stop_distance(requested);
        let stops = bead.segment == Segment::Ending
            || self.left(now).zip(way).is_some_and(|(left, way)| left <= way);
        if stops { Laying::Ending(flow) } else { Laying::Bead(flow) }
    }
}
