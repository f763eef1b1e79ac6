//! The controller of one sub-system: reference model, feedback, estimate.

use nalgebra::Matrix4;

use super::estimate::UncertaintyEstimate;
use super::gains::{Adaptation, AdaptiveGains, EstimateBounds, GainError, ScalarPlant, check};
use crate::core::Span;

/// Time between two samples from which they are a gap, in holds: three samples may be missing.
/// Over a longer time the error is not the one that the estimate is updated for.
const MAX_GAP_HOLDS: f64 = 4.0;

/// Sampled model-reference adaptive controller of a first-order plant (Mohammadi Looey et al.
/// 2026, eqs. (8)–(10)).
///
/// The reference part of the command is exact: with the uncertainty compensated, the plant
/// follows the reference model at the samples for any hold time. The error part is the
/// continuous control law, with the estimate advanced by half a sample ([`Self::step`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MracController {
    plant: ScalarPlant,
    gains: AdaptiveGains,
    /// Time for which a command is held.
    pub(super) hold: Span,
    /// The plant and the reference model over one held command.
    state_step: f64,
    input_step: f64,
    estimate: UncertaintyEstimate,
    model: f64,
    last: Option<HeldInput>,
}

/// The input since the last step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct HeldInput {
    reference: f64,
    demanded: f64,
    applied: f64,
}

/// A command and its parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action {
    /// u: the input until the next step.
    pub command: f64,
    /// Output of the reference model now.
    pub model: f64,
    /// e = y − model.
    pub error: f64,
    /// Δ̂ now.
    pub estimate: f64,
    /// Predicted output at the end of the hold, if Δ̂ is right.
    pub predicted: f64,
}

impl MracController {
    /// A controller whose commands are held for `hold`. Fails where reference model or error are
    /// not stable, in continuous time or at that rate, and where a gain has the wrong sign.
    pub fn new(plant: ScalarPlant, gains: AdaptiveGains, hold: Span) -> Result<Self, GainError> {
        check(plant, &gains, hold)?;
        let (state_step, input_step) = plant.zero_order_hold(hold.secs());
        let (estimate, model, last) = (UncertaintyEstimate::default(), 0.0, None);
        let controller = Self { plant, gains, hold, state_step, input_step, estimate, model, last };
        let radius = controller.error_radius();
        let error = GainError::SamplingTooSlow { hold_s: hold.secs(), radius };
        if radius < 1.0 { Ok(controller) } else { Err(error) }
    }

    /// Starts in a steady state: the reference model at the measured output, and the estimate
    /// for which the applied input holds that output. The next command at the reference of
    /// [`Self::reference_for`] this output is that input (bumpless).
    pub fn start(&mut self, measured: f64, applied: f64, known: f64) {
        let bound = self.gains.safety.bound.unwrap_or(f64::MAX);
        let needed = -self.plant.state_gain_per_s / self.plant.input_gain * measured;
        let value = (needed - known - applied).clamp(-bound, bound);
        self.estimate = UncertaintyEstimate { value, slope_per_s: 0.0, last_error: None };
        self.model = measured;
        self.last = None;
    }

    /// Sets the estimate, as for the controller of the paper without adaptation.
    pub fn set_estimate(&mut self, uncertainty: f64) {
        self.estimate.value = uncertainty;
        self.estimate.slope_per_s = 0.0;
    }

    /// The reference r that holds the model at an output.
    pub fn reference_for(&self, output: f64) -> f64 {
        -self.model_pole() / self.plant.input_gain * output
    }

    /// One step, `dt` after the last one: measured output y, reference r from now on, mean of the
    /// known part w over the coming hold. A step after a gap (more than four holds) does not
    /// adapt and restarts the model at the measured output; a reading that is not finite is
    /// replaced by the model's. [`Self::settle`] sets the applied input.
    pub fn step(&mut self, measured: f64, reference: f64, known: f64, dt: Span) -> Action {
        self.advance_model(dt);
        let gap = dt.secs() > MAX_GAP_HOLDS * self.hold.secs();
        let seen = measured.is_finite();
        if gap && seen {
            self.model = measured;
            self.estimate.last_error = None;
        }
        let error = if seen { measured - self.model } else { 0.0 };
        if seen && !gap && dt > Span::ZERO && self.last.is_some() {
            self.estimate.learn(self.plant, &self.gains, error, dt.secs());
        } else {
            self.estimate.last_error = seen.then_some(error);
        }
        let hold_s = self.hold.secs();
        let acting = self.estimate.acting(self.plant, &self.gains, error, hold_s);
        let fed_back = (self.gains.feedback + self.gains.error_feedback) * error;
        let follow = self.reference_input(reference);
        let command = follow - fed_back - known - acting;
        self.last = Some(HeldInput { reference, demanded: command, applied: command });
        let output = self.model + error;
        let predicted = self.state_step * output + self.input_step * (command + known + acting);
        Action { command, model: self.model, error, estimate: self.estimate.value, predicted }
    }

