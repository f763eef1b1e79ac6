//! The process at the nozzle as the paper gives it, and how far it may be off.

use crate::extruder::pressure::{Fopdt, PressureError};

/// Variance of a reading \[MPa²\] (the exponent's sign is misprinted in the
/// paper).
pub const NOISE_MPA2: f64 = 4.98e-5;
/// Variance of the wandering that the paper's filter is set for \[MPa²\].
pub const DRIFT_MPA2: f64 = 2e-5;
/// Lag of the process \[s\].
pub const LAG_S: f64 = 0.84;
/// Dead time of the process \[s\].
pub const DEAD_TIME_S: f64 = 0.41;
/// Target of the step and of the steady experiment \[MPa\].
pub const STEP_MPA: f64 = 0.6;
/// Step of the load, at the plant's input \[rpm\].
pub const LOAD_RPM: f64 = 0.1;
/// How far the process may be from the model, as a share: two standard
/// deviations of what our law allows for.
pub const MODEL_ERROR: f64 = 0.2;

/// The process by the factors that gain, lag and dead time are off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Of the gain.
    pub gain: f64,
    /// Of the lag.
    pub lag: f64,
    /// Of the dead time.
    pub dead_time: f64,
}

impl Factors {
    /// The process as the model has it.
    pub const NONE: Self = Self { gain: 1.0, lag: 1.0, dead_time: 1.0 };

    /// Each alone by [`OFF`] up and down.
    pub const fn singles() -> [(&'static str, Self); 6] {
        let (more, less) = (1.0 + MODEL_ERROR, 1.0 - MODEL_ERROR);
        [
            ("gain +20 %", Self { gain: more, ..Self::NONE }),
            ("gain −20 %", Self { gain: less, ..Self::NONE }),
            ("lag +20 %", Self { lag: more, ..Self::NONE }),
            ("lag −20 %", Self { lag: less, ..Self::NONE }),
            ("dead time +20 %", Self { dead_time: more, ..Self::NONE }),
            ("dead time −20 %", Self { dead_time: less, ..Self::NONE }),
        ]
    }

    /// All 27 combinations of up, not and down.
    pub fn all() -> impl Iterator<Item = Self> {
        let each = [1.0 - MODEL_ERROR, 1.0, 1.0 + MODEL_ERROR];
        each.into_iter().flat_map(move |gain| {
            each.into_iter().flat_map(move |lag| {
                each.into_iter().map(move |dead_time| Self { gain, lag, dead_time })
            })
        })
    }

    /// The process that is off by these factors.
    pub fn process(self) -> Result<Fopdt, PressureError> {
        Fopdt::new(self.gain, LAG_S * self.lag, DEAD_TIME_S * self.dead_time)
    }
}

/// The model that every law is given.
pub fn model() -> Result<Fopdt, PressureError> {
    Factors::NONE.process()
}
