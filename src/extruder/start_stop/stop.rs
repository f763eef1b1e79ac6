//! The end of a bead.

use super::conditions::BeadConditions;
use crate::core::time::Span;
use crate::core::units::Mm;
use crate::identify::start_stop::parameters::StartStop;

/// A stop, from the moment when the pump is told to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    parameters: StartStop,
    min_speed_ratio: f64,
    robot_lag: Span,
    distance: Mm,
    duration_s: f64,
    drool_mm3: f64,
}

impl Stop {
    pub(super) fn of(parameters: &StartStop, laid: &BeadConditions) -> Self {
        let min_speed_ratio = laid.min_speed_ratio;
        let follows_s = parameters.falls_to_s(min_speed_ratio);
        let lasts_s = parameters.falls_to_s(0.5 * min_speed_ratio);
        let full_speed_s =
            parameters.delivered_s(follows_s) + min_speed_ratio * (lasts_s - follows_s);
        let left_s = parameters.total_after_stop_s() - parameters.delivered_s(lasts_s);
        Self {
            parameters: *parameters,
            min_speed_ratio,
            robot_lag: laid.robot_lag,
            distance: laid.speed * Span::from_secs(full_speed_s),
            duration_s: lasts_s,
            drool_mm3: laid.flow.get() * left_s,
        }
    }

    /// How far from the end of the bead the pump is told to stop. A bead that is
    /// shorter than this has no room for an even flow.
    pub const fn distance(&self) -> Mm {
        self.distance
    }

    /// From the command to stop until the robot is at the end of the bead.
    pub fn duration(&self) -> Span {
        Span::from_secs(self.duration_s)
    }

    /// What drools out after the end of the bead \[mm³\].
    pub const fn drool_mm3(&self) -> f64 {
        self.drool_mm3
    }

    /// The flow so long after the command, as a share of the flow before.
    pub fn flow_ratio(&self, since: Span) -> f64 {
        self.parameters.remaining_flow(since.secs())
    }

    /// Speed that the robot is told so long after the command, as a share of its
    /// start speed, until it is at the end; by its lag ahead of the flow.
    pub fn speed_ratio(&self, since: Span) -> f64 {
        self.flow_ratio(since + self.robot_lag).clamp(self.min_speed_ratio, 1.0)
    }
}
