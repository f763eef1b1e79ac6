//! What every law of the pressure loop keeps of its calls: the times of
//! readings and commands, and the command in force.

use super::kalman::Kalman;
use super::{Command, Refused};
use crate::core::time::{Span, Stamp};
use crate::core::units::{MPa, Rpm};
use crate::extruder::limits::{CommandLimit, CommandLimits};

/// What runs where a law takes over: the pressure, what is wanted, and the
/// screw's speed. The law's first command at the same target is that speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Running {
    /// Pressure at the nozzle.
    pub pressure: MPa,
    /// The target until now.
    pub target: MPa,
    /// Speed of the screw.
    pub speed: Rpm,
}

/// The largest size of a reading that laws take.
pub const MOST: MPa = MPa::constant(1e6);

/// Longer than anything runs \[s\].
const EVER_S: f64 = 1e9;

/// The times of a law's calls, and the command in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calls {
    read: Option<Stamp>,
    stepped: Option<Stamp>,
    last: Command,
}

impl Calls {
    /// Before the first call.
    pub fn new(speed: Rpm) -> Self {
        let last = Command { speed, limit: CommandLimit::None };
        Self { read: None, stepped: None, last }
    }

    /// Takes note of a reading, and gives the time since the last \[s\].
    pub fn read(&mut self, now: Stamp, pressure: MPa) -> Result<f64, Refused> {
        let since = self.read.map_or(0.0, |last| (now - last).secs());
        if since < 0.0 {
            return Err(Refused::Late { late_s: -since });
        }
        if pressure.abs() > MOST {
            return Err(Refused::Implausible { found: pressure, most: MOST });
        }
        self.read = Some(now);
        Ok(since)
    }

    /// Takes a reading into a filter.
    pub fn hear(&mut self, now: Stamp, pressure: MPa, kalman: &mut Kalman) -> Result<(), Refused> {
        self.read(now, pressure)?;
        kalman.step(pressure);
        Ok(())
    }

    /// The time since the last command \[s\]: 0 at the first call, none where
    /// the call is not after the last.
    pub fn begin(&mut self, now: Stamp) -> Option<f64> {
        match self.stepped {
            None => {
                self.stepped = Some(now);
                Some(0.0)
            }
            Some(last) if now > last => {
                self.stepped = Some(now);
                Some((now - last).secs())
            }
            Some(_) => None,
        }
    }

    /// Takes note of a demand, and gives the command for it.
    pub fn command(&mut self, limits: &CommandLimits, demand_rpm: f64, dt_s: f64) -> Command {
        // The first command may come any time after the speed that ran.
        let dt = Span::from_secs(if dt_s > 0.0 { dt_s } else { EVER_S });
        let (speed, limit) = limits.apply(demand_rpm, self.last.speed.get(), dt);
        self.last = Command { speed: Rpm::new(speed).unwrap_or_default(), limit };
        self.last
    }

    /// Takes note that another speed is in force.
    pub fn settle(&mut self, applied: Rpm) {
        self.last.speed = applied;
    }

    /// The command in force.
    pub const fn last(&self) -> Command {
        self.last
    }
}

/// Keeps what a law gathers within the numbers.
pub fn sane(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(-1e18, 1e18) }
}
