//! Tuning rules of the predictive controller, from the model and the noise. One set for set points,
//! loads, drift and noise. L is the dead time, τ the lag, σ the standard deviation of a reading.
//!
//! | setting | rule | reason |
//! |---|---|---|
//! | proportional gain | 0.93·τ/(L + s) for each unit of gain, the denominator at least τ/4 | as quick as the paper's PI control, 1.5, and stable with half or twice any parameter of the model; s, 0.08 s in the paper's loop, is what hold and filter add to the dead time |
//! | integral time | 0.95·τ, at least 2·s | the same |
//! | reference lag | 0.56·L, at least τ/4 | the pressure follows a target that moves; a step of the target is not delayed by it |
//! | step of the target | from 5·σ | a smaller one cannot be told from noise in time |
//! | quiet error | 5·σ | a drift within the noise moves the screw little |
//! | awake | 10·(L + τ), at least 10 integral times over the proportional gain | after a step the feedback works in full until the error is gone |

use super::Fopdt;
use super::kalman::PressureNoise;

/// Readings by which their filter delays, with the mean age of the last one. Derived: one, and a half.
const FILTER_READINGS: f64 = 1.5;

/// Times between two readings and two commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopPeriods {
    /// Between readings \[s\].
    pub reading_s: f64,
    /// Between commands \[s\].
    pub command_s: f64,
}

impl LoopPeriods {
    /// 50 readings and 20 commands a second: Ma et al. 2026.
    pub const MA_2026: Self = Self { reading_s: 0.02, command_s: 0.05 };

    /// Delay of the filtered residual behind the model at a command \[s\].
    pub fn filter_delay_s(self) -> f64 {
        FILTER_READINGS * self.reading_s + 0.5 * self.command_s
    }

    /// What sampling adds to the dead time \[s\]: the filter, and the hold of a command.
    pub fn sampling_s(self) -> f64 {
        self.filter_delay_s() + 0.5 * self.command_s
    }
}

/// Settings of the predictive controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Proportional gain, for each unit of the model's gain.
    pub proportional: f64,
    /// Integral time \[s\].
    pub integral_s: f64,
    /// Lag of the reference behind a target that moves \[s\].
    pub reference_s: f64,
    /// Standard deviation of a reading \[MPa\].
    pub sigma: f64,
    /// Change of the target from one command to the next that is a step \[MPa\].
    pub target_step: f64,
    /// Error within which the feedback works in part \[MPa\].
    pub quiet_error: f64,
    /// Time after a step in which it works in full \[s\].
    pub awake_s: f64,
    /// Times between readings and commands.
    pub periods: LoopPeriods,
}

impl Tuning {
    /// Proportional gain for each unit of a model's gain, by its rule.
    pub fn proportional(model: &Fopdt, periods: LoopPeriods) -> f64 {
        let (lag, dead) = (model.lag_s(), model.dead_time_s());
        0.93 * lag / (dead + periods.sampling_s()).max(0.25 * lag)
    }

    /// By the rules.
    pub fn of(model: &Fopdt, noise: &PressureNoise, periods: LoopPeriods) -> Self {
        let (lag, dead) = (model.lag_s(), model.dead_time_s());
        let sigma = noise.sigma().get();
        let proportional = Self::proportional(model, periods);
        let integral_s = (0.95 * lag).max(2.0 * periods.sampling_s());
        Self {
            proportional,
            integral_s,
            reference_s: (0.56 * dead).max(0.25 * lag),
            sigma,
            target_step: 5.0 * sigma,
            quiet_error: 5.0 * sigma,
            awake_s: 10.0 * (dead + lag).max(integral_s / proportional),
            periods,
        }
    }
}
