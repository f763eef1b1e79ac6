//! The model in use: the given one, until the answer to a step of the target shows another plant.
//! After a step the pressure moves by far more than its noise, so that gain, lag and dead time are
//! found by least squares: the gain for each lag and dead time of a grid. A prior of the lag divides
//! between the two what the first readings do not yet tell apart.

use std::ops::RangeInclusive;

use super::Fopdt;
use super::command_history::CommandHistory;

/// Lags of the grid over the given one. Derived: half to twice, by √2.
const LAGS: [f64; 5] = [0.5, 0.707, 1.0, 1.414, 2.0];
/// The given lag in the grid. Derived: its index.
const GIVEN_LAG: usize = 2;
/// Dead times of the grid. Derived: a quarter to 2.25 times the given one. A coarser grid takes what
/// is left of a wrong dead time for a wrong gain and lag.
const DEAD_TIMES: usize = 65;
/// The shortest dead time over the given one. Derived: the shortest that is expected.
const SHORTEST_DEAD_TIME: f64 = 0.25;
/// Distance of two dead times over the given one. Derived: 0.013 s in Ma et al. 2026, less than the
/// time from a reading to the next.
const DEAD_TIME_SPACING: f64 = 1.0 / 32.0;
/// The given dead time in the grid. Derived: its index.
const GIVEN_DEAD_TIME: usize = 24;
/// Gains over the given one. Derived: half to twice, and a quarter more; others are no answer, but a
/// load.
const GAINS: RangeInclusive<f64> = 0.4..=2.5;
/// Standard deviation of the pressure of every model of the grid, as a fraction of the step. Derived:
/// the noise of Ma et al. 2026 is as large.
const MODEL_ERROR: f64 = 0.01;
/// Standard deviation of the time of a reading, in readings. Derived: it may be half of one off.
const TIMING_ERROR: f64 = 0.5;
/// Weight of the squared logarithm of the lag over the given one. Derived: that of a standard
/// deviation of a fifth, so that a quick answer counts as a large gain first, which overshoots less. The
/// gain has none: the commands would stop for a while before a plant has half of it.
const LAG_PRIOR: f64 = 24.0;
/// Sum of squares of an answer that counts, in variances. Derived: the gain is known to 9 %, one over
/// its root. A smaller one takes the first readings of twice the gain for the given one, a larger one
/// waits for longer. A dead time that is longer than the given one leaves less gain to allow for: the
/// error of it may be as many times as large.
const MIN_ANSWER: f64 = 130.0;
/// Log likelihood ratio, doubled, from which a model with less than the given gain is used: with it
/// the commands go farther. Derived: once in 600 by chance (χ² of one degree of freedom).
const SIGNIFICANT: f64 = 10.0;

/// The models of the grid with their past, and the one in use.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantModel {
    given: Fopdt,
    in_use: GridModel,
    /// The commands, for each lag, with the given gain.
    commanded: [CommandHistory; LAGS.len()],
    /// Pressure by the commands before the step, for each lag \[MPa\].
    before: [f64; LAGS.len()],
    /// The last reading that was added \[MPa\].
    last: f64,
    /// Sum of squares of the answer, in variances.
    answer: f64,
    fits: [[Sums; DEAD_TIMES]; LAGS.len()],
}

/// A model of the grid: gain and dead time over the given ones, and the number of its lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridModel {
    gain: f64,
    lag: usize,
    dead_time: f64,
}

/// Sums over the readings since a step, in variances.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sums {
    product: f64,
    square: f64,
}

impl PlantModel {
    /// The given model, which keeps what is needed to look back by `back_s`, as if `speed_rpm` had
    /// always been commanded.
    pub fn new(given: Fopdt, back_s: f64, speed_rpm: f64) -> Self {
        let commanded = LAGS.map(|ratio| {
            let model = Fopdt { lag_s: ratio * given.lag_s, ..given };
            CommandHistory::new(&model, back_s, speed_rpm)
        });
        Self {
            given,
            in_use: GridModel::GIVEN,
            commanded,
            before: [0.0; LAGS.len()],
            last: 0.0,
            answer: 0.0,
            fits: Sums::NONE,
        }
    }

    /// The model in use.
    pub fn model(&self) -> Fopdt {
        let GridModel { gain, lag, dead_time } = self.in_use;
        Fopdt {
            gain: gain * self.given.gain,
            lag_s: LAGS[lag] * self.given.lag_s,
            dead_time_s: dead_time * self.given.dead_time_s,
        }
    }

    /// The given gain over that of the model in use, where that is less; else 1.
    pub fn given_gain_ratio(&self) -> f64 {
        (1.0 / self.in_use.gain).max(1.0)
    }

    /// A command from `at_s` on; not before the last one.
    pub fn push(&mut self, at_s: f64, speed_rpm: f64) {
        for history in &mut self.commanded {
            history.push(at_s, speed_rpm);
        }
    }

    /// Pressure by the commands without the dead time \[MPa\], at a moment \[s\].
    pub fn pressure_at(&self, at_s: f64) -> f64 {
        self.in_use.gain * self.commanded[self.in_use.lag].pressure_at(at_s)
    }

    /// The same with the dead time \[MPa\].
    pub fn arrived(&self, at_s: f64) -> f64 {
        self.pressure_at(at_s - self.in_use.dead_time * self.given.dead_time_s)
    }

