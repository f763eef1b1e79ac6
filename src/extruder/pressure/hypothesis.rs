//! The process for one dead time: the load, and the errors of gain, lag and dead time, by
//! Kalman's filter (1960) with the model's own sensitivities as the row of the measurement.
//! While the pressure moves, a difference from the model corrects the model; while it rests,
//! the load.

use nalgebra::{SMatrix, SVector};

use super::command_history::{Lags, Moment};
use super::tuning::Tuning;

/// Load's part of the pressure now and once settled \[MPa\]; errors of gain,
/// lag and dead time as shares.
pub type State = SVector<f64, 5>;
/// Covariances of the state.
pub type Covariance = SMatrix<f64, 5, 5>;

/// Place of the load's part of the pressure now.
pub const LOAD_NOW: usize = 0;
/// Place of the load's part once settled.
pub const LOAD: usize = 1;
/// Place of the gain's error.
pub const GAIN: usize = 2;
/// Place of the lag's error.
pub const LAG: usize = 3;
/// Place of the dead time's error.
pub const DEAD: usize = 4;

/// How much of the change of slope within the dead time's doubt counts as
/// noise: what the straight line of the sensitivity misses.
const BEND: f64 = 0.27;
/// Errors of gain and lag are taken to lie within these shares.
const LEAST: f64 = -0.4;
const MOST: f64 = 0.5;

/// Constants of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// The model's lag \[s\].
    pub lag_s: f64,
    /// The model's dead time \[s\].
    pub dead_time_s: f64,
    /// Standard deviation of the dead time about this belief's own, as a share.
    pub dead_doubt: f64,
    /// The law's settings.
    pub tuning: Tuning,
}

impl Filter {
    fn prior(&self, place: usize) -> f64 {
        let doubt = if place == DEAD { self.dead_doubt } else { self.tuning.doubt };
        doubt * doubt
    }
}

/// What some time leaves of a belief. What is known of the model fades only
/// while the pressure moves: at rest there would be nothing to learn it anew
/// from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Left {
    /// Share of the load's way that is still to go.
    load: f64,
    /// Share of what is known of the model's errors.
    known: f64,
    /// Variance that the load has gained \[MPa²\].
    wandered: f64,
}

