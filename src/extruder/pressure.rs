//! The pressure loop: what speed of the screw keeps the pressure at the nozzle
//! where it is wanted. Ma et al. 2026, with a law of our own beside theirs.
//!
//! ```text
//!  target ──▶ law ──rpm──▶ limits ──▶ screw ··dead time, lag··▶ pressure
//!              ▲                                                   │
//!              └───────────────── readings, 50 Hz ─────────────────┘
//! ```
//!
//! The rates are apart. [`PressureLaw::measured`] takes a reading whenever there is
//! one; [`PressureLaw::step`] gives a command whenever one is due, 20 times a second
//! in the paper; what a law foresees from its own commands is exact at any
//! rate, so that a feedforward at 200 Hz is the same call made more often.
//! Every law is a plain struct that is given the time, allocates nothing in
//! these two calls and never leaves its [`super::limits::CommandLimits`] \[rpm\].

use super::limits::{CommandLimit, LimitError};
use crate::core::time::{Span, Stamp};
use crate::core::units::{MPa, Rpm};

pub mod call_times;
pub mod command_history;
pub mod dead_zone;
pub mod hypothesis;
pub mod kalman;
pub mod load_step;
pub mod multiple_model;
pub mod pi;
pub mod predictive;
pub mod reference;
pub mod smith;
pub mod tuning;
pub mod vsfc;

#[cfg(test)]
mod tests;

pub use call_times::InitialState;

/// The longest dead time and lag that are taken \[s\].
pub const MAX_TIME_CONSTANT_S: f64 = 60.0;

/// Settings that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PressureError {
    /// A setting outside its range.
    #[error("{what} is {found}: it must be {wanted}")]
    OutOfRange {
        /// Name of the setting, with its unit.
        what: &'static str,
        /// What was given.
        found: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// Limits that leave nothing between them.
    #[error("the screw's speed [rpm]: {0}")]
    Limits(#[from] LimitError),
    /// Too little to tell the noise from.
    #[error("noise identification from {found} readings: at least {wanted} are needed")]
    TooFew {
        /// Readings that were given.
        found: usize,
        /// How many are needed.
        wanted: usize,
    },
    /// Readings that never change, or that tell no noise.
    #[error(
        "the readings show no noise (their changes have a variance of {variance:.3e} MPa²): \
         a sensor that is stuck, readings that were smoothed before, or a pressure that moves far \
         more than they scatter"
    )]
    NoNoise {
        /// Variance of the change from one reading to the next \[MPa²\].
        variance: f64,
    },
}

/// A reading that a law does not take.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ReadingRefused {
    /// Older than what the law knows already.
    #[error("a reading is {late_s} s older than the last one")]
    OutOfOrder {
        /// By how much \[s\].
        late_s: f64,
    },
    /// Beyond what the machine could have.
    #[error("the pressure reads {found}: at most ±{most} can be; check the sensor and its scale")]
    Implausible {
        /// What was read.
        found: MPa,
        /// The largest size that is taken.
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
    /// From the gain \[MPa/rpm\], the lag and the dead time \[s\]. Fails on a
    /// gain or a lag that is not positive and on times over [`LONGEST_S`].
    pub fn new(gain_mpa_per_rpm: f64, lag_s: f64, dead_time_s: f64) -> Result<Self, PressureError> {
        within("the gain [MPa/rpm]", gain_mpa_per_rpm, 1e-9..=1e9, "between 1e-9 and 1e9")?;
        within("the lag [s]", lag_s, 1e-3..=MAX_TIME_CONSTANT_S, "between 0.001 and 60")?;
        within("the dead time [s]", dead_time_s, 0.0..=MAX_TIME_CONSTANT_S, "between 0 and 60")?;
        Ok(Self { gain: gain_mpa_per_rpm, lag_s, dead_time_s })
    }

    /// Pressure for each rpm, once settled \[MPa/rpm\].
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
    /// Speed to turn at.
    pub speed: Rpm,
    /// The limit that shaped it.
    pub limit: CommandLimit,
}

/// A law of the pressure loop.
pub trait PressureController {
    /// Takes a reading of the pressure at the nozzle. Refuses one that is
    /// older than the last or beyond anything the machine could have, and is
    /// then as if it had not been.
    fn measured(&mut self, now: Stamp, pressure: MPa) -> Result<(), ReadingRefused>;

    /// The command from now on. `target` is what is wanted [`Self::lead`]
    /// ahead where that is known, and what is wanted now where it is not. A
    /// call that is not after the last one gives that one's command again.
    fn step(&mut self, now: Stamp, target: MPa) -> ScrewCommand;

    /// Learns that something else than its last command went to the screw from
    /// `now` on, where other limits than its own shaped it.
    fn settle(&mut self, now: Stamp, applied: Rpm);

    /// How far ahead the law would like to know the target.
    fn preview(&self) -> Span {
        Span::ZERO
    }
}

/// Whether a number is within a range, as an error where it is not.
fn within(
    what: &'static str,
    found: f64,
    range: std::ops::RangeInclusive<f64>,
    wanted: &'static str,
) -> Result<(), PressureError> {
    if range.contains(&found) {
        Ok(())
    } else {
        Err(PressureError::OutOfRange { what, found, wanted })
    }
}
