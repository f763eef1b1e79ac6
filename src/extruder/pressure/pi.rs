//! PI control with back-calculation: the difference of applied and demanded command is fed back
//! into the integrator (Åström and Hägglund 2006, 3.5). The baseline of Ma et al. 2026.

use super::call_times::{CallTimes, InitialState, bounded};
use super::kalman::{Kalman, PressureNoise};
use super::{PressureController, PressureError, ReadingRefused, ScrewCommand, within};
use crate::core::{MPa, Rpm, Stamp};
use crate::extruder::limits::CommandLimits;

/// Gains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressurePiGains {
    kp: f64,
    ki: f64,
    tracking_s: f64,
}

impl PressurePiGains {
    /// Gains that reproduce the published overshoot and rise time (fitted; the paper gives
    /// none), for a static gain of 1 MPa/rpm.
    pub const MA2026: Self = Self { kp: 1.5, ki: 1.5, tracking_s: 1.0 };

    /// From the proportional gain \[rpm/MPa\], the integral time \[s\] and the tracking time of
    /// the back-calculation \[s\].
    pub fn new(kp: f64, integral_s: f64, tracking_s: f64) -> Result<Self, PressureError> {
        let wanted = "above 1e-3 and at most 1e6";
        within("the proportional gain [rpm/MPa]", kp, 0.0..=1e9, "between 0 and 1e9")?;
        within("the integral time [s]", integral_s, 1e-3..=1e6, wanted)?;
        within("the tracking time [s]", tracking_s, 1e-3..=1e6, wanted)?;
        Ok(Self { kp, ki: kp / integral_s, tracking_s })
    }
}

/// The state of PI control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiState {
    gains: PressurePiGains,
    integral: f64,
    /// The last error \[MPa\] and the demand for it \[rpm\].
    error: f64,
    demand: f64,
}

impl PiState {
    /// With an integral \[rpm\], at a running speed.
    pub const fn new(gains: PressurePiGains, integral: f64, running: Rpm) -> Self {
        Self { gains, integral, error: 0.0, demand: running.get() }
    }

    /// The demand \[rpm\] for an error \[MPa\] with a feedforward \[rpm\], `dt_s` after the last
    /// one, whose demand was applied as `applied`.
    pub fn step(&mut self, error: f64, feedforward: f64, applied: Rpm, dt_s: f64) -> f64 {
        let lost = applied.get() - self.demand;
        let increment = self.gains.ki * self.error + lost / self.gains.tracking_s;
        self.integral = bounded(self.integral + increment * dt_s);
        self.error = error;
        self.demand = bounded(feedforward + self.gains.kp * error + self.integral);
        self.demand
    }
}

/// PI control of the filtered pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct PressurePi {
    limits: CommandLimits,
    kalman: Kalman,
    state: PiState,
    calls: CallTimes,
}

impl PressurePi {
    /// Takes over bumplessly.
    pub fn new(
        gains: PressurePiGains,
        noise: PressureNoise,
        limits: CommandLimits,
        running: InitialState,
    ) -> Self {
        let error = running.target.get() - running.pressure.get();
        let integral = running.speed.get() - gains.kp * error;
        Self {
            limits,
            kalman: Kalman::new(noise, running.pressure),
            state: PiState::new(gains, integral, running.speed),
            calls: CallTimes::new(running.speed),
        }
    }
}

impl PressureController for PressurePi {
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused> {
        self.calls.filter(now, pressure, &mut self.kalman)
    }

    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand {
        let Some(dt_s) = self.calls.begin(now) else { return self.calls.last_command() };
        let error = target.get() - self.kalman.pressure();
        let demand = self.state.step(error, 0.0, self.calls.last_command().speed, dt_s);
        self.calls.command(&self.limits, demand, dt_s)
    }

    fn settle(&mut self, _now: Stamp, applied: Rpm) {
        self.calls.settle(applied);
    }
}
