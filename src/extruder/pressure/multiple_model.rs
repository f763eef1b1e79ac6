//! Hypotheses for several dead times in parallel, weighted by their likelihoods: the response
//! is not linear in the dead time, so that one linearised filter does not follow an error of it
//! (multiple-model estimation, Magill 1965).

use super::Fopdt;
use super::command_history::{CommandHistory, LagStates};
use super::hypothesis::{FilterSettings, GAIN, Hypothesis, LAG, LOAD, ModelState, Transition};
use super::load_step::LoadStepDetector;
use super::tuning::Tuning;

/// Number of hypotheses, at −2 … 2 standard deviations of the dead time.
const HYPOTHESES: usize = 5;
/// Probability that is spread over all hypotheses with every reading, so that each can recover.
const PROBABILITY_FLOOR: f64 = 1e-4;
/// Normalised innovations squared are clipped here, so that likelihoods do not underflow.
const MAX_SQUARED_INNOVATION: f64 = 50.0;
/// Distance of the pressure from its steady state, in standard deviations of a reading, from
/// which it counts as moving.
const MOVING_SIGMAS: f64 = 6.0;

/// The hypotheses and their common detector of load steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultipleModelFilter {
    filter: FilterSettings,
    hypotheses: [Hypothesis; HYPOTHESES],
    detector: LoadStepDetector,
}

/// The combined prediction, a dead time ahead.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PressurePrediction {
    /// Pressure \[MPa\].
    pub pressure: f64,
    /// Its standard deviation \[MPa\].
    pub sigma: f64,
    /// Gain over that of the model.
    pub gain: f64,
    /// Lag over that of the model.
    pub lag: f64,
    /// Steady-state part of the pressure by the load \[MPa\].
    pub load: f64,
    /// Regression of gain, lag and load on the pressure, per standard deviation of the
    /// pressure.
    slopes: [f64; 3],
}

impl PressurePrediction {
    /// The prediction for a pressure that is higher by some standard deviations, with gain, lag and
    /// load as expected then.
    pub fn higher(&self, deviations: f64) -> Self {
        let [gain, lag, load] = self.slopes;
        Self {
            pressure: self.pressure + deviations * self.sigma,
            gain: (self.gain + deviations * gain).max(0.3),
            lag: (self.lag + deviations * lag).max(0.3),
            load: self.load + deviations * load,
            ..*self
        }
    }
}

impl MultipleModelFilter {
    /// Before the first reading, under a known load \[MPa\].
    pub fn new(model: &Fopdt, tuning: Tuning, load: f64) -> Self {
        let dead_time_s = model.dead_time_s();
        let (lag_s, step) = (model.lag_s(), tuning.model_sigma);
        let filter = FilterSettings { lag_s, dead_time_s, dead_time_sigma: 0.5 * step, tuning };
        // Normal density at −2 … 2 standard deviations, normalised to a sum of 1.
        let weights = [0.054_49, 0.244_20, 0.402_62, 0.244_20, 0.054_49];
        let mut deviations = -2.0;
        let hypotheses = weights.map(|weight| {
            let own_s = dead_time_s * (1.0 + deviations * step);
            deviations += 1.0;
            Hypothesis::new(&filter, own_s, weight, load)
        });
        let Tuning { load_step_sigma, load_step_threshold, .. } = tuning;
        let detector = LoadStepDetector::new(lag_s, load_step_sigma, load_step_threshold);
        Self { filter, hypotheses, detector }
    }

    /// The longest time that the filter looks back \[s\].
    pub fn lookback_s(model: &Fopdt, tuning: &Tuning) -> f64 {
        model.dead_time_s() * (1.0 + 3.0 * tuning.model_sigma)
    }

    /// Updates with a reading \[MPa\], `dt_s` after the last.
    pub fn update(&mut self, history: &CommandHistory, at_s: f64, dt_s: f64, reading: f64) {
        let filter = self.filter;
        let moving = MOVING_SIGMAS * filter.tuning.sigma();
        let [resting, going] = Transition::after(&filter, dt_s);
        let mut seen = self.hypotheses.map(|hypothesis| (hypothesis.weight, None));
        for (hypothesis, seen) in self.hypotheses.iter_mut().zip(&mut seen) {
            let then_s = at_s - hypothesis.dead_time_s;
            let then = history.at(then_s);
            let moves = (then.drive - then.lags.first).abs() > moving;
            hypothesis.advance(&filter, if moves { &going } else { &resting });
            let aside = hypothesis.dead_time_sigma_s(&filter);
            let around = [then_s - aside, then_s + aside].map(|at_s| history.drive_at(at_s));
            let innovation = hypothesis.update(&filter, reading, &then, around);
            if hypothesis.has_diverged() {
                let load = reading - then.lags.first;
                *hypothesis =
                    Hypothesis::new(&filter, hypothesis.dead_time_s, hypothesis.weight, load);
            }
            let square = innovation.difference * innovation.difference / innovation.variance;
            let likelihood =
                libm::exp(-0.5 * square.min(MAX_SQUARED_INNOVATION)) / innovation.variance.sqrt();
            *seen = (hypothesis.weight * likelihood, Some(innovation));
        }
        let total: f64 = seen.iter().map(|(weight, _)| weight).sum();
        let spread = PROBABILITY_FLOOR / 5.0;
        for (hypothesis, (weight, _)) in self.hypotheses.iter_mut().zip(&seen) {
            let posterior = if total > 0.0 && total.is_finite() { weight / total } else { 0.2 };
            hypothesis.weight = (1.0 - PROBABILITY_FLOOR) * posterior + spread;
        }
        let likeliest = seen.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let jump = likeliest
            .and_then(|(_, innovation)| *innovation)
            .and_then(|innovation| self.detector.update(innovation, dt_s));
        if let Some(jump) = jump {
            for hypothesis in &mut self.hypotheses {
                hypothesis.add_load_step(jump.settled, jump.shown_fraction, jump.variance);
            }
        }
    }

    /// Estimated dead time \[s\].
    pub fn dead_time_s(&self) -> f64 {
        self.hypotheses
            .iter()
            .map(|hypothesis| hypothesis.weight * hypothesis.corrected_dead_time_s(&self.filter))
            .sum()
    }

    /// Predicts the pressure a dead time from now, from the commands until now.
    pub fn predict(&self, now: &LagStates) -> PressurePrediction {
        let mut mean = PressurePrediction { gain: 1.0, lag: 1.0, ..PressurePrediction::default() };
        for hypothesis in &self.hypotheses {
            let (pressure, _) = hypothesis.predict(&self.filter, now);
            mean.pressure += hypothesis.weight * pressure;
            mean.gain += hypothesis.weight * hypothesis.relative_error(GAIN);
            mean.lag += hypothesis.weight * hypothesis.relative_error(LAG);
            mean.load += hypothesis.weight * hypothesis.load();
        }
        let (mut variance, mut along) = (0.0, ModelState::zeros());
        for hypothesis in &self.hypotheses {
            let (pressure, row) = hypothesis.predict(&self.filter, now);
            let covariances = hypothesis.covariance_with(&row);
            let apart = pressure - mean.pressure;
            variance += hypothesis.weight * (row.dot(&covariances).max(0.0) + apart * apart);
            along += covariances * hypothesis.weight;
        }
        mean.sigma = variance.sqrt();
        let over = mean.sigma.max(1e-12);
        mean.slopes = [along[GAIN] / over, along[LAG] / over, along[LOAD] / over];
        mean
    }
}
