//! The process for one dead time: load and errors of gain, lag and dead time, by a Kalman filter
//! (Kalman 1960) whose measurement row is the model's sensitivities. While the pressure moves an
//! innovation corrects the model; at rest, the load.

use nalgebra::{SMatrix, SVector};

use super::command_history::{LagStates, ModelMoment};
use super::tuning::Tuning;

/// Part of the pressure by the load, now and in steady state \[MPa\]; relative errors of gain,
/// lag and dead time.
pub type ModelState = SVector<f64, 5>;
/// Covariances of the state.
pub type StateCovariance = SMatrix<f64, 5, 5>;

/// Index of the part of the pressure by the load now. By definition of the state.
pub const LOAD_NOW: usize = 0;
/// Index of that part in steady state. By definition of the state.
pub const LOAD: usize = 1;
/// Index of the gain's error. By definition of the state.
pub const GAIN: usize = 2;
/// Index of the lag's error. By definition of the state.
pub const LAG: usize = 3;
/// Index of the dead time's error. By definition of the state.
pub const DEAD_TIME: usize = 4;

/// Fraction of the change of slope within the uncertainty of the dead time that counts as
/// noise: the error of the linearisation.
const CURVATURE_NOISE: f64 = 0.27;
/// Smallest relative error of gain and lag that is used: the inverse of the model stays bounded.
const MIN_RELATIVE_ERROR: f64 = -0.4;
/// Largest relative error of gain and lag that is used.
const MAX_RELATIVE_ERROR: f64 = 0.5;

/// Constants of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    /// The model's lag \[s\].
    pub lag_s: f64,
    /// The model's dead time \[s\].
    pub dead_time_s: f64,
    /// Relative standard deviation of the dead time about the hypothesis' own.
    pub dead_time_sigma: f64,
    /// Settings of the controller.
    pub tuning: Tuning,
}

impl FilterSettings {
    fn prior(&self, index: usize) -> f64 {
        let sigma = if index == DEAD_TIME { self.dead_time_sigma } else { self.tuning.model_sigma };
        sigma * sigma
    }
}

/// State transition over a time. Errors of the model return to their prior only while the
/// pressure moves: at rest they are not observable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Decay of the load's transient.
    load_decay: f64,
    /// Decay of the model's errors.
    model_decay: f64,
    /// Drift of the load, a variance \[MPa²\].
    load_drift: f64,
}

impl Transition {
    /// Over `dt_s` at rest, and over the same while the pressure moves.
    pub fn after(filter: &FilterSettings, dt_s: f64) -> [Self; 2] {
        let load_decay = libm::exp(-dt_s / filter.lag_s);
        let load_drift = filter.tuning.load_drift * dt_s;
        [1.0, libm::exp(-dt_s / filter.tuning.forgetting_s)].map(|model_decay| Self {
            load_decay,
            model_decay,
            load_drift,
        })
    }
}

/// An innovation and its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured less predicted pressure \[MPa\].
    pub difference: f64,
    /// Its variance \[MPa²\].
    pub variance: f64,
}

/// A hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Its dead time \[s\].
    pub dead_time_s: f64,
    /// Its probability.
    pub weight: f64,
    state: ModelState,
    covariance: StateCovariance,
}

impl Hypothesis {
    /// Before the first reading, under a known load \[MPa\].
    pub fn new(filter: &FilterSettings, dead_time_s: f64, weight: f64, load: f64) -> Self {
        let known = 2e-4 * filter.tuning.reading_variance;
        let mut covariance = StateCovariance::zeros();
        for index in [LOAD_NOW, LOAD] {
            covariance[(index, index)] = known;
        }
        for index in [GAIN, LAG, DEAD_TIME] {
            covariance[(index, index)] = filter.prior(index);
        }
        let state = ModelState::from([load, load, 0.0, 0.0, 0.0]);
        Self { dead_time_s, weight, state, covariance }
    }

