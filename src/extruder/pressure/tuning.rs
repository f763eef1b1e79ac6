//! Tuning rules of the predictive controller, from the model and the noise. One set for set points,
//! loads, drift and noise. L is the dead time, τ the lag, σ the standard deviation of a reading.
//!
//! | setting | rule | reason |
//! |---|---|---|
//! | proportional gain | 0.93·τ/(L + 0.08 s) for each unit of gain, the denominator at least τ/4 | as quick as the paper's PI control, 1.5, and stable with half or twice any parameter of the model; hold and filter add 0.08 s to the dead time |
//! | integral time | 0.95·τ, at least 0.16 s | the same |
//! | reference lag | 0.56·L, at least τ/4 | the pressure follows a target that moves; a step of the target is not delayed by it |
//! | step of the target | from 5·σ | a smaller one cannot be told from noise in time |
//! | quiet error | 5·σ | a drift within the noise moves the screw little |
//! | awake | 10·(L + τ), at least 10 integral times over the proportional gain | after a step the feedback works in full until the error is gone |

use super::Fopdt;
use super::kalman::PressureNoise;

/// Dead time by the hold of a command and the filter of the readings \[s\], at 20 commands and 50
/// readings a second (Ma et al. 2026).
const SAMPLING_S: f64 = 0.08;

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
}

impl Tuning {
    /// By the rules.
    pub fn of(model: &Fopdt, noise: &PressureNoise) -> Self {
        let (lag, dead) = (model.lag_s(), model.dead_time_s());
        let sigma = noise.sigma().get();
        let proportional = 0.93 * lag / (dead + SAMPLING_S).max(0.25 * lag);
        let integral_s = (0.95 * lag).max(2.0 * SAMPLING_S);
        Self {
            proportional,
            integral_s,
            reference_s: (0.56 * dead).max(0.25 * lag),
            sigma,
            target_step: 5.0 * sigma,
            quiet_error: 5.0 * sigma,
            awake_s: 10.0 * (dead + lag).max(integral_s / proportional),
        }
    }
}
