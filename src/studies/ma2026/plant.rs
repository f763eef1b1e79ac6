//! The paper's process at the nozzle, and the errors of its model.

use crate::extruder::pressure::{Fopdt, PressureError};

/// Variance of a reading \[MPa²\]. Ma et al. 2026; the sign of the exponent is a misprint
/// (papers.md).
pub const NOISE_MPA2: f64 = 4.98e-5;
/// Variance of the random walk in the Kalman filter, for each reading \[MPa²\]: papers.md, "002",
/// "q 2·10⁻⁵".
pub const DRIFT_MPA2: f64 = 2e-5;
/// Lag of the process \[s\]. Ma et al. 2026.
pub const LAG_S: f64 = 0.84;
/// Dead time of the process \[s\]. Ma et al. 2026.
pub const DEAD_TIME_S: f64 = 0.41;
/// Target of the step and of the steady experiment \[MPa\]. Ma et al. 2026.
pub const STEP_MPA: f64 = 0.6;
/// Step of the load at the plant's input \[rpm\]: papers.md, "002".
pub const LOAD_RPM: f64 = 0.1;
/// Relative error of each parameter of the model: papers.md, "±20 % in one parameter". Our
/// controller is tuned for half of it as one standard deviation.
pub const MODEL_ERROR: f64 = 0.2;

/// Parameters of the plant over those of the model.
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
    /// A plant without model error.
    pub const NONE: Self = Self { gain: 1.0, lag: 1.0, dead_time: 1.0 };

    /// Plants with one parameter off by [`MODEL_ERROR`], up or down.
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

    /// Plants with all 27 combinations of too small, exact and too large parameters.
    pub fn all() -> impl Iterator<Item = Self> {
        let each = [1.0 - MODEL_ERROR, 1.0, 1.0 + MODEL_ERROR];
        each.into_iter().flat_map(move |gain| {
            each.into_iter().flat_map(move |lag| {
                each.into_iter().map(move |dead_time| Self { gain, lag, dead_time })
            })
        })
    }

    /// Number of parameters that are not the model's.
    pub fn wrong(self) -> usize {
        [self.gain, self.lag, self.dead_time].into_iter().filter(|factor| *factor != 1.0).count()
    }

    /// The plant.
    pub fn process(self) -> Result<Fopdt, PressureError> {
        Fopdt::new(self.gain, LAG_S * self.lag, DEAD_TIME_S * self.dead_time)
    }
}

/// The model that every controller is given.
pub fn model() -> Result<Fopdt, PressureError> {
    Factors::NONE.process()
}