impl Left {
    /// After `dt_s` at rest, and after the same while the pressure moves.
    pub fn after(filter: &Filter, dt_s: f64) -> [Self; 2] {
        let load = libm::exp(-dt_s / filter.lag_s);
        let wandered = filter.tuning.wander * dt_s;
        [1.0, libm::exp(-dt_s / filter.tuning.forget_s)].map(|known| Self { load, known, wandered })
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
pub struct Belief {
    /// The dead time that is believed in \[s\].
    pub dead_time_s: f64,
    /// Its probability.
    pub weight: f64,
    state: State,
    covariance: Covariance,
}

impl Belief {
    /// Before the first reading, under a load that is known \[MPa\].
    pub fn new(filter: &Filter, dead_time_s: f64, weight: f64, load: f64) -> Self {
        let sure = 2e-4 * filter.tuning.reading;
        let mut covariance = Covariance::zeros();
        for place in [LOAD_NOW, LOAD] {
            covariance[(place, place)] = sure;
        }
        for place in [GAIN, LAG, DEAD] {
            covariance[(place, place)] = filter.prior(place);
        }
        let mut state = State::zeros();
        state[LOAD_NOW] = load;
        state[LOAD] = load;
        Self { dead_time_s, weight, state, covariance }
    }

    /// Lets time pass, by what it leaves.
    pub fn pass(&mut self, filter: &Filter, left: &Left) {
        let toward = |now: f64, settled: f64| left.load * now + (1.0 - left.load) * settled;
        let (state, covariance) = (&mut self.state, &mut self.covariance);
        state[LOAD_NOW] = toward(state[LOAD_NOW], state[LOAD]);
        for place in [GAIN, LAG, DEAD] {
            state[place] *= left.known;
        }
        // The step's matrix from the left and its transpose from the right: it
        // mixes the two loads and shrinks the rest.
        for i in 0..5 {
            covariance[(LOAD_NOW, i)] = toward(covariance[(LOAD_NOW, i)], covariance[(LOAD, i)]);
        }
        for i in 0..5 {
            covariance[(i, LOAD_NOW)] = toward(covariance[(i, LOAD_NOW)], covariance[(i, LOAD)]);
        }
        for place in [GAIN, LAG, DEAD] {
            for i in 0..5 {
                covariance[(place, i)] *= left.known;
                covariance[(i, place)] *= left.known;
            }
        }
        covariance[(LOAD, LOAD)] += left.wandered;
        for place in [GAIN, LAG, DEAD] {
            covariance[(place, place)] += (1.0 - left.known * left.known) * filter.prior(place);
        }
    }

    /// Takes a reading \[MPa\]. `then` is the model a dead time ago; `around`
    /// its drives at either end of the dead time's doubt.
    pub fn read(
        &mut self,
        filter: &Filter,
        reading: f64,
        then: &Moment,
        around: [f64; 2],
    ) -> Innovation {
        let Lags { first, second } = then.lags;
        let slope = (then.drive - first) / filter.lag_s;
        let row = State::from([1.0, 0.0, first, second - first, -filter.dead_time_s * slope]);
        let turn = around.map(|drive| (drive - then.drive).abs());
        let bend = BEND * self.dead_sigma_s(filter) / filter.lag_s * turn[0].max(turn[1]);
        let noise = filter.tuning.reading + bend * bend;
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
    pub fn jump(&mut self, settled: f64, grown: f64, variance: f64) {
        let mut way = State::zeros();
        way[LOAD_NOW] = grown;
        way[LOAD] = 1.0;
        self.state += way * settled;
        self.covariance += way * way.transpose() * variance;
    }

    /// Whether rounding or wild readings have left nothing to go on from.
    pub fn is_lost(&self) -> bool {
        let sound = |place| {
            let variance: f64 = self.covariance[(place, place)];
            variance.is_finite() && variance >= 0.0
        };
        !(self.state.iter().all(|value| value.is_finite()) && (0..5).all(sound))
    }

    /// Standard deviation of the dead time about this belief's own \[s\].
    pub fn dead_sigma_s(&self, filter: &Filter) -> f64 {
        self.covariance[(DEAD, DEAD)].max(0.0).sqrt() * filter.dead_time_s
    }

    /// Gain's error.
    pub fn gain(&self) -> f64 {
        self.state[GAIN].clamp(LEAST, MOST)
    }

    /// Lag's error.
    pub fn lag(&self) -> f64 {
        self.state[LAG].clamp(LEAST, MOST)
    }

    /// The load's part of the pressure once settled \[MPa\].
    pub fn load(&self) -> f64 {
        self.state[LOAD]
    }

    /// Dead time with its error \[s\].
    pub fn dead_s(&self, filter: &Filter) -> f64 {
        let share = self.state[DEAD].clamp(LEAST, MOST);
        (self.dead_time_s + share * filter.dead_time_s).max(0.0)
    }

    /// The pressure a dead time from now \[MPa\], where the commands until now
    /// will have brought it, and the row that it is of the state.
    pub fn foretell(&self, filter: &Filter, now: &Lags) -> (f64, State) {
        let kept = libm::exp(-self.dead_time_s / filter.lag_s);
        let bent = now.second - now.first;
        let pressure = now.first * (1.0 + self.gain())
            + bent * self.lag()
            + kept * self.state[LOAD_NOW]
            + (1.0 - kept) * self.state[LOAD];
        (pressure, State::from([kept, 1.0 - kept, now.first, bent, 0.0]))
    }

    /// Covariances of the state with a row of it.
    pub fn along(&self, row: &State) -> State {
        self.covariance * row
    }
}
