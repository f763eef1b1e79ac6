//! The end of a bead.

use super::conditions::BeadConditions;
use crate::core::{Mm, Span};
use crate::identify::start_stop::parameters::StartStop;

/// A stop, from the command to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    parameters: StartStop,
    min_speed_ratio: f64,
    robot_lag: Span,
    distance: Mm,
}

impl Stop {
    pub(super) fn of(parameters: &StartStop, laid: &BeadConditions) -> Self {
        let min_speed_ratio = laid.min_speed_ratio;
        let follows_s = parameters.falls_to_s(min_speed_ratio);
        let lasts_s = parameters.falls_to_s(0.5 * min_speed_ratio);
        let full_speed_s =
            parameters.delivered_s(follows_s) + min_speed_ratio * (lasts_s - follows_s);
        let distance = laid.speed * Span::from_secs(full_speed_s);
        Self { parameters: *parameters, min_speed_ratio, robot_lag: laid.robot_lag, distance }
    }

    /// Distance from the end of the bead at which the pump is commanded to stop. A shorter bead never
    /// has a steady flow.
    pub const fn distance(&self) -> Mm {
        self.distance
    }

    /// Flow over the flow before, a time after the command.
    pub fn flow_ratio(&self, since: Span) -> f64 {
        self.parameters.remaining_flow(since.secs())
    }

    /// Setpoint of the robot over its start speed, a time after the command; ahead of the flow by its
    /// lag.
    pub fn speed_ratio(&self, since: Span) -> f64 {
        self.flow_ratio(since + self.robot_lag).clamp(self.min_speed_ratio, 1.0)
    }
}
