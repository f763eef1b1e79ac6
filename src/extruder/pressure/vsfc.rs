//! Variable-structure feedback on a Smith predictor around an inverse-model feedforward, as Ma
//! et al. 2026, eqs. (6) to (10): the integral gain is zero while the error is within the noise,
//! reduced in a zone around it, and full beyond.

use super::call_times::{CallTimes, InitialState, bounded};
use super::kalman::{Kalman, PressureNoise};
use super::reference::FIRST_PERIOD_S;
use super::smith::SmithPredictor;
use super::{Fopdt, PressureController, PressureError, ReadingRefused, ScrewCommand, within};
use crate::core::{MPa, Rpm, Stamp};
use crate::extruder::limits::CommandLimits;

/// Gains and zones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VsfcGains {
    kp: f64,
    ki: f64,
    creep: f64,
    dead_zone: f64,
    weak_zone: f64,
    return_s: f64,
}

impl VsfcGains {
    /// From the gains \[rpm/MPa, rpm/(MPa·s)\], the fraction of the integral gain in the weak
    /// zone, and the standard deviation of the noise: the dead zone is three of it, the weak
    /// zone six. Within the dead zone the integral decays with 5 s (fitted; the
    /// paper gives none).
    pub fn new(kp: f64, ki: f64, creep: f64, sigma: MPa) -> Result<Self, PressureError> {
        within("the proportional gain [rpm/MPa]", kp, 0.0..=1e9, "between 0 and 1e9")?;
        within("the integral gain [rpm/(MPa·s)]", ki, 0.0..=1e9, "between 0 and 1e9")?;
        within("the integral's fraction in the weak zone", creep, 0.0..=1.0, "between 0 and 1")?;
        within("the noise [MPa]", sigma.get(), 0.0..=1e3, "between 0 and 1000")?;
        let sigma = sigma.get();
        let (dead_zone, weak_zone) = (3.0 * sigma, 6.0 * sigma);
        Ok(Self { kp, ki, creep, dead_zone, weak_zone, return_s: 5.0 })
    }

    /// Gains that reproduce the published overshoot and rise time (fitted; the paper gives
    /// none), for a static gain of 1 MPa/rpm and this noise.
    pub fn ma2026(noise: PressureNoise) -> Result<Self, PressureError> {
        Self::new(0.816, 1.19, 0.3, noise.sigma())
    }

    /// The integral gain at an error. Ma et al. 2026, eq. (10).
    fn ki_at(&self, error: f64) -> f64 {
        let size = error.abs();
        if size < self.dead_zone {
            0.0
        } else if size < self.weak_zone {
            self.creep * self.ki
        } else {
            self.ki
        }
    }
}

/// The controller with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct Vsfc {
    gains: VsfcGains,
    gain: f64,
    limits: CommandLimits,
    kalman: Kalman,
    smith: SmithPredictor,
    integral: f64,
    calls: CallTimes,
    demand: f64,
}

impl Vsfc {
    /// Takes over without a step of the command (bumpless transfer): the integral makes the first
    /// command the running speed.
    pub fn new(
        model: Fopdt,
        gains: VsfcGains,
        noise: PressureNoise,
        limits: CommandLimits,
        running: InitialState,
    ) -> Self {
        let error = running.target.get() - running.pressure.get();
        let feedforward = running.target.get() / model.gain();
        // The first step already integrates over FIRST_PERIOD_S; that increment is subtracted, so
        // that the first command is the running speed.
        let first_correction = gains.kp * error + gains.ki_at(error) * error * FIRST_PERIOD_S;
        Self {
            gains,
            gain: model.gain(),
            limits,
            kalman: Kalman::new(noise, running.pressure),
            smith: SmithPredictor::new(&model, running.speed.get()),
            integral: running.speed.get() - feedforward - first_correction,
            calls: CallTimes::new(running.speed),
            demand: running.speed.get(),
        }
    }

    /// Integrates over the time since the last command; the first command over its own period.
    fn integrate(&mut self, error: f64, dt_s: f64) {
        if error.abs() < self.gains.dead_zone {
            self.integral *= libm::exp(-dt_s / self.gains.return_s);
        }
        let dt_s = if dt_s > 0.0 { dt_s } else { FIRST_PERIOD_S };
        let increment = self.gains.ki_at(error) * error * dt_s;
        // The integrator is frozen against a limit.
        let against = self.demand - self.calls.last_command().speed.get();
        if increment * against <= 0.0 {
            self.integral = bounded(self.integral + increment);
        }
    }
}

impl PressureController for Vsfc {
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused> {
        self.calls.filter(now, pressure, &mut self.kalman)
    }

    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand {
        let Some(dt_s) = self.calls.begin(now) else { return self.calls.last_command() };
        let error = target.get() - (self.kalman.pressure() + self.smith.pending_change(now));
        self.integrate(error, dt_s);
        self.demand = bounded(target.get() / self.gain + self.gains.kp * error + self.integral);
        let command = self.calls.command(&self.limits, self.demand, dt_s);
        self.smith.commanded(now, command.speed);
        command
    }

    fn settle(&mut self, now: Stamp, applied: Rpm) {
        self.calls.settle(applied);
        self.smith.commanded(now, applied);
    }
}
