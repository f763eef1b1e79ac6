//! The rules that give the predictive law's settings from the model, the noise
//! and how far the model may be off. One set for set points, loads, drift and
//! noise.
//!
//! | setting | rule | why |
//! |---|---|---|
//! | reference | 0.56·L, at least τ/4 | the pressure is 0.87 of the way when the first correction can arrive, a dead time after the first sign: an error of 20 % in the gain stays below 5 % of overshoot |
//! | feedback | ⅔·L, at least τ/4 | the delay margin below |
//! | doubt | standard deviation of each parameter | ±20 % are two of it |
//! | wandering | σ²/4 each τ | drift over many lags is followed, noise is not |
//! | load | 8.5·σ | what a step of the load is taken for before it is measured |
//! | evidence | 3.65 | a load of 0.1 MPa in the paper's noise is seen after 0.14 s; one false sign in some 25 s, which is taken back |
//! | tunnel | 0.3 within 5·σ, all from 10·σ | a drift within the noise moves the screw little; at most 3.5·σ of it stay in the pressure |
//! | caution | 1.45 standard deviations, 2·σ beyond the target | on its way to a target the pressure that may be there, not only the likeliest, is kept from passing it |

use super::dead_zone::DeadZone;
use super::kalman::PressureNoise;
use super::{Fopdt, PressureError, within};

/// Settings of the predictive law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// Lag of the reference behind the target \[s\].
    pub reference_s: f64,
    /// Time constant in which the feedback closes on the reference \[s\].
    pub feedback_s: f64,
    /// Standard deviation of gain, lag and dead time about the model, as
    /// shares of them.
    pub model_sigma: f64,
    /// Time in which what was learnt about the model is forgotten while the
    /// pressure moves \[s\].
    pub forgetting_s: f64,
    /// Variance of a reading \[MPa²\].
    pub reading_variance: f64,
    /// Growth of the load's variance \[MPa²/s\].
    pub load_drift: f64,
    /// Standard deviation of a step of the load \[MPa\].
    pub load_step_sigma: f64,
    /// Logarithm of the likelihood ratio from which on a step of the load is
    /// taken for real.
    pub load_step_threshold: f64,
    /// The tunnel around the feedforward.
    pub zone: DeadZone,
    /// Time in which a law that took over goes back to the tunnel \[s\].
    pub return_s: f64,
    /// Standard deviations of the foretold pressure that are kept from passing
    /// the target.
    pub caution_sigmas: f64,
    /// How far beyond the target that pressure may be \[MPa\].
    pub margin: f64,
}

impl Tuning {
    /// By the rules. `doubt` is the standard deviation of the model's gain,
    /// lag and dead time, as shares of them: 0.1 where they may be off by 20 %.
    pub fn of(
        model: &Fopdt,
        noise: &PressureNoise,
        model_sigma: f64,
    ) -> Result<Self, PressureError> {
        within(
            "the model's relative standard deviation",
            model_sigma,
            0.01..=0.2,
            "between 0.01 and 0.2",
        )?;
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
