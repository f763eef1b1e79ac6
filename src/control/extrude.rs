//! The extruder side of a controller: what it hears of the robot's, and what
//! it answers.

use std::sync::Arc;

use super::event::Event;
use super::step::ExtruderStep;
use super::{Controller, Phase, Stretch};
use crate::core::time::Stamp;
use crate::extruder::trajectory::{Planned, PlannedJob};
use crate::extruder::{ExtruderFault, ExtruderState, FlowDemand, Laying, RobotSpeed, Supervisor};

/// The extruder side of a controller, where a cell has one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExtruderSide {
    pub(super) supervisor: Supervisor,
    pub(super) demand: FlowDemand,
    /// The job that was planned, if there is one.
    pub(super) plan: Option<Arc<PlannedJob>>,
    /// What was planned for the last place on this bead that was known.
    pub(super) planned: Option<Planned>,
}

impl Controller {
    /// The extruder side's answer to what concerns it.
    pub(super) fn extrude(&mut self, now: Stamp, event: &Event) -> Option<ExtruderStep> {
        let planned = self.planned(now);
        if let Some(side) = &mut self.extruder {
            side.planned = planned.or(side.planned);
        }
        let laying = self.laying(now);
        if matches!(laying, Laying::Ending(_)) {
            self.stretch = Stretch::Ending;
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
        match &self.phase {
            Phase::Idle => Laying::Idle,
            Phase::Fault { .. } => Laying::Stopped,
            _ if self.ended => Laying::Stopped,
            // Nobody knows what a robot does that is not heard, but by then it has
            // stopped.
            _ if self.heard.not_since.is_some_and(|since| now - since > self.setup.alone_for) => {
                Laying::Stopped
            }
            Phase::Priming | Phase::Tracking { .. } | Phase::Holding { .. } => {
                let told = self.told.map_or(self.setup.start_speed, |(_, speed)| speed);
                // No extruder keeps up with a robot that starts; it is ready for
                // the speed that comes. Nor does it follow a robot that goes by its flow.
                let goes_ahead = self.stretch == Stretch::RunUp || supervisor.is_passing();
                let robot = self.robot.filter(|_| !goes_ahead);
                let robot =
                    robot.map(|robot| RobotSpeed { setpoint: told, actual: robot.speed_mm_per_s });
                let flow = planned.map_or_else(|| demand.wanted(robot), |planned| planned.flow);
                let way = supervisor.way_of_stop(told);
                let stops = self.stretch == Stretch::Ending
                    || self.left(now).zip(way).is_some_and(|(left, way)| left <= way);
                if stops { Laying::Ending(flow) } else { Laying::Bead(flow) }
            }
        }
    }

    pub(super) fn extruder_fault(&self) -> Option<ExtruderFault> {
        match self.extruder.as_ref()?.supervisor.state() {
            ExtruderState::Fault(why) => Some(why),
            _ => None,
        }
    }
}
