//! The times of readings and commands and the command in force, of every controller of the
//! pressure loop.

use super::kalman::Kalman;
use super::{ReadingRefused, ScrewCommand};
use crate::core::{MPa, Rpm, Span, Stamp};
use crate::extruder::limits::{CommandLimit, CommandLimits};

/// Pressure, target and screw speed at takeover. The first command at the same target is that
/// speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialState {
    /// Pressure at the nozzle.
    pub pressure: MPa,
    /// The target until now.
    pub target: MPa,
    /// Speed of the screw.
    pub speed: Rpm,
}

/// Largest magnitude of a reading that is accepted, as a check of the unit.
pub const MAX_READING: MPa = MPa::constant(1e6);

/// Time since the last command at the first one \[s\]: long enough that the rate does not limit.
const FIRST_STEP_S: f64 = 1e9;

/// The times of a controller's calls, and the command in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CallTimes {
    read_at: Option<Stamp>,
    step_at: Option<Stamp>,
    last_command: ScrewCommand,
}

impl CallTimes {
    /// Before the first call.
    pub fn new(speed: Rpm) -> Self {
        let last = ScrewCommand { speed, limit: CommandLimit::None };
        Self { read_at: None, step_at: None, last_command: last }
    }

    /// Records a reading; returns the time since the last \[s\].
    pub fn read(&mut self, now: Stamp, pressure: MPa) -> Result<f64, ReadingRefused> {
        let since = self.read_at.map_or(0.0, |last| (now - last).secs());
        if since < 0.0 {
            return Err(ReadingRefused::OutOfOrder(-since));
        }
        if pressure.abs() > MAX_READING {
            return Err(ReadingRefused::Implausible { found: pressure, most: MAX_READING });
        }
        self.read_at = Some(now);
        Ok(since)
    }

    /// Updates a filter with a reading.
    pub fn filter(
        &mut self,
        now: Stamp,
        pressure: MPa,
        kalman: &mut Kalman,
    ) -> Result<(), ReadingRefused> {
        self.read(now, pressure)?;
        kalman.step(pressure);
        Ok(())
    }

    /// The time since the last command \[s\]: 0 at the first call, none where
    /// the call is not after the last.
    pub fn begin(&mut self, now: Stamp) -> Option<f64> {
        if self.step_at.is_some_and(|last| now <= last) {
            return None;
        }
        Some(self.step_at.replace(now).map_or(0.0, |last| (now - last).secs()))
    }

    /// Records a demand; returns the command for it.
    pub fn command(&mut self, limits: &CommandLimits, demand_rpm: f64, dt_s: f64) -> ScrewCommand {
        let dt = Span::from_secs(if dt_s > 0.0 { dt_s } else { FIRST_STEP_S });
        let (speed, limit) = limits.apply(demand_rpm, self.last_command.speed.get(), dt);
        self.last_command = ScrewCommand { speed: Rpm::new(speed).unwrap_or_default(), limit };
        self.last_command
    }

    /// Records that another speed is in force.
    pub fn settle(&mut self, applied: Rpm) {
        self.last_command.speed = applied;
    }

    /// Leaves out the time until now: it was a hold, with a speed in force.
    pub fn resume(&mut self, now: Stamp, applied: Rpm) {
        self.step_at = self.step_at.map(|last| last.max(now));
        self.settle(applied);
    }

    /// The command in force.
    pub const fn last_command(&self) -> ScrewCommand {
        self.last_command
    }
}

/// Keeps an integral finite.
pub fn bounded(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(-1e18, 1e18) }
}