    /// The input that was applied in place of the command. The reference model moves by the same
    /// difference, so that a limit causes no adaptation.
    pub fn settle(&mut self, applied: f64) {
        if let Some(held) = &mut self.last
            && applied.is_finite()
        {
            held.applied = applied;
        }
    }

    /// Steady-state errors when Δ grows by `slope` per second: of the output, c/(γ·p·b), and of
    /// the estimate; zero where the slope is estimated, infinite without adaptation. Without
    /// leakage and bounds.
    pub fn ramp_errors(&self, slope: f64) -> RampErrors {
        let output = match self.gains.adaptation {
            Adaptation::Off => slope * f64::INFINITY,
            Adaptation::Constant { .. } => {
                slope / self.gains.adaptation.rate(self.plant.input_gain)
            }
            Adaptation::Ramp { .. } => 0.0,
        };
        let pole = self.plant.pole(self.gains.feedback + self.gains.error_feedback);
        RampErrors { output, estimate: -pole / self.plant.input_gain * output }
    }

    /// The plant that it is made for.
    pub fn plant(&self) -> ScalarPlant {
        self.plant
    }

    /// Δ̂ \[unit of u\].
    pub fn estimate(&self) -> f64 {
        self.estimate.value
    }

    fn model_pole(&self) -> f64 {
        self.plant.pole(self.gains.feedback)
    }

    /// The input that takes the plant from the model's output to that of the model after the
    /// hold.
    fn reference_input(&self, reference: f64) -> f64 {
        let (kept, driven) = self.model_zero_order_hold(self.hold.secs());
        let next = kept * self.model + driven * reference;
        (next - self.state_step * self.model) / self.input_step
    }

    fn model_zero_order_hold(&self, t_s: f64) -> (f64, f64) {
        let model = ScalarPlant { state_gain_per_s: self.model_pole(), ..self.plant };
        model.zero_order_hold(t_s)
    }

    fn advance_model(&mut self, dt: Span) {
        if let Some(held) = self.last
            && dt > Span::ZERO
        {
            let (kept, driven) = self.model_zero_order_hold(dt.secs());
            let missed = self.plant.zero_order_hold(dt.secs()).1 * (held.applied - held.demanded);
            self.model = kept * self.model + driven * held.reference + missed;
        }
    }

    /// Largest eigenvalue of the error from sample to sample.
    fn error_radius(&self) -> f64 {
        let hold_s = self.hold.secs();
        let column = |state: [f64; 4]| {
            let [error, last, value, slope_per_s] = state;
            let mut estimate = UncertaintyEstimate { value, slope_per_s, last_error: Some(last) };
            let free = AdaptiveGains {
                safety: EstimateBounds { bound: None, ..self.gains.safety },
                ..self.gains
            };
            estimate.learn(self.plant, &free, error, hold_s);
            let acting = estimate.acting(self.plant, &free, error, hold_s);
            let fed_back = (free.feedback + free.error_feedback) * error;
            let next = self.state_step * error - self.input_step * (fed_back + acting);
            // A constant estimate is no mode of the error.
            let kept = if free.adaptation == Adaptation::Off { 0.0 } else { estimate.value };
            [next, error, kept, estimate.slope_per_s]
        };
        let mut matrix = Matrix4::zeros();
        for index in 0..4 {
            let mut unit = [0.0; 4];
            unit[index] = 1.0;
            matrix.set_column(index, &column(unit).into());
        }
        if !matches!(self.gains.adaptation, Adaptation::Ramp { .. }) {
            matrix.column_mut(3).fill(0.0);
        }
        matrix.complex_eigenvalues().iter().map(|root| root.norm()).fold(0.0, f64::max)
    }
}

/// Steady-state errors of a ramp of the uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RampErrors {
    /// e∞ \[unit of y\].
    pub output: f64,
    /// Δ − Δ̂ \[unit of u\].
    pub estimate: f64,
}
