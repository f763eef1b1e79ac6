//! Predictive control with two degrees of freedom. The feedforward inverts the model. The feedback is
//! PI control on the feedforward's predicted pressure less the measured one, with four tenths of a
//! Smith correction. The model makes the feedforward, not the feedback: a plant that is not the
//! model costs little more than with PI control (`docs/src/explanation/pressure-control.md`).
//!
//! - A step of the target goes only part of the way until the pressure has answered
//!   ([`super::target_step`]). The answer shows the plant's gain, lag and dead time, and the rest of
//!   the way is gone with these ([`super::plant_model`]).
//! - A step of the load is answered at once by the model ([`super::load`]); a second one not before
//!   the feedback has had its time, so that a wrong gain does not make it swing.
//! - While nothing has stepped, an error within the noise is corrected in part: the screw stays quiet.
//!
//! The feedback has no windup: what a limit keeps from the screw counts as feedforward, and the
//! feedback is that of the pressure which the applied commands should have given.

use super::call_times::{CallTimes, InitialState, bounded};
use super::command_history::CommandHistory;
use super::load::Load;
use super::plant_model::{GridModel, PlantModel};
use super::residual::Residual;
use super::target_step::{Answer, TargetStep};
use super::tuning::Tuning;
use super::{Fopdt, PressureController, ReadingRefused, ScrewCommand};
use crate::core::{MPa, Rpm, Span, Stamp};
use crate::extruder::limits::CommandLimits;

/// Fraction of the corrections within the dead time that count as made. 0 is PI control, 1 Smith's
/// predictor: this one swings less with twice the gain than the first, and is quicker with a dead
/// time that is shorter than the model's than the second.
const PENDING_FRACTION: f64 = 0.4;
/// Fraction of the proportional gain within the quiet error: that of the integral in the weak zone of
/// Ma et al. 2026.
const QUIET_FRACTION: f64 = 0.3;
/// Integral time within the quiet error \[s\]: the longer period of the drift of papers.md, "002".
const QUIET_INTEGRAL_S: f64 = 60.0;
/// Time since its first answer for which a step of the target goes on, in dead times and lags
/// together. Derived: by then what the answer has changed shows by 63 %.
const ANSWERED_FOR: f64 = 1.0;
/// Time in which a pressure answers a step of its target, in dead times and lags together. Derived:
/// 98 % of the answer of a plant that is twice as slow as the model.
const ANSWER_WITHIN: f64 = 5.0;
/// The same where no lack of an answer is noticed: a load has come, and hides it. Derived: 63 % of the
/// answer of a plant that is twice as slow.
const HIDDEN_ANSWER_WITHIN: f64 = 2.0;
/// The same since the model, with the screw's limits, predicts an answer. Derived: less the dead time.
const ANSWER_SINCE_ASKED: f64 = 4.0;
/// Shortest such time \[s\]: a plant may be much quicker than its readings. Derived: fifty of them in
/// the loop of Ma et al. 2026.
const MIN_ANSWER_S: f64 = 1.0;
/// Standard deviations of a reading within which the filtered residual is its slow average and noise.
/// Derived: of a filtered reading, 0.58, they are five.
const NOISE_SIGMAS: f64 = 3.0;
/// Longest time between two commands that counts \[s\]. Derived: twenty periods of Ma et al. 2026;
/// a longer one is a stall.
const MAX_PERIOD_S: f64 = 1.0;
/// Dead times that are looked back. Derived: twice the longest that an answer can show, and some.
const LOOK_BACK: f64 = 5.0;

/// The controller with its state. Pressures are in MPa, and what the screw is commanded is in MPa of
/// the steady state that the model gives for it.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictiveController {
    /// The model, and all commands.
    plant: PlantModel,
    tuning: Tuning,
    /// Largest proportional gain but during a step \[rpm/MPa\].
    rest_proportional: f64,
    limits: CommandLimits,
    calls: CallTimes,
    /// The part of the feedback in them.
    fed_back: CommandHistory,
    residual: Residual,
    load: Load,
    /// Whether a step of the load was found since the last command.
    load_stepped: bool,
    step: Option<TargetStep>,
    target: f64,
    /// Distance of the target from the pressure at takeover; it decays, so that the takeover is
    /// bumpless.
    takeover_offset: f64,
    integral: f64,
    /// Until when the feedback works in full \[s\].
    awake_until_s: f64,
    /// Time of readings that were left out since the last one that was used \[s\].
    unused_s: f64,
    /// The moment that the filtered residual shows \[s\].
    shown_at_s: f64,
    period_s: f64,
}

