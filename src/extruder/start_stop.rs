//! Starts and stops of a bead: when the pump must run so that the flow begins as the robot leaves,
//! and where it must stop so that the flow after the stop fills the rest of the bead.
//!
//! While an extruder stands, melt recedes from its nozzle, and a start fills the void before
//! anything flows: the first flow is delayed by a time that grows with the idle time. After a stop
//! melt under pressure drools out. bcs-thesis, sections 1.3.3 and 1.3.4: dwell times that are fixed leave
//! "bulging if the residence time is low, or a void if the residence time
//! is high".
//!
//! ```text
//! start  q(t) = Q·(1 − e^(−(t − d)/T)),  d = L + V(idle)/Q,  V(idle) = V∞·(1 − e^(−idle/τ))
//! stop   q(t) = Q·f(t),  f(t) = (1 − a)·e^(−(t − L')/T') + a·e^(−(t − L')/τd),  a = D/τd
//! ```
//!
//! A robot that keeps its speed minimises void plus surplus where it starts and ends at half the
//! flow. One that may slow down to a fraction m of its speed follows the flow between m and 1, and
//! starts and ends at m/2; m = 1 is the robot that keeps its speed.

mod conditions;
mod start;
mod stop;

pub use conditions::BeadConditions;
pub use start::{Pause, Start};
pub use stop::Stop;

use crate::identify::start_stop::parameters::{StartStop, StartStopError};

/// Starts and stops of one kind of bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartStopTiming {
    parameters: StartStop,
    conditions: BeadConditions,
}

impl StartStopTiming {
    /// Fails where a parameter, the flow, the speed or the speed ratio is out of range.
    pub fn new(parameters: StartStop, laid: BeadConditions) -> Result<Self, StartStopError> {
        parameters.check()?;
        let flow = ("the flow of a bead [mm³/s]", laid.flow.get());
        let speed = ("the robot's start speed [mm/s]", laid.speed.get());
        if let Some((what, value)) = [flow, speed].into_iter().find(|(_, value)| *value <= 0.0) {
            return Err(StartStopError::NotPositive { what, value });
        }
        if !(laid.min_speed_ratio > 0.0 && laid.min_speed_ratio <= 1.0) {
            return Err(StartStopError::StartSpeedFraction { value: laid.min_speed_ratio });
        }
        let robot_lag_s = laid.robot_lag.secs();
        if robot_lag_s < 0.0 {
            let what = "the robot's lag [s]";
            return Err(StartStopError::Negative { what, value: robot_lag_s });
        }
        Ok(Self { parameters, conditions: laid })
    }

    /// Parameters of the extruder.
    pub const fn parameters(&self) -> &StartStop {
        &self.parameters
    }

    /// Conditions of the bead.
    pub const fn conditions(&self) -> &BeadConditions {
        &self.conditions
    }

    /// The start after a pause of the pump.
    pub fn start(&self, pause: &Pause) -> Start {
        Start::after(&self.parameters, &self.conditions, pause)
    }

    /// The stop of a bead with a steady flow.
    pub fn stop(&self) -> Stop {
        Stop::of(&self.parameters, &self.conditions)
    }
}

#[cfg(test)]
mod tests;
