//! Smith predictor (Smith 1957), and PI control on its prediction: the measured pressure plus
//! the effect of the commands within the dead time. Ma et al. 2026, eq. (8).

use super::call_times::{CallTimes, InitialState};
use super::command_history::CommandHistory;
use super::kalman::{Kalman, PressureNoise};
use super::pi::{PiState, PressurePiGains};
use super::reference::Reference;
use super::{Fopdt, PressureController, ReadingRefused, ScrewCommand};
use crate::core::{MPa, Rpm, Stamp};
use crate::extruder::limits::CommandLimits;

/// Predicts the effect of the commands within the dead time.
#[derive(Debug, Clone, PartialEq)]
pub struct SmithPredictor {
    history: CommandHistory,
    dead_time_s: f64,
}

impl SmithPredictor {
    /// As if the speed had always been commanded.
    pub fn new(model: &Fopdt, speed_rpm: f64) -> Self {
        let dead_time_s = model.dead_time_s();
        Self { history: CommandHistory::new(model, dead_time_s, speed_rpm), dead_time_s }
    }

    /// Predicted change of the pressure over the dead time from now \[MPa\].
    pub fn pending_change(&self, now: Stamp) -> f64 {
        let at_s = now.secs();
        self.history.pressure_at(at_s) - self.history.pressure_at(at_s - self.dead_time_s)
    }

    /// Records a command from now on.
    pub fn commanded(&mut self, now: Stamp, speed: Rpm) {
        self.history.push(now.secs(), speed.get());
    }
}

/// Control with two degrees of freedom: the inverse of the model's lag along a reference that
/// lags behind the target, and PI control of the predicted pressure about that reference.
#[derive(Debug, Clone, PartialEq)]
pub struct SmithPi {
    model: Fopdt,
    limits: CommandLimits,
    kalman: Kalman,
    smith: SmithPredictor,
    reference: Reference,
    state: PiState,
    calls: CallTimes,
}

impl SmithPi {
    /// Takes over bumplessly. The reference lags behind the target by `reference_s`.
    pub fn new(
        model: Fopdt,
        gains: PressurePiGains,
        reference_s: f64,
        noise: PressureNoise,
        limits: CommandLimits,
        running: InitialState,
    ) -> Self {
        let steady = running.pressure.get() / model.gain();
        Self {
            model,
            limits,
            kalman: Kalman::new(noise, running.pressure),
            smith: SmithPredictor::new(&model, running.speed.get()),
            reference: Reference::new(reference_s, model.lag_s(), running),
            state: PiState::new(gains, running.speed.get() - steady, running.speed),
            calls: CallTimes::new(running.speed),
        }
    }
}

impl PressureController for SmithPi {
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused> {
        self.calls.filter(now, pressure, &mut self.kalman)
    }

    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand {
        let Some(dt_s) = self.calls.begin(now) else { return self.calls.last_command() };
        let segment = self.reference.step(target.get(), dt_s);
        let error = segment.from - (self.kalman.pressure() + self.smith.pending_change(now));
        let feedforward = segment.drive(self.model.lag_s()) / self.model.gain();
        let demand = self.state.step(error, feedforward, self.calls.last_command().speed, dt_s);
        let command = self.calls.command(&self.limits, demand, dt_s);
        self.smith.commanded(now, command.speed);
        command
    }

    fn settle(&mut self, now: Stamp, applied: Rpm) {
        self.calls.settle(applied);
        self.smith.commanded(now, applied);
    }
}