    /// Pressure by the commands before the step, once they had arrived \[MPa\].
    pub fn before_step(&self) -> f64 {
        self.in_use.gain * self.before[self.in_use.lag]
    }

    /// Begins a step of the target.
    pub fn begin_step(&mut self, now_s: f64) {
        self.before = self.commanded.each_ref().map(|history| history.pressure_at(now_s));
        (self.last, self.answer, self.fits) = (0.0, 0.0, Sums::NONE);
    }

    /// Adds a reading of a step of a size: how far the pressure is from the one without the step, and
    /// the standard deviation of a reading \[MPa\].
    pub fn answered(&mut self, now_s: f64, by: f64, sigma: f64, size: f64) {
        let model = MODEL_ERROR * size;
        let timing = TIMING_ERROR * (by - std::mem::replace(&mut self.last, by));
        let weight = 1.0 / (sigma * sigma + model * model + timing * timing);
        self.answer += weight * by * by;
        for ((history, before), fits) in self.commanded.iter().zip(self.before).zip(&mut self.fits)
        {
            let mut dead_time = SHORTEST_DEAD_TIME;
            for sums in fits {
                let at_s = now_s - dead_time * self.given.dead_time_s;
                let moved = history.pressure_at(at_s) - before;
                sums.product += weight * moved * by;
                sums.square += weight * moved * moved;
                dead_time += DEAD_TIME_SPACING;
            }
        }
    }

    /// The most likely model; none before an answer.
    pub fn likeliest(&self) -> Option<GridModel> {
        let mut best = (f64::INFINITY, None);
        for ((lag, ratio), fits) in LAGS.iter().enumerate().zip(&self.fits) {
            let off = LAG_PRIOR * libm::log(*ratio).powi(2);
            let mut dead_time = SHORTEST_DEAD_TIME;
            for sums in fits {
                let gain = sums.product / sums.square.max(f64::MIN_POSITIVE);
                let explained = sums.product * gain;
                let late = dead_time.max(1.0);
                if GAINS.contains(&gain) && explained * late * late > MIN_ANSWER {
                    let cost = self.answer - explained + off;
                    if cost < best.0 {
                        best = (cost, Some(GridModel { gain, lag, dead_time }));
                    }
                }
                dead_time += DEAD_TIME_SPACING;
            }
        }
        let (cost, likeliest) = best;
        let given = self.fits[GIVEN_LAG][GIVEN_DEAD_TIME];
        let given_cost = self.answer - 2.0 * given.product + given.square;
        likeliest.map(|model| {
            let is_shown = model.gain > 1.0 || given_cost - cost > SIGNIFICANT;
            if is_shown { model } else { GridModel::GIVEN }
        })
    }

    /// Uses a model from now on; returns whether it is another one.
    pub fn adopt(&mut self, model: GridModel) -> bool {
        std::mem::replace(&mut self.in_use, model) != model
    }
}

impl GridModel {
    /// The given model.
    pub const GIVEN: Self = Self { gain: 1.0, lag: GIVEN_LAG, dead_time: 1.0 };
}

impl Sums {
    const NONE: [[Self; DEAD_TIMES]; LAGS.len()] =
        [[Self { product: 0.0, square: 0.0 }; DEAD_TIMES]; LAGS.len()];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash::{mix, normal_pair};

    const SIGMA: f64 = 0.007;

    fn given() -> Fopdt {
        Fopdt::new(1.0, 0.84, 0.41).unwrap()
    }

    /// The model after a step of 0.6 MPa of a plant: a short push, and what the given model needs.
    fn shown(plant: Fopdt, takes_s: f64) -> Option<Fopdt> {
        let mut models = PlantModel::new(given(), 5.0, 0.2);
        let mut history = CommandHistory::new(&plant, 5.0, 0.2);
        models.begin_step(0.0);
        for (at_s, speed) in [(0.0, 3.0), (0.1, 0.8)] {
            models.push(at_s, speed);
            history.push(at_s, speed);
        }
        let mut now_s = 0.0;
        for i in 0.. {
            now_s += 0.02;
            if now_s > takes_s {
                break;
            }
            let [noise, _] = normal_pair(mix(&[3, i]));
            let moved = history.pressure_at(now_s - plant.dead_time_s()) - 0.2 * plant.gain();
            models.answered(now_s, moved + SIGMA * noise, SIGMA, 0.6);
        }
        let likeliest = models.likeliest()?;
        models.adopt(likeliest);
        Some(models.model())
    }

    #[test]
    fn an_answer_shows_gain_lag_and_dead_time() {
        for gain in [0.5, 0.8, 1.0, 1.3, 2.0] {
            for lag in [0.5, 0.84, 1.6] {
                for dead_s in [0.12, 0.3, 0.6, 0.8] {
                    let plant = Fopdt::new(gain, lag, dead_s).unwrap();
                    let found = shown(plant, dead_s + 2.0 * lag).unwrap();
                    let names = format!("{plant:?}: {found:?}");
                    assert!((found.gain() / gain - 1.0).abs() < 0.2, "{names}");
                    assert!((found.lag_s() / lag - 1.0).abs() < 0.25, "{names}");
                    assert!((found.dead_time_s() - dead_s).abs() < 0.06, "{names}");
                }
            }
        }
    }

    #[test]
    fn noise_is_no_answer() {
        let late = Fopdt::new(1.0, 0.84, 50.0).unwrap();
        assert_eq!(shown(late, 10.0), None);
    }
}