impl PredictiveController {
    /// Takes over bumplessly: the difference of the pressure from the model is attributed to a
    /// load.
    pub fn new(model: Fopdt, tuning: Tuning, limits: CommandLimits, running: InitialState) -> Self {
        let (speed, pressure) = (running.speed.get(), running.pressure.get());
        let look_back_s = LOOK_BACK * model.dead_time_s() + tuning.periods.filter_delay_s();
        Self {
            plant: PlantModel::new(model, look_back_s, speed),
            tuning,
            rest_proportional: tuning.proportional / model.gain(),
            limits,
            calls: CallTimes::new(running.speed),
            fed_back: CommandHistory::new(&model, look_back_s, 0.0),
            residual: Residual::new(tuning.sigma),
            load: Load::new(pressure - model.gain() * speed, model.lag_s(), tuning.sigma),
            load_stepped: false,
            step: None,
            target: pressure,
            takeover_offset: running.target.get() - pressure,
            integral: 0.0,
            awake_until_s: f64::NEG_INFINITY,
            unused_s: 0.0,
            shown_at_s: f64::NEG_INFINITY,
            period_s: tuning.periods.command_s,
        }
    }

    /// Goes on after a hold in which the screw had a speed: the model has followed it, the integral
    /// leaves it out.
    pub fn resume(&mut self, now: Stamp, applied: Rpm) {
        self.calls.resume(now, applied);
        self.plant.push(now.secs(), applied.get());
    }

    fn span_s(&self) -> f64 {
        self.plant.model().dead_time_s() + self.plant.model().lag_s()
    }

    /// The pressure that the feedforward alone gives a dead time after a moment \[s\].
    fn by_feedforward(&self, at_s: f64, load: f64) -> f64 {
        self.plant.pressure_at(at_s) - self.fed_back.pressure_at(at_s) + load
    }

    /// Begins, goes on with or ends a step of the target.
    fn follow_target(&mut self, now_s: f64, target: f64) {
        let last = std::mem::replace(&mut self.target, target);
        if (target - last).abs() > self.tuning.target_step {
            let goes_on =
                |step: &TargetStep| step.answered_s.is_none() && step.goes_on_to(target, last);
            if !self.step.as_ref().is_some_and(goes_on) {
                self.begin_step(now_s);
            }
            self.awake_until_s = now_s + self.tuning.awake_s;
        }
        let hidden_s = (HIDDEN_ANSWER_WITHIN * self.span_s()).max(MIN_ANSWER_S);
        let is_over = |step: TargetStep| {
            let lasts_s = now_s - step.began_s;
            match step.answered_s {
                Some(answered_s) => now_s - answered_s > ANSWERED_FOR * self.span_s(),
                None => lasts_s > hidden_s && step.unanswered_s(now_s).is_none(),
            }
        };
        if self.step.is_some_and(is_over) {
            self.step = None;
        }
    }

    fn begin_step(&mut self, now_s: f64) {
        // What the feedback has settled at belongs to the load from now on.
        let fed_back = self.fed_back.pressure_at(now_s);
        self.load.add(-fed_back);
        self.residual.shift(-fed_back);
        self.integral -= fed_back;
        self.fed_back.restart(&self.plant.model(), 0.0);
        let commanded = self.plant.pressure_at(now_s);
        let expected = commanded + self.load.ahead(self.plant.model().dead_time_s());
        let measured = expected + self.load.average();
        self.step = Some(TargetStep::new(now_s, expected, commanded, measured));
        self.plant.begin_step(now_s);
    }

