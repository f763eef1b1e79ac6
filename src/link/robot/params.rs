//! Parameters of a robot: its limits, the dynamics of its speed, the length of its beads.

use super::numbers::on_wire;
use crate::core::{Mm, MmPerS, MmPerS2, RobotLimits};

/// Parameters of a robot on the link.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotParams {
    /// Its name, one word.
    pub name: String,
    /// Slowest setpoint that it accepts.
    pub min: MmPerS,
    /// Fastest setpoint that it accepts.
    pub max: MmPerS,
    /// Speed in `HOLD`, after the last setpoint has expired.
    pub hold: MmPerS,
    /// Speed at the start of a bead.
    pub start: MmPerS,
    /// Bandwidth of its speed loop, a first-order lag \[Hz\].
    pub bandwidth_hz: f64,
    /// Largest acceleration along the path.
    pub accel: MmPerS2,
    /// Length of a bead, after which the mode is `IDLE`; `None` for an endless bead.
    pub bead: Option<Mm>,
    /// Height of the nozzle before the first bead.
    pub z: Mm,
    /// Reading of its own clock at the start of the run \[ms\]. It is independent of the PC's
    /// clock.
    pub clock_start_ms: u64,
}

impl Default for RobotParams {
    fn default() -> Self {
        Self {
            name: "truebead-sim".to_owned(),
            min: MmPerS::constant(60.0),
            max: MmPerS::constant(150.0),
            hold: MmPerS::constant(60.0),
            start: MmPerS::constant(112.5),
            bandwidth_hz: 10.0,
            accel: MmPerS2::constant(2000.0),
            bead: None,
            z: Mm::ZERO,
            clock_start_ms: 0,
        }
    }
}

/// A parameter of a robot is not valid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} must be {must}, found {found}")]
pub struct ParamError {
    /// Name of the parameter.
    pub what: &'static str,
    /// What it must be.
    pub must: String,
    /// Its value.
    pub found: String,
}

impl RobotParams {
    /// The parameters after a check, with speeds rounded as on the link.
    pub(super) fn checked(mut self) -> Result<Self, ParamError> {
        let speeds = [&mut self.min, &mut self.max, &mut self.hold, &mut self.start];
        for speed in speeds {
            *speed = on_wire(*speed);
        }
        let (min, max) = (self.min, self.max);
        let refuse = |what, must: String, found: String| Err(ParamError { what, must, found });
        if min <= MmPerS::ZERO {
            return refuse("the slowest speed", "above zero".to_owned(), min.to_string());
        }
        if max < min {
            return refuse("the fastest speed", format!("at least {min}"), max.to_string());
        }
        if self.start < min || self.start > max {
            let must = format!("within {min} to {max}");
            return refuse("the start speed", must, self.start.to_string());
        }
        if self.hold < MmPerS::ZERO || self.hold > max {
            return refuse("the hold speed", format!("within 0 to {max}"), self.hold.to_string());
        }
        if !(self.bandwidth_hz > 0.0 && self.bandwidth_hz.is_finite()) {
            let found = format!("{} Hz", self.bandwidth_hz);
            return refuse("the bandwidth", "above zero".to_owned(), found);
        }
        if self.accel <= MmPerS2::ZERO {
            return refuse("the acceleration", "above zero".to_owned(), self.accel.to_string());
        }
        match self.bead {
            Some(bead) if bead <= Mm::ZERO => {
                refuse("the length of a bead", "above zero".to_owned(), bead.to_string())
            }
            _ => Ok(self),
        }
    }

    /// The limits that it sends in its `HELLO`.
    pub(super) fn limits(&self) -> RobotLimits {
        RobotLimits {
            name: self.name.clone(),
            min_mm_per_s: self.min,
            max_mm_per_s: self.max,
            hold_mm_per_s: self.hold,
        }
    }
}
