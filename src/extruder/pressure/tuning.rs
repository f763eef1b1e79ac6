//! Tuning rules of the predictive controller, from the model, the noise and the uncertainty of
//! the model. One set for set points, loads, drift and noise. L is the dead time, τ the lag, σ
//! the standard deviation of a reading.
//!
//! | setting | rule | reason |
//! |---|---|---|
//! | reference lag | 0.56·L, at least τ/4 | the pressure has gone 0.87 of the way when the first correction can act, a dead time after the first sign of an error: an error of 20 % in the gain stays below 5 % of overshoot |
//! | feedback | ⅔·L, at least τ/4 | margin to the dead time |
//! | model sigma | relative standard deviation of gain, lag and dead time | ±20 % is two standard deviations |
//! | load drift | σ²/4 per τ | drift over many lags is followed, noise is not |
//! | load step | 8.5·σ | prior standard deviation of a step of the load |
//! | threshold | 3.65 | a load of 0.1 MPa in the paper's noise is detected after 0.14 s; one false alarm in 25 s, which later readings correct |
//! | dead zone | 0.3 within 5·σ, 1 from 10·σ | a drift within the noise moves the screw little; at most 3.5·σ of it stays in the pressure |
//! | caution | 1.45 standard deviations, 2·σ beyond the target | on the way to a target not only the expected pressure, but its upper bound must not pass the target |

use super::dead_zone::DeadZone;
use super::kalman::PressureNoise;
use super::{Fopdt, PressureError, within};

/// Settings of the predictive controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Lag of the reference behind the target \[s\].
    pub reference_s: f64,
    /// Time constant in which the feedback closes on the reference \[s\].
    pub feedback_s: f64,
    /// Relative standard deviation of gain, lag and dead time of the model.
    pub model_sigma: f64,
    /// Time constant in which the model's errors return to their prior while the pressure
    /// moves \[s\].
    pub forgetting_s: f64,
    /// Variance of a reading \[MPa²\].
    pub reading_variance: f64,
    /// Random walk of the load: growth of its variance \[MPa²/s\].
    pub load_drift: f64,
    /// Standard deviation of a step of the load \[MPa\].
    pub load_step_sigma: f64,
    /// Log likelihood ratio from which a step of the load is detected.
    pub load_step_threshold: f64,
    /// The dead zone around the feedforward.
    pub zone: DeadZone,
    /// Time constant in which a controller that took over returns to the dead zone \[s\].
    pub return_s: f64,
    /// Standard deviations of the predicted pressure that must not pass the target.
    pub caution_sigmas: f64,
    /// Margin of that pressure beyond the target \[MPa\].
    pub margin: f64,
}

impl Tuning {
    /// By the rules. `model_sigma` is the relative standard deviation of gain, lag and dead
    /// time: 0.1 where they may be off by 20 %.
    pub fn of(
        model: &Fopdt,
        noise: &PressureNoise,
        model_sigma: f64,
    ) -> Result<Self, PressureError> {
        let what = "the model's relative standard deviation";
        within(what, model_sigma, 0.01..=0.2, "between 0.01 and 0.2")?;
        let (lag, dead) = (model.lag_s(), model.dead_time_s());
        let sigma = noise.sigma().get();
        Ok(Self {
            reference_s: (0.56 * dead).max(0.25 * lag),
            feedback_s: (dead * 2.0 / 3.0).max(0.25 * lag),
            model_sigma,
            forgetting_s: 12.0 * lag,
            reading_variance: noise.reading_mpa2(),
            load_drift: 0.25 * noise.reading_mpa2() / lag,
            load_step_sigma: 8.5 * sigma,
            load_step_threshold: 3.65,
            zone: DeadZone { inner_gain: 0.3, inner: 5.0 * sigma, outer: 10.0 * sigma },
            return_s: 6.0 * lag,
            caution_sigmas: 1.45,
            margin: 2.0 * sigma,
        })
    }

    /// Standard deviation of a reading \[MPa\].
    pub fn sigma(&self) -> f64 {
        self.reading_variance.sqrt()
    }
}