    /// Uses the model that the answer to a step has shown.
    fn adapt(&mut self, now_s: f64) {
        let Some(step) = &mut self.step else { return };
        let Some(likeliest) = self.plant.likeliest() else {
            // What a sensor is stuck at may look like a small answer for a while.
            if step.answered_s.take().is_some() {
                self.use_model(now_s, GridModel::GIVEN);
            }
            return;
        };
        step.answered_s.get_or_insert(now_s);
        self.use_model(now_s, likeliest);
    }

    /// Uses a model from now on. What the feedback has done until now belongs to that model's
    /// feedforward.
    fn use_model(&mut self, now_s: f64, model: GridModel) {
        let (before, arrived) = (self.plant.before_step(), self.plant.arrived(now_s));
        if !self.plant.adopt(model) {
            return;
        }
        // The pressure before the step stays, so that another gain changes the load.
        let load = before - self.plant.before_step();
        let change = self.plant.arrived(now_s) - arrived;
        self.load.add(load);
        self.load.shift(change);
        self.residual.shift(load + change);
        let model = self.plant.model();
        self.fed_back.restart(&model, 0.0);
        self.integral = 0.0;
        self.tuning.proportional = Tuning::proportional(&model, self.tuning.periods);
    }

    /// What the feedback adds \[MPa\], `dt_s` after the last command.
    fn feedback(&mut self, now_s: f64, dt_s: f64) -> f64 {
        let now = self.fed_back.pressure_at(now_s);
        let model = self.plant.model();
        let then = self.fed_back.pressure_at(now_s - model.dead_time_s());
        let error = -self.residual.filtered() - then - PENDING_FRACTION * (now - then);
        if error.abs() > self.tuning.quiet_error && now_s > self.awake_until_s {
            self.awake_until_s = now_s + self.tuning.awake_s;
        }
        let Tuning { mut proportional, integral_s, .. } = self.tuning;
        if self.step.is_none() {
            // More would let the noise move the screw farther than with the given model.
            proportional = proportional.min(self.rest_proportional * model.gain());
        }
        let (gain, rate) = if now_s < self.awake_until_s {
            (proportional, proportional / integral_s)
        } else {
            (QUIET_FRACTION * proportional, 1.0 / QUIET_INTEGRAL_S)
        };
        // During a step an error may be the model's, which the answer mends.
        if self.step.is_none() {
            self.integral = bounded(self.integral + rate * error * dt_s.min(MAX_PERIOD_S));
        }
        gain * error + self.integral
    }

    /// The drive \[MPa\] that takes a pressure by the commands to another until the next command,
    /// not farther beyond the other than the screw can slow down in time: until the next command
    /// changes anything, after a time h, the pressure goes on by d·h/τ from a drive that is d beyond
    /// it, and by d²/(2·r·τ) while the drive falls at a rate r.
    fn drive(&self, from: f64, to: f64) -> f64 {
        let model = self.plant.model();
        let kept = libm::exp(-self.period_s / model.lag_s());
        let rate = model.gain() * self.limits.rate_per_s();
        let (wait_s, falls_s2) = (self.period_s, 2.0 * model.lag_s() * (to - from).abs() / rate);
        let beyond = rate * ((wait_s * wait_s + falls_s2).sqrt() - wait_s);
        let sign = (to - from).signum();
        let at_once = (to - kept * from) / (1.0 - kept);
        sign * (sign * at_once).min(sign * to + beyond)
    }

    /// What the feedforward commands \[MPa\]: it takes the pressure to the target at once after a step,
    /// and along the reference else.
    fn feedforward(&self, now_s: f64) -> f64 {
        let dead_s = self.plant.model().dead_time_s();
        let load = self.load.ahead(dead_s);
        let from = self.by_feedforward(now_s, load);
        let at_once = self.step.is_some() || self.load_stepped;
        let left = if at_once { 0.0 } else { libm::exp(-self.period_s / self.tuning.reference_s) };
        let to = self.target + (from - self.target) * left;
        let next_load = self.load.ahead(dead_s + self.period_s);
        self.drive(from - load, to - next_load)
    }

