//! This program's own law. Two degrees of freedom: a reference that lags
//! behind the target, driven through the inverse of the model, and feedback on
//! the pressure that is foretold a dead time ahead. Load and errors of the
//! model are observed together ([`super::multiple_model`]), so that neither is mistaken
//! for the other; corrections within the noise are made in part
//! ([`super::dead_zone`]); on its way to a target what the pressure *may* be is kept
//! from passing it. Nothing is integrated in the law, so nothing winds up: the
//! observer is told what was commanded, limits and all.

use super::call_times::{CallTimes, InitialState};
use super::command_history::CommandHistory;
use super::multiple_model::{MultipleModelFilter, PressurePrediction};
use super::reference::{Reference, ReferenceSegment};
use super::tuning::Tuning;
use super::{Fopdt, PressureController, ReadingRefused, ScrewCommand};
use crate::core::time::{Span, Stamp};
use crate::core::units::{MPa, Rpm};
use crate::extruder::limits::CommandLimits;

/// The law with its memory.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictiveController {
    model: Fopdt,
    tuning: Tuning,
    limits: CommandLimits,
    history: CommandHistory,
    filter: MultipleModelFilter,
    reference: Reference,
    calls: CallTimes,
    /// How much of what ran before is still kept in place of the tunnel.
    takeover_decay: f64,
}

impl PredictiveController {
    /// Takes over from what runs, without a bump: what the pressure differs
    /// from the model is taken for a load.
    pub fn new(model: Fopdt, tuning: Tuning, limits: CommandLimits, running: InitialState) -> Self {
        let speed = running.speed.get();
        let load = running.pressure.get() - model.gain() * speed;
        Self {
            model,
            tuning,
            limits,
            history: CommandHistory::new(
                &model,
                MultipleModelFilter::lookback_s(&model, &tuning),
                speed,
            ),
            filter: MultipleModelFilter::new(&model, tuning, load),
            reference: Reference::new(tuning.reference_s, model.lag_s(), running),
            calls: CallTimes::new(running.speed),
            takeover_decay: 1.0,
        }
    }

    /// What is known of the process and where it is going, as of `now`.
    pub fn prediction(&self, now: Stamp) -> PressurePrediction {
        self.filter.predict(&self.history.at(now.secs()).lags)
    }

    /// The dead time as far as it is known \[s\].
    pub fn dead_time_s(&self) -> f64 {
        self.filter.dead_time_s()
    }

    /// The drive \[MPa\] that brings a foretold pressure to another in the time
    /// until the next command.
    fn drive(&self, prediction: &PressurePrediction, wanted: f64, period_s: f64) -> f64 {
        let kept = libm::exp(-period_s / (self.model.lag_s() * prediction.lag));
        ((wanted - kept * prediction.pressure) / (1.0 - kept) - prediction.load) / prediction.gain
    }

    /// What is left uncorrected of the load and of the gain's error \[MPa\].
    fn uncorrected(&self, prediction: &PressurePrediction, target: f64) -> f64 {
        let needed = (target - prediction.load) / prediction.gain - target;
        (self.tuning.zone.applied(needed) - needed) * prediction.gain * (1.0 - self.takeover_decay)
    }

    /// The drive that keeps what the pressure may be from passing the target;
    /// none where the reference has arrived.
    fn bound(&self, prediction: &PressurePrediction, way: &ReferenceSegment) -> Option<(f64, f64)> {
        let to_go = way.target - way.from;
        if to_go.abs() <= self.tuning.sigma() {
            return None;
        }
        let sign = to_go.signum();
        let may_be = prediction.higher(sign * self.tuning.caution_sigmas);
        let top = way.target + sign * self.tuning.margin;
        Some((sign, self.drive(&may_be, top, way.period_s)))
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
        let way = self.reference.step(target.get(), dt_s);
        let prediction = self.prediction(now);
        let left = self.uncorrected(&prediction, way.target);
        let closing = libm::exp(-way.period_s / self.tuning.feedback_s);
        let wanted = way.to + left + closing * (prediction.pressure - way.from - left);
        let mut drive = self.drive(&prediction, wanted, way.period_s);
        if let Some((sign, bound)) = self.bound(&prediction, &way) {
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
