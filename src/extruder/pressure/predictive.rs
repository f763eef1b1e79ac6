//! Predictive control with two degrees of freedom: a reference that lags behind the target,
//! followed by the inverse of the model, and feedback on the pressure predicted a dead time
//! ahead. Load and errors of the model are estimated together ([`super::multiple_model`]), so
//! that neither is attributed to the other; corrections within the noise are applied in part
//! ([`super::dead_zone`]); on the way to a target the upper bound of the pressure does not pass
//! it. The controller has no integrator and cannot wind up: the observer uses the applied
//! commands.

use super::call_times::{CallTimes, InitialState};
use super::command_history::CommandHistory;
use super::multiple_model::{MultipleModelFilter, PressurePrediction};
use super::reference::{Reference, ReferenceSegment};
use super::tuning::Tuning;
use super::{Fopdt, PressureController, ReadingRefused, ScrewCommand};
use crate::core::{MPa, Rpm, Span, Stamp};
use crate::extruder::limits::CommandLimits;

/// The controller with its state.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictiveController {
    model: Fopdt,
    tuning: Tuning,
    limits: CommandLimits,
    history: CommandHistory,
    filter: MultipleModelFilter,
    reference: Reference,
    calls: CallTimes,
    /// Weight of the speed at takeover, in place of the dead zone.
    takeover_decay: f64,
}

impl PredictiveController {
    /// Takes over bumplessly: the difference of the pressure from the model is attributed to a
    /// load.
    pub fn new(model: Fopdt, tuning: Tuning, limits: CommandLimits, running: InitialState) -> Self {
        let speed = running.speed.get();
        let load = running.pressure.get() - model.gain() * speed;
        let lookback_s = MultipleModelFilter::lookback_s(&model, &tuning);
        Self {
            model,
            tuning,
            limits,
            history: CommandHistory::new(&model, lookback_s, speed),
            filter: MultipleModelFilter::new(&model, tuning, load),
            reference: Reference::new(tuning.reference_s, model.lag_s(), running),
            calls: CallTimes::new(running.speed),
            takeover_decay: 1.0,
        }
    }

    /// The prediction as of `now`.
    pub fn prediction(&self, now: Stamp) -> PressurePrediction {
        self.filter.predict(&self.history.at(now.secs()).lags)
    }

    /// The estimated dead time \[s\].
    pub fn dead_time_s(&self) -> f64 {
        self.filter.dead_time_s()
    }

    /// The drive \[MPa\] that takes the predicted pressure to another in the time until the next
    /// command.
    fn drive(&self, prediction: &PressurePrediction, target: f64, period_s: f64) -> f64 {
        let kept = libm::exp(-period_s / (self.model.lag_s() * prediction.lag));
        ((target - kept * prediction.pressure) / (1.0 - kept) - prediction.load) / prediction.gain
    }

    /// The part of load and gain error that the dead zone leaves uncorrected \[MPa\].
    fn uncorrected(&self, prediction: &PressurePrediction, target: f64) -> f64 {
        let needed = (target - prediction.load) / prediction.gain - target;
        (self.tuning.zone.applied(needed) - needed) * prediction.gain * (1.0 - self.takeover_decay)
    }

    /// Direction and limit of the drive, so that the upper bound of the pressure does not pass
    /// the target; none where the reference has arrived.
    fn bound(&self, ahead: &PressurePrediction, segment: &ReferenceSegment) -> Option<(f64, f64)> {
        let to_go = segment.target - segment.from;
        if to_go.abs() <= self.tuning.sigma() {
            return None;
        }
        let sign = to_go.signum();
        let bound = ahead.higher(sign * self.tuning.caution_sigmas);
        let top = segment.target + sign * self.tuning.margin;
        Some((sign, self.drive(&bound, top, segment.period_s)))
    }
}

impl PressureController for PredictiveController {
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused> {
        let dt_s = self.calls.read(now, pressure)?;
        self.filter.update(&self.history, now.secs(), dt_s, pressure.get());
        Ok(())
    }

    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand {
        let Some(dt_s) = self.calls.begin(now) else { return self.calls.last_command() };
        self.takeover_decay *= libm::exp(-dt_s / self.tuning.return_s);
        let segment = self.reference.step(target.get(), dt_s);
        let prediction = self.prediction(now);
        let left = self.uncorrected(&prediction, segment.target);
        let closing = libm::exp(-segment.period_s / self.tuning.feedback_s);
        let next = segment.to + left + closing * (prediction.pressure - segment.from - left);
        let mut drive = self.drive(&prediction, next, segment.period_s);
        if let Some((sign, bound)) = self.bound(&prediction, &segment) {
            drive = sign * (sign * drive).min(sign * bound);
        }
        let command = self.calls.command(&self.limits, drive / self.model.gain(), dt_s);
        self.history.push(now.secs(), command.speed.get());
        command
    }

    fn settle(&mut self, now: Stamp, applied: Rpm) {
        self.calls.settle(applied);
        self.history.push(now.secs(), applied.get());
    }

    fn preview(&self) -> Span {
        Span::from_secs(self.filter.dead_time_s() + self.reference.lead_s())
    }
}