    /// The residual \[MPa\]: its slow average, where the last readings do not differ from that by
    /// more than noise.
    fn shown_residual(&self) -> f64 {
        let (average, filtered) = (self.load.average(), self.residual.filtered());
        let is_noise = (filtered - average).abs() < NOISE_SIGMAS * self.residual.sigma();
        if is_noise { average } else { filtered }
    }

    /// The drive \[MPa\] within what a step of the target allows.
    fn within_step(&mut self, now_s: f64, drive: f64) -> f64 {
        let Some(mut step) = self.step.filter(|step| step.answered_s.is_none()) else {
            return drive;
        };
        let dead_s = self.plant.model().dead_time_s();
        let shown_at_s = self.shown_at_s;
        let arrived = self.plant.arrived(shown_at_s);
        let answer = Answer {
            arrived,
            arrived_before: self.plant.arrived(shown_at_s - self.tuning.periods.reading_s),
            arrived_late: self.plant.arrived(shown_at_s - dead_s),
            measured: arrived + self.load.now() + self.shown_residual(),
            sigma: self.residual.sigma(),
            lateness: (now_s - step.began_s) / (dead_s + now_s - shown_at_s),
            given_gain: self.plant.given_gain_ratio(),
        };
        let bound = step.bound(now_s, self.target, &answer);
        self.step = Some(step);
        let farthest = self.drive(self.plant.pressure_at(now_s), bound);
        let sign = step.sign(self.target);
        sign * (sign * drive).min(sign * farthest)
    }
}

impl PressureController for PredictiveController {
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused> {
        let dt_s = self.calls.read(now, pressure)?;
        self.load.advance(dt_s);
        let arrived = self.plant.arrived(now.secs());
        let residual = pressure.get() - arrived - self.load.now();
        self.unused_s += dt_s;
        if !self.residual.update(residual) {
            return Ok(());
        }
        self.shown_at_s = now.secs() - self.tuning.periods.reading_s;
        let since_s = std::mem::take(&mut self.unused_s);
        if let Some(step) = &self.step {
            let (by, size) = (pressure.get() - step.measured_before(), step.size(self.target));
            self.plant.answered(now.secs(), by, self.residual.sigma(), size);
        }
        if now.secs() < self.awake_until_s {
            self.load.follow(residual);
        } else if let Some(shown) = self.load.detect(residual, self.residual.sigma(), since_s) {
            self.residual.shift(shown);
            self.load_stepped = true;
            self.awake_until_s = now.secs() + self.tuning.awake_s;
        }
        Ok(())
    }

    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand {
        let Some(dt_s) = self.calls.begin(now) else { return self.calls.last_command() };
        if dt_s > 0.0 {
            self.period_s = dt_s.clamp(1e-4, MAX_PERIOD_S);
            self.takeover_offset *= libm::exp(-dt_s / self.plant.model().lag_s());
        }
        let now_s = now.secs();
        self.follow_target(now_s, target.get() - self.takeover_offset);
        self.adapt(now_s);
        let feedback = self.feedback(now_s, dt_s);
        let drive = self.feedforward(now_s) + feedback;
        let drive = self.within_step(now_s, drive);
        self.load_stepped = false;
        let gain = self.plant.model().gain();
        let command = self.calls.command(&self.limits, drive / gain, dt_s);
        self.plant.push(now_s, command.speed.get());
        self.fed_back.push(now_s, feedback / gain);
        command
    }

    fn settle(&mut self, now: Stamp, applied: Rpm) {
        self.calls.settle(applied);
        self.plant.push(now.secs(), applied.get());
    }

    fn is_unanswered(&self, now: Stamp) -> bool {
        let within_s = (ANSWER_WITHIN * self.span_s()).max(MIN_ANSWER_S);
        let since_asked_s = (ANSWER_SINCE_ASKED * self.span_s()).max(MIN_ANSWER_S);
        self.step.is_some_and(|step| {
            now.secs() - step.began_s > within_s
                && step.unanswered_s(now.secs()).is_some_and(|missing| missing > since_asked_s)
        })
    }

    fn preview(&self) -> Span {
        let kept = libm::exp(-self.period_s / self.tuning.reference_s);
        Span::from_secs(self.plant.model().dead_time_s() + self.period_s / (1.0 - kept))
    }
}