    /// Predicts state and covariance over a time.
    pub fn advance(&mut self, filter: &FilterSettings, left: &Transition) {
        let toward =
            |now: f64, settled: f64| left.load_decay * now + (1.0 - left.load_decay) * settled;
        let (state, covariance) = (&mut self.state, &mut self.covariance);
        state[LOAD_NOW] = toward(state[LOAD_NOW], state[LOAD]);
        for index in [GAIN, LAG, DEAD_TIME] {
            state[index] *= left.model_decay;
        }
        // F·P·Fᵀ: F mixes the two loads and shrinks the rest.
        for i in 0..5 {
            covariance[(LOAD_NOW, i)] = toward(covariance[(LOAD_NOW, i)], covariance[(LOAD, i)]);
        }
        for i in 0..5 {
            covariance[(i, LOAD_NOW)] = toward(covariance[(i, LOAD_NOW)], covariance[(i, LOAD)]);
        }
        for index in [GAIN, LAG, DEAD_TIME] {
            for i in 0..5 {
                covariance[(index, i)] *= left.model_decay;
                covariance[(i, index)] *= left.model_decay;
            }
        }
        covariance[(LOAD, LOAD)] += left.load_drift;
        for index in [GAIN, LAG, DEAD_TIME] {
            covariance[(index, index)] +=
                (1.0 - left.model_decay * left.model_decay) * filter.prior(index);
        }
    }

    /// Updates with a reading \[MPa\]. `then` is the model a dead time ago; `around` its drives
    /// at either end of the uncertainty of the dead time.
    pub fn update(
        &mut self,
        filter: &FilterSettings,
        reading: f64,
        then: &ModelMoment,
        around: [f64; 2],
    ) -> Innovation {
        let LagStates { first, second } = then.lags;
        let slope = (then.drive - first) / filter.lag_s;
        let row = ModelState::from([1.0, 0.0, first, second - first, -filter.dead_time_s * slope]);
        let turn = around.map(|drive| (drive - then.drive).abs());
        let bend =
            CURVATURE_NOISE * self.dead_time_sigma_s(filter) / filter.lag_s * turn[0].max(turn[1]);
        let noise = filter.tuning.reading_variance + bend * bend;
        let along = self.covariance * row;
        let variance = noise + row.dot(&along).max(0.0);
        let difference = reading - first - row.dot(&self.state);
        let gain = along * (1.0 / variance);
        self.state += gain * difference;
        self.covariance -= gain * along.transpose();
        // Keeps the covariance symmetric in spite of rounding.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        Innovation { difference, variance }
    }

    /// Adds a step of the load that began a while ago: `settled` \[MPa\], of which the fraction
    /// `grown` shows, with a variance.
    pub fn add_load_step(&mut self, settled: f64, grown: f64, variance: f64) {
        let mut direction = ModelState::zeros();
        direction[LOAD_NOW] = grown;
        direction[LOAD] = 1.0;
        self.state += direction * settled;
        self.covariance += direction * direction.transpose() * variance;
    }

    /// Whether state or covariance is no longer valid.
    pub fn has_diverged(&self) -> bool {
        let sound = |index| {
            let variance: f64 = self.covariance[(index, index)];
            variance.is_finite() && variance >= 0.0
        };
        !(self.state.iter().all(|value| value.is_finite()) && (0..5).all(sound))
    }

    /// Standard deviation of the dead time about the hypothesis' own \[s\].
    pub fn dead_time_sigma_s(&self, filter: &FilterSettings) -> f64 {
        self.covariance[(DEAD_TIME, DEAD_TIME)].max(0.0).sqrt() * filter.dead_time_s
    }

    /// Relative error of the gain, the lag or the dead time, within its bounds.
    pub fn relative_error(&self, index: usize) -> f64 {
        self.state[index].clamp(MIN_RELATIVE_ERROR, MAX_RELATIVE_ERROR)
    }

    /// Steady-state part of the pressure by the load \[MPa\].
    pub fn load(&self) -> f64 {
        self.state[LOAD]
    }

    /// Dead time corrected by its estimated error \[s\].
    pub fn corrected_dead_time_s(&self, filter: &FilterSettings) -> f64 {
        (self.dead_time_s + self.relative_error(DEAD_TIME) * filter.dead_time_s).max(0.0)
    }

    /// The pressure a dead time from now \[MPa\] by the commands until now, and its row of
    /// sensitivities to the state.
    pub fn predict(&self, filter: &FilterSettings, now: &LagStates) -> (f64, ModelState) {
        let kept = libm::exp(-self.dead_time_s / filter.lag_s);
        let bent = now.second - now.first;
        let pressure = now.first * (1.0 + self.relative_error(GAIN))
            + bent * self.relative_error(LAG)
            + kept * self.state[LOAD_NOW]
            + (1.0 - kept) * self.state[LOAD];
        (pressure, ModelState::from([kept, 1.0 - kept, now.first, bent, 0.0]))
    }

    /// Covariances of the state with a linear combination of it.
    pub fn covariance_with(&self, row: &ModelState) -> ModelState {
        self.covariance * row
    }
}
