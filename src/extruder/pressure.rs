//! The pressure loop: control of the pressure at the nozzle by the screw's speed. The
//! controllers of Ma et al. 2026, and a predictive one.
//!
//! ```text
//!  target ──▶ controller ──rpm──▶ limits ──▶ screw ··dead time, lag··▶ pressure
//!              ▲                                                          │
//!              └──────────────────── readings, 50 Hz ─────────────────────┘
//! ```
//!
//! Readings and commands have independent rates. [`PressureController::measured`] takes each
//! reading; [`PressureController::step`] gives each command, 20 a second in the paper. Model
//! predictions are exact at any rate. A controller reads no clock, allocates nothing in these two
//! calls and never leaves the range of its [`super::limits::CommandLimits`] \[rpm\]; the limit of
//! the rate counts from the first command on, which the supervisor takes from standstill itself.

use super::limits::{CommandLimit, LimitError};
use crate::core::{MPa, Rpm, Span, Stamp};

pub mod call_times;
pub mod command_history;
pub mod kalman;
pub mod load;
pub mod load_step;
pub mod pi;
pub mod plant_model;
pub mod predictive;
pub mod reference;
pub mod residual;
pub mod smith;
pub mod target_step;
pub mod tuning;
pub mod vsfc;

#[cfg(test)]
mod tests;

pub use call_times::InitialState;

/// Longest dead time and lag that are accepted \[s\], as a bound on typing errors and on the
/// memory of commands.
pub const MAX_TIME_CONSTANT_S: f64 = 60.0;

/// Settings out of range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PressureError {
    /// A setting outside its range.
    #[error("{what} is {found}: it must be {wanted}")]
    OutOfRange {
        /// Name of the setting, with its unit.
        what: &'static str,
        /// The value.
        found: f64,
        /// The range, in words.
        wanted: &'static str,
    },
    /// Limits of the command.
    #[error("the screw's speed [rpm]: {0}")]
    Limits(#[from] LimitError),
    /// Too few readings to identify the noise.
    #[error("noise identification from {found} readings: at least {wanted} are needed")]
    TooFew {
        /// Number of readings.
        found: usize,
        /// Number that is needed.
        wanted: usize,
    },
    /// Readings that show no noise; variance of the change from one to the next \[MPa²\].
    #[error(
        "the readings show no noise (their changes have a variance of {0:.3e} MPa²): \
         a sensor that is stuck, readings that were smoothed before, or a pressure that moves far \
         more than they scatter"
    )]
    NoNoise(f64),
}

/// A reading that a controller rejects.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ReadingRefused {
    /// Older than the last one, by a time \[s\].
    #[error("a reading is {0} s older than the last one")]
    OutOfOrder(f64),
    /// Implausible.
    #[error("the pressure reads {found}: at most ±{most} can be; check the sensor and its scale")]
    Implausible {
        /// The reading.
        found: MPa,
        /// The largest magnitude that is accepted.
        most: MPa,
    },
}

/// First-order lag with dead time, K·e^(−Ls)/(τs + 1), from the screw's speed
/// to the pressure at the nozzle. Ma et al. 2026, eq. (7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fopdt {
    gain: f64,
    lag_s: f64,
    dead_time_s: f64,
}

impl Fopdt {
    /// From the gain \[MPa/rpm\], the lag and the dead time \[s\]. Fails on a gain or a lag that
    /// is not positive and on times over [`MAX_TIME_CONSTANT_S`].
    pub fn new(gain_mpa_per_rpm: f64, lag_s: f64, dead_time_s: f64) -> Result<Self, PressureError> {
        within("the gain [MPa/rpm]", gain_mpa_per_rpm, 1e-9..=1e9, "between 1e-9 and 1e9")?;
        within("the lag [s]", lag_s, 1e-3..=MAX_TIME_CONSTANT_S, "between 0.001 and 60")?;
        within("the dead time [s]", dead_time_s, 0.0..=MAX_TIME_CONSTANT_S, "between 0 and 60")?;
        Ok(Self { gain: gain_mpa_per_rpm, lag_s, dead_time_s })
    }

    /// Static gain \[MPa/rpm\].
    pub const fn gain(&self) -> f64 {
        self.gain
    }

    /// Time constant of the lag \[s\].
    pub const fn lag_s(&self) -> f64 {
        self.lag_s
    }

    /// Dead time \[s\].
    pub const fn dead_time_s(&self) -> f64 {
        self.dead_time_s
    }
}

/// A command to the screw, within the limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScrewCommand {
    /// The speed.
    pub speed: Rpm,
    /// The limit that acted on it.
    pub limit: CommandLimit,
}

/// A controller of the pressure loop.
pub trait PressureController {
    /// A reading of the pressure at the nozzle. Rejects one that is older than the last or
    /// implausible, without a change of state.
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused>;

    /// The command from now on. `target` is the target pressure [`Self::preview`] ahead where
    /// that is known, else now. A call that is not after the last one repeats its command.
    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand;

    /// The speed that was applied from `now` on in place of the last command, where other
    /// limits acted.
    fn settle(&mut self, now: Stamp, applied: Rpm);

    /// Whether the pressure has not answered a step of its target, for longer than any plant takes
    /// that is like the model.
    fn is_unanswered(&self, _now: Stamp) -> bool {
        false
    }

    /// How far ahead the controller can use the target.
    fn preview(&self) -> Span {
        Span::ZERO
    }
}

/// Fails where a number is outside a range.
fn within(
    what: &'static str,
    found: f64,
    range: std::ops::RangeInclusive<f64>,
    wanted: &'static str,
) -> Result<(), PressureError> {
    let error = PressureError::OutOfRange { what, found, wanted };
    if range.contains(&found) { Ok(()) } else { Err(error) }
}
