//! Monotonic time as data: a [`Stamp`] counts from the start of the run, a
//! [`Span`] is signed so that delayed data shows. Nothing here reads a clock.

use std::ops::{Add, Sub};
use std::time::Duration;

use serde::{Deserialize, Serialize};

const NS_PER_S: f64 = 1e9;

/// A moment, in nanoseconds since the run began.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Stamp(u64);

/// A signed difference of two moments, in nanoseconds.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Span(i64);

impl Stamp {
    /// The start of the run.
    pub const START: Self = Self(0);

    /// From nanoseconds since the run began.
    pub const fn from_ns(ns: u64) -> Self {
        Self(ns)
    }

    /// From seconds since the run began; a negative value and NaN give the start.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a float-to-integer cast saturates, which is what is wanted"
    )]
    pub fn from_secs(secs: f64) -> Self {
        Self((secs * NS_PER_S).round() as u64)
    }

    /// Nanoseconds since the run began.
    pub const fn ns(self) -> u64 {
        self.0
    }

    /// Seconds since the run began.
    #[expect(
        clippy::cast_precision_loss,
        reason = "exact to the nanosecond for the first 104 days of a run"
    )]
    pub fn secs(self) -> f64 {
        self.0 as f64 / NS_PER_S
    }
}

impl Span {
    /// A span of zero.
    pub const ZERO: Self = Self(0);

    /// From signed nanoseconds.
    pub const fn from_ns(ns: i64) -> Self {
        Self(ns)
    }

    /// From whole milliseconds.
    pub const fn from_millis(ms: i64) -> Self {
        Self(ms.saturating_mul(1_000_000))
    }

    /// From seconds; saturates, and NaN is zero.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a float-to-integer cast saturates, which is what is wanted"
    )]
    pub fn from_secs(secs: f64) -> Self {
        Self((secs * NS_PER_S).round() as i64)
    }

    /// Signed nanoseconds.
    pub const fn ns(self) -> i64 {
        self.0
    }

    /// As the length of a wait; 0 if it is negative.
    pub fn wait(self) -> Duration {
        Duration::from_nanos(u64::try_from(self.0).unwrap_or(0))
    }

    /// Signed seconds.
    #[expect(
        clippy::cast_precision_loss,
        reason = "exact to the nanosecond for spans under 104 days"
    )]
    pub fn secs(self) -> f64 {
        self.0 as f64 / NS_PER_S
    }
}

impl Sub for Stamp {
    type Output = Span;
    fn sub(self, earlier: Self) -> Span {
        let ns = i128::from(self.0) - i128::from(earlier.0);
        let clamped = ns.clamp(i128::from(i64::MIN), i128::from(i64::MAX));
        Span(i64::try_from(clamped).unwrap_or(i64::MAX))
    }
}

impl Add<Span> for Stamp {
    type Output = Self;
    fn add(self, span: Span) -> Self {
        Self(self.0.saturating_add_signed(span.0))
    }
}

impl Sub<Span> for Stamp {
    type Output = Self;
    fn sub(self, span: Span) -> Self {
        Self(self.0.saturating_add_signed(span.0.saturating_neg()))
    }
}

impl Add for Span {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Span {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_data_has_a_negative_span() {
        let span = Stamp::from_ns(5) - Stamp::from_ns(9);
        assert_eq!(span.ns(), -4);
        assert!(span < Span::ZERO);
    }

    #[test]
    fn time_before_the_start_is_the_start() {
        assert_eq!(Stamp::from_ns(3) + Span::from_ns(-9), Stamp::START);
        assert_eq!(Stamp::from_secs(-1.0), Stamp::START);
        assert_eq!(Stamp::from_secs(f64::NAN), Stamp::START);
    }

    #[test]
    fn seconds_survive_the_round_trip() {
        assert_eq!(Stamp::from_secs(12.345_678_901).ns(), 12_345_678_901);
        assert_eq!(Span::from_millis(-250).secs(), -0.25);
    }
}
