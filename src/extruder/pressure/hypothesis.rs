//! The process for one dead time: the load, and the errors of gain, lag and dead time, by
//! Kalman's filter (1960) with the model's own sensitivities as the row of the measurement.
//! While the pressure moves, a difference from the model corrects the model; while it rests,
//! the load.

use nalgebra::{SMatrix, SVector};

use super::command_history::{LagStates, ModelMoment};
use super::tuning::Tuning;

/// Load's part of the pressure now and once settled \[MPa\]; errors of gain,
/// lag and dead time as shares.
pub type ModelState = SVector<f64, 5>;
/// Covariances of the state.
pub type StateCovariance = SMatrix<f64, 5, 5>;

/// Place of the load's part of the pressure now.
pub const LOAD_NOW: usize = 0;
/// Place of the load's part once settled.
pub const LOAD: usize = 1;
/// Place of the gain's error.
pub const GAIN: usize = 2;
/// Place of the lag's error.
pub const LAG: usize = 3;
/// Place of the dead time's error.
pub const DEAD_TIME: usize = 4;

/// How much of the change of slope within the dead time's doubt counts as
/// noise: what the straight line of the sensitivity misses.
const CURVATURE_NOISE: f64 = 0.27;
/// Errors of gain and lag are taken to lie within these shares.
const MIN_RELATIVE_ERROR: f64 = -0.4;
const MAX_RELATIVE_ERROR: f64 = 0.5;

/// Constants of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterSettings {
    /// The model's lag \[s\].
    pub lag_s: f64,
    /// The model's dead time \[s\].
    pub dead_time_s: f64,
    /// Standard deviation of the dead time about this belief's own, as a share.
    pub dead_time_sigma: f64,
    /// The law's settings.
    pub tuning: Tuning,
}

impl FilterSettings {
    fn prior(&self, index: usize) -> f64 {
        let sigma = if index == DEAD_TIME { self.dead_time_sigma } else { self.tuning.model_sigma };
        sigma * sigma
    }
}

/// What some time leaves of a belief. What is known of the model fades only
/// while the pressure moves: at rest there would be nothing to learn it anew
/// from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Share of the load's way that is still to go.
    load_decay: f64,
    /// Share of what is known of the model's errors.
    model_decay: f64,
    /// Variance that the load has gained \[MPa²\].
    load_drift: f64,
}

impl Transition {
    /// After `dt_s` at rest, and after the same while the pressure moves.
    pub fn after(filter: &FilterSettings, dt_s: f64) -> [Self; 2] {
        let load = libm::exp(-dt_s / filter.lag_s);
        let wandered = filter.tuning.load_drift * dt_s;
        [1.0, libm::exp(-dt_s / filter.tuning.forgetting_s)].map(|known| Self {
            load_decay: load,
            model_decay: known,
            load_drift: wandered,
        })
    }
}

/// An innovation and its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// What was read less what was foretold \[MPa\].
    pub difference: f64,
    /// Its variance \[MPa²\].
    pub variance: f64,
}

/// The belief.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The dead time that is believed in \[s\].
    pub dead_time_s: f64,
    /// Its probability.
    pub weight: f64,
    state: ModelState,
    covariance: StateCovariance,
}

impl Hypothesis {
    /// Before the first reading, under a load that is known \[MPa\].
    pub fn new(filter: &FilterSettings, dead_time_s: f64, weight: f64, load: f64) -> Self {
        let sure = 2e-4 * filter.tuning.reading_variance;
        let mut covariance = StateCovariance::zeros();
        for index in [LOAD_NOW, LOAD] {
            covariance[(index, index)] = sure;
        }
        for index in [GAIN, LAG, DEAD_TIME] {
            covariance[(index, index)] = filter.prior(index);
        }
        let mut state = ModelState::zeros();
        state[LOAD_NOW] = load;
        state[LOAD] = load;
        Self { dead_time_s, weight, state, covariance }
    }

    /// Lets time pass, by what it leaves.
    pub fn advance(&mut self, filter: &FilterSettings, left: &Transition) {
        let toward =
            |now: f64, settled: f64| left.load_decay * now + (1.0 - left.load_decay) * settled;
        let (state, covariance) = (&mut self.state, &mut self.covariance);
        state[LOAD_NOW] = toward(state[LOAD_NOW], state[LOAD]);
        for index in [GAIN, LAG, DEAD_TIME] {
            state[index] *= left.model_decay;
        }
        // The step's matrix from the left and its transpose from the right: it
        // mixes the two loads and shrinks the rest.
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

    /// Takes a reading \[MPa\]. `then` is the model a dead time ago; `around`
    /// its drives at either end of the dead time's doubt.
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
        // Rounding must not turn the covariances about.
        self.covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        Innovation { difference, variance }
    }

    /// Adds a step of the load that began a while ago: `settled` \[MPa\] of
    /// which the share `grown` shows, known with a variance.
    pub fn add_load_step(&mut self, settled: f64, grown: f64, variance: f64) {
        let mut way = ModelState::zeros();
        way[LOAD_NOW] = grown;
        way[LOAD] = 1.0;
        self.state += way * settled;
        self.covariance += way * way.transpose() * variance;
    }

    /// Whether rounding or wild readings have left nothing to go on from.
    pub fn has_diverged(&self) -> bool {
        let sound = |index| {
            let variance: f64 = self.covariance[(index, index)];
            variance.is_finite() && variance >= 0.0
        };
        !(self.state.iter().all(|value| value.is_finite()) && (0..5).all(sound))
    }

    /// Standard deviation of the dead time about this belief's own \[s\].
    pub fn dead_time_sigma_s(&self, filter: &FilterSettings) -> f64 {
        self.covariance[(DEAD_TIME, DEAD_TIME)].max(0.0).sqrt() * filter.dead_time_s
    }

    /// Gain's error.
    pub fn gain_error(&self) -> f64 {
        self.state[GAIN].clamp(MIN_RELATIVE_ERROR, MAX_RELATIVE_ERROR)
    }

    /// Lag's error.
    pub fn lag_error(&self) -> f64 {
        self.state[LAG].clamp(MIN_RELATIVE_ERROR, MAX_RELATIVE_ERROR)
    }

    /// The load's part of the pressure once settled \[MPa\].
    pub fn load(&self) -> f64 {
        self.state[LOAD]
    }

    /// Dead time with its error \[s\].
    pub fn corrected_dead_time_s(&self, filter: &FilterSettings) -> f64 {
        let fraction = self.state[DEAD_TIME].clamp(MIN_RELATIVE_ERROR, MAX_RELATIVE_ERROR);
        (self.dead_time_s + fraction * filter.dead_time_s).max(0.0)
    }

    /// The pressure a dead time from now \[MPa\], where the commands until now
    /// will have brought it, and the row that it is of the state.
    pub fn predict(&self, filter: &FilterSettings, now: &LagStates) -> (f64, ModelState) {
        let kept = libm::exp(-self.dead_time_s / filter.lag_s);
        let bent = now.second - now.first;
        let pressure = now.first * (1.0 + self.gain_error())
            + bent * self.lag_error()
            + kept * self.state[LOAD_NOW]
            + (1.0 - kept) * self.state[LOAD];
        (pressure, ModelState::from([kept, 1.0 - kept, now.first, bent, 0.0]))
    }

    /// Covariances of the state with a row of it.
    pub fn covariance_with(&self, row: &ModelState) -> ModelState {
        self.covariance * row
    }
}
