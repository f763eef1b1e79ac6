//! The start of a bead.

use super::conditions::Laid;
use crate::core::time::Span;
use crate::core::units::Mm3PerS;
use crate::identify::start_stop::parameters::StartStop;

/// What came before a start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pause {
    /// From the command to stop until the command to run.
    pub idle: Span,
    /// Flow before the stop; what still drools of it comes with the new flow.
    pub before: Mm3PerS,
}

/// A start, from the moment when the pump is told to run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    parameters: StartStop,
    before_share: f64,
    idle_s: f64,
    least_share: f64,
    robot_lag: Span,
    first_flow_s: f64,
    /// What still comes of the flow before as the first flow comes, as a share
    /// of the flow that is wanted.
    left_share: f64,
    robot_s: f64,
}

impl Start {
    pub(super) fn after(parameters: &StartStop, laid: &Laid, pause: &Pause) -> Self {
        let idle_s = pause.idle.secs().max(0.0);
        let before_share = (pause.before / laid.flow).max(0.0);
        let first_flow_s = parameters.delay_s(idle_s, laid.flow.get());
        let left_share = before_share * parameters.falling(idle_s + first_flow_s);
        let goes_at = 0.5 * laid.least_share;
        let moves_s = if left_share >= goes_at {
            0.0
        } else {
            first_flow_s + parameters.rise_s * libm::log((1.0 - left_share) / (1.0 - goes_at))
        };
        Self {
            parameters: *parameters,
            before_share,
            idle_s,
            least_share: laid.least_share,
            robot_lag: laid.robot_lag,
            first_flow_s,
            left_share,
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
    pub fn robot(&self) -> Span {
        Span::from_secs(self.robot_s)
    }

    /// The flow so long after the command, as a share of the flow that is
    /// wanted.
    pub fn flow_share(&self, since: Span) -> f64 {
        let since_s = since.secs();
        let past_s = since_s - self.first_flow_s;
        if past_s < 0.0 {
            return self.before_share * self.parameters.falling(self.idle_s + since_s);
        }
        1.0 - (1.0 - self.left_share) * libm::exp(-past_s / self.parameters.rise_s)
    }

    /// Speed that the robot is told so long after the command, as a share of its
    /// start speed; by its lag ahead of the flow.
    pub fn robot_share(&self, since: Span) -> f64 {
        if since.secs() < self.robot_s {
            0.0
        } else {
            self.flow_share(since + self.robot_lag).clamp(self.least_share, 1.0)
        }
    }
}
