//! The start of a bead.

use super::conditions::BeadConditions;
use crate::core::{Mm3PerS, Span};
use crate::identify::start_stop::parameters::StartStop;

/// The pause before a start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pause {
    /// Time from the command to stop to the command to run.
    pub idle: Span,
    /// Flow before the stop; its remaining drool adds to the new flow.
    pub flow_before: Mm3PerS,
}

/// A start, from the command to run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    parameters: StartStop,
    previous_flow_ratio: f64,
    idle_s: f64,
    min_speed_ratio: f64,
    robot_lag: Span,
    first_flow_s: f64,
    /// Flow that remains from before the pause at the first flow, over the demanded flow.
    remaining_flow_ratio: f64,
    robot_s: f64,
}

impl Start {
    pub(super) fn after(parameters: &StartStop, laid: &BeadConditions, pause: &Pause) -> Self {
        let idle_s = pause.idle.secs().max(0.0);
        let previous_flow_ratio = (pause.flow_before / laid.flow).max(0.0);
        let first_flow_s = parameters.delay_s(idle_s, laid.flow.get());
        let remaining_flow_ratio =
            previous_flow_ratio * parameters.remaining_flow(idle_s + first_flow_s);
        let goes_at = 0.5 * laid.min_speed_ratio;
        let moves_s = if remaining_flow_ratio >= goes_at {
            0.0
        } else {
            first_flow_s
                + parameters.rise_s * libm::log((1.0 - remaining_flow_ratio) / (1.0 - goes_at))
        };
        Self {
            parameters: *parameters,
            previous_flow_ratio,
            idle_s,
            min_speed_ratio: laid.min_speed_ratio,
            robot_lag: laid.robot_lag,
            first_flow_s,
            remaining_flow_ratio,
            robot_s: (moves_s - laid.robot_lag.secs()).max(0.0),
        }
    }

    /// Time from the command to the first flow.
    pub fn first_flow(&self) -> Span {
        Span::from_secs(self.first_flow_s)
    }

    /// Time from the command to the robot's first setpoint: how long it waits at its position, or how
    /// much earlier the pump has to be commanded.
    pub fn robot_start(&self) -> Span {
        Span::from_secs(self.robot_s)
    }

    /// Flow over the demanded flow, a time after the command.
    pub fn flow_ratio(&self, since: Span) -> f64 {
        let since_s = since.secs();
        let past_s = since_s - self.first_flow_s;
        if past_s < 0.0 {
            return self.previous_flow_ratio
                * self.parameters.remaining_flow(self.idle_s + since_s);
        }
        1.0 - (1.0 - self.remaining_flow_ratio) * libm::exp(-past_s / self.parameters.rise_s)
    }

    /// Setpoint of the robot over its start speed, a time after the command; ahead of the flow by its
    /// lag.
    pub fn speed_ratio(&self, since: Span) -> f64 {
        if since.secs() < self.robot_s {
            0.0
        } else {
            self.flow_ratio(since + self.robot_lag).clamp(self.min_speed_ratio, 1.0)
        }
    }
}
