//! The robot's part of the control thread: reports of its link.

use super::ending::Ending;
use super::{ControlThread, Inputs};
use crate::control::Event;
use crate::core::{RobotLimits, RobotState, Stamp};
use crate::run::ports::{Recorder, RobotEvent};
use crate::width_control::limiter::SpeedLimits;

impl<I: Inputs, K: Recorder> ControlThread<'_, I, K> {
    /// Passes the robot's reports to the controller.
    pub(super) fn take_robot_event(&mut self, event: RobotEvent) {
        match &event {
            RobotEvent::State { at, state } => return self.take_robot_state(*at, *state),
            RobotEvent::Up { limits: robot, .. } => {
                (self.operator.notice)(&format!("robot `{}` is connected", robot.name));
                self.unfit = unfit(&self.settings.limits, robot).map(Ending::RobotLimits);
            }
            RobotEvent::Down { reason, .. } => (self.operator.notice)(&format!("robot: {reason}")),
            RobotEvent::Refused { text, .. } => {
                (self.operator.notice)(&format!("robot refused {text}"));
            }
        }
        self.give(event.into());
    }

    /// Passes on where the robot is, unless the controller does not use it.
    fn take_robot_state(&mut self, at: Stamp, state: RobotState) {
        if self.give(Event::Robot(state)).step.trace.report_ignored {
            return;
        }
        self.speed = Some(state.speed_mm_per_s);
        if let Some(view) = &self.robot_view {
            view.observe(at, &state);
        }
    }
}

/// Why a robot cannot follow a cell's speed limits; `None` if it can.
fn unfit(limits: &SpeedLimits, robot: &RobotLimits) -> Option<String> {
    let fits = robot.min_mm_per_s <= limits.min_speed && limits.max_speed <= robot.max_mm_per_s;
    (!fits).then(|| {
        format!(
            "robot `{}` takes {} to {}, the cell's [limits] are {} to {}; make them lie within \
             the robot's",
            robot.name, robot.min_mm_per_s, robot.max_mm_per_s, limits.min_speed, limits.max_speed
        )
    })
}
