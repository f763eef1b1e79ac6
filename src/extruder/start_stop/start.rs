//! The start of a bead.

use super::conditions::BeadConditions;
use crate::core::time::Span;
use crate::core::units::Mm3PerS;
use crate::identify::start_stop::parameters::StartStop;

/// What came before a start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pause {
    /// From the command to stop until the command to run.
    pub idle: Span,
    /// Flow before the stop; what still drools of it comes with the new flow.
    pub flow_before: Mm3PerS,
}

/// A start, from the moment when the pump is told to run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    parameters: StartStop,
    previous_flow_ratio: f64,
    idle_s: f64,
    min_speed_ratio: f64,
    robot_lag: Span,
    first_flow_s: f64,
    /// What still comes of the flow before as the first flow comes, as a share
    /// of the flow that is wanted.
    remaining_flow_ratio: f64,
    robot_s: f64,
}

impl Start {
    pub(super) fn after(parameters: &StartStop, laid: &BeadConditions, pause: &Pause) -> Self {
        let idle_s = pause.idle.secs().max(0.0);
        let before_share = (pause.flow_before / laid.flow).max(0.0);
        let first_flow_s = parameters.delay_s(idle_s, laid.flow.get());
        let left_share = before_share * parameters.remaining_flow(idle_s + first_flow_s);
        let goes_at = 0.5 * laid.min_speed_ratio;
        let moves_s = if left_share >= goes_at {
            0.0
        } else {
            first_flow_s + parameters.rise_s * libm::log((1.0 - left_share) / (1.0 - goes_at))
        };
        Self {
            parameters: *parameters,
            previous_flow_ratio: before_share,
            idle_s,
            min_speed_ratio: laid.min_speed_ratio,
            robot_lag: laid.robot_lag,
            first_flow_s,
            remaining_flow_ratio: left_share,
            robot_s: (moves_s - laid.robot_lag.secs()).max(0.0),
        }
    }

    /// From the command until the first flow comes.
    pub fn first_flow(&self) -> Span {
        Span::from_secs(self.first_flow_s)
    }

    /// From the command until the robot is told to go: how long it waits where
    /// it is at its place already, and how much earlier the pump is told where
    /// it is still on its way.
    pub fn robot_start(&self) -> Span {
        Span::from_secs(self.robot_s)
    }

    /// The flow so long after the command, as a share of the flow that is
    /// wanted.
    pub fn flow_ratio(&self, since: Span) -> f64 {
        let since_s = since.secs();
        let past_s = since_s - self.first_flow_s;
        if past_s < 0.0 {
            return self.previous_flow_ratio
                * self.parameters.remaining_flow(self.idle_s + since_s);
        }
        1.0 - (1.0 - self.remaining_flow_ratio) * libm::exp(-past_s / self.parameters.rise_s)
    }

    /// Speed that the robot is told so long after the command, as a share of its
    /// start speed; by its lag ahead of the flow.
    pub fn speed_ratio(&self, since: Span) -> f64 {
        if since.secs() < self.robot_s {
            0.0
        } else {
            self.flow_ratio(since + self.robot_lag).clamp(self.min_speed_ratio, 1.0)
        }
    }
}
