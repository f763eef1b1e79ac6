//! Hypotheses for several dead times in parallel, each as probable as its readings make it: a
//! dead time that is off bends the response where no straight line through one hypothesis
//! would follow it (multiple-model estimation, Magill 1965).

use super::Fopdt;
use super::command_history::{CommandHistory, Lags};
use super::hypothesis::{Belief, Filter, GAIN, LAG, LOAD, Left, State};
use super::load_step::Watch;
use super::tuning::Tuning;

/// Dead times beside each other, out to two standard deviations.
const BELIEFS: usize = 5;
/// Share of probability that is spread over all with every reading, so that
/// none is lost for good.
const SPREAD: f64 = 1e-4;
/// Squares of innovations beyond this are told no further apart.
const FAR: f64 = 50.0;
/// Standard deviations of a reading by which the pressure has yet to go where
/// it counts as moving.
const MOVING: f64 = 6.0;

/// The beliefs and their common watch for steps of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bank {
    filter: Filter,
    beliefs: [Belief; BELIEFS],
    watch: Watch,
}

/// What the beliefs come to, a dead time ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foretold {
    /// Pressure \[MPa\].
    pub pressure: f64,
    /// Its standard deviation \[MPa\].
    pub sigma: f64,
    /// Gain over that of the model.
    pub gain: f64,
    /// Lag over that of the model.
    pub lag: f64,
    /// The load's part of the pressure once settled \[MPa\].
    pub load: f64,
    /// Slopes of gain, lag and load with the pressure, by the standard
    /// deviation of the pressure.
    slopes: [f64; 3],
}

impl Foretold {
    /// The same with the pressure some standard deviations higher, and all
    /// else as is then likeliest.
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

impl Bank {
    /// Before the first reading, under a load that is known \[MPa\].
    pub fn new(model: &Fopdt, tuning: Tuning, load: f64) -> Self {
        let dead_time_s = model.dead_time_s();
        let step = tuning.doubt;
        let filter = Filter { lag_s: model.lag_s(), dead_time_s, dead_doubt: 0.5 * step, tuning };
        // Normal about the model's, at −2 … 2 standard deviations.
        let weights = [0.054_49, 0.244_20, 0.402_62, 0.244_20, 0.054_49];
        let mut deviations = -2.0;
        let beliefs = weights.map(|weight| {
            let belief =
                Belief::new(&filter, dead_time_s * (1.0 + deviations * step), weight, load);
            deviations += 1.0;
            belief
        });
        let watch = Watch::new(filter.lag_s, tuning.load, tuning.evidence);
        Self { filter, beliefs, watch }
    }

    /// The longest time that is looked back by \[s\].
    pub fn back_s(model: &Fopdt, tuning: &Tuning) -> f64 {
        model.dead_time_s() * (1.0 + 3.0 * tuning.doubt)
    }

    /// Takes a reading \[MPa\], `dt_s` after the last.
    pub fn read(&mut self, history: &CommandHistory, at_s: f64, dt_s: f64, reading: f64) {
        let filter = self.filter;
        let moving = MOVING * filter.tuning.sigma();
        let [resting, going] = Left::after(&filter, dt_s);
        let mut seen = self.beliefs.map(|belief| (belief.weight, None));
        for (belief, seen) in self.beliefs.iter_mut().zip(&mut seen) {
            let then_s = at_s - belief.dead_time_s;
            let then = history.at(then_s);
            let moves = (then.drive - then.lags.first).abs() > moving;
            belief.pass(&filter, if moves { &going } else { &resting });
            let aside = belief.dead_sigma_s(&filter);
            let around = [then_s - aside, then_s + aside].map(|at_s| history.drive_at(at_s));
            let innovation = belief.read(&filter, reading, &then, around);
            if belief.is_lost() {
                let load = reading - then.lags.first;
                *belief = Belief::new(&filter, belief.dead_time_s, belief.weight, load);
            }
            let square = innovation.difference * innovation.difference / innovation.variance;
            let likelihood = libm::exp(-0.5 * square.min(FAR)) / innovation.variance.sqrt();
            *seen = (belief.weight * likelihood, Some(innovation));
        }
        let total: f64 = seen.iter().map(|(weight, _)| weight).sum();
        let spread = SPREAD / 5.0;
        for (belief, (weight, _)) in self.beliefs.iter_mut().zip(&seen) {
            let share = if total > 0.0 && total.is_finite() { weight / total } else { 0.2 };
            belief.weight = (1.0 - SPREAD) * share + spread;
        }
        let likeliest = seen.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let jump = likeliest
            .and_then(|(_, innovation)| *innovation)
            .and_then(|innovation| self.watch.see(innovation, dt_s));
        if let Some(jump) = jump {
            for belief in &mut self.beliefs {
                belief.jump(jump.settled, jump.grown, jump.variance);
            }
        }
    }

    /// The dead time \[s\].
    pub fn dead_s(&self) -> f64 {
        self.beliefs.iter().map(|belief| belief.weight * belief.dead_s(&self.filter)).sum()
    }

    /// Where the commands until now will have brought the pressure a dead time
    /// from now.
    pub fn foretell(&self, now: &Lags) -> Foretold {
        let mut mean = Foretold {
            pressure: 0.0,
            sigma: 0.0,
            gain: 1.0,
            lag: 1.0,
            load: 0.0,
            slopes: [0.0; 3],
        };
        for belief in &self.beliefs {
            let (pressure, _) = belief.foretell(&self.filter, now);
            mean.pressure += belief.weight * pressure;
            mean.gain += belief.weight * belief.gain();
            mean.lag += belief.weight * belief.lag();
            mean.load += belief.weight * belief.load();
        }
        let (mut variance, mut along) = (0.0, State::zeros());
        for belief in &self.beliefs {
            let (pressure, row) = belief.foretell(&self.filter, now);
            let covariances = belief.along(&row);
            let apart = pressure - mean.pressure;
            variance += belief.weight * (row.dot(&covariances).max(0.0) + apart * apart);
            along += covariances * belief.weight;
        }
        mean.sigma = variance.sqrt();
        let over = mean.sigma.max(1e-12);
        mean.slopes = [along[GAIN] / over, along[LAG] / over, along[LOAD] / over];
        mean
    }
}
