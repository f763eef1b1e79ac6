//! The end of a bead.

use super::conditions::Laid;
use crate::core::time::Span;
use crate::core::units::Mm;
use crate::identify::start_stop::parameters::StartStop;

/// A stop, from the moment when the pump is told to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    parameters: StartStop,
    least_share: f64,
    robot_lag: Span,
    way: Mm,
    lasts_s: f64,
    left_mm3: f64,
}

impl Stop {
    pub(super) fn of(parameters: &StartStop, laid: &Laid) -> Self {
        let least_share = laid.least_share;
        let follows_s = parameters.falls_to_s(least_share);
        let lasts_s = parameters.falls_to_s(0.5 * least_share);
        let full_speed_s = parameters.fallen_s(follows_s) + least_share * (lasts_s - follows_s);
        let left_s = parameters.after_stop_s() - parameters.fallen_s(lasts_s);
        Self {
            parameters: *parameters,
            least_share,
            robot_lag: laid.robot_lag,
            way: laid.speed * Span::from_secs(full_speed_s),
            lasts_s,
            left_mm3: laid.flow.get() * left_s,
        }
    }

    /// How far from the end of the bead the pump is told to stop. A bead that is
    /// shorter than this has no room for an even flow.
    pub const fn way(&self) -> Mm {
        self.way
    }

    /// From the command to stop until the robot is at the end of the bead.
    pub fn lasts(&self) -> Span {
        Span::from_secs(self.lasts_s)
    }

    /// What drools out after the end of the bead \[mm³\].
    pub const fn left_mm3(&self) -> f64 {
        self.left_mm3
    }

    /// The flow so long after the command, as a share of the flow before.
    pub fn flow_share(&self, since: Span) -> f64 {
        self.parameters.falling(since.secs())
    }

    /// Speed that the robot is told so long after the command, as a share of its
    /// start speed, until it is at the end; by its lag ahead of the flow.
    pub fn robot_share(&self, since: Span) -> f64 {
        self.flow_share(since + self.robot_lag).clamp(self.least_share, 1.0)
    }
}
