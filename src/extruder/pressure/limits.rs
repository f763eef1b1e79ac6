//! Keeps the screw's speed within its range and its rate of change.

use super::{PressureError, within};
use crate::units::Rpm;

/// What the screw may be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    min: f64,
    max: f64,
    max_rpm_per_s: f64,
}

/// The limit that shaped a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Limit {
    /// None did.
    #[default]
    None,
    /// The screw may not turn slower.
    Slowest,
    /// The screw may not turn faster.
    Fastest,
    /// The screw may not speed up faster.
    Rising,
    /// The screw may not slow down faster.
    Falling,
}

/// A command to the screw, within the limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Speed to turn at.
    pub speed: Rpm,
    /// The limit that shaped it.
    pub limit: Limit,
}

impl Limits {
    /// From the slowest and the fastest speed and the fastest change
    /// \[rpm/s\]. Fails where nothing is left between them.
    pub fn new(min: Rpm, max: Rpm, max_rpm_per_s: f64) -> Result<Self, PressureError> {
        if min >= max {
            return Err(PressureError::Limits { min, max });
        }
        let what = "the fastest change [rpm/s]";
        within(what, max_rpm_per_s, f64::MIN_POSITIVE..=1e12, "above 0 and at most 1e12")?;
        let (min, max) = (min.get(), max.get());
        within("the fastest speed [rpm]", max.abs().max(min.abs()), 0.0..=1e9, "at most 1e9")?;
        Ok(Self { min, max, max_rpm_per_s })
    }

    /// The command nearest to a demand \[rpm\], `dt_s` after `last_rpm`. The
    /// range goes before the rate. A demand that is no number keeps the last.
    pub fn apply(&self, demand_rpm: f64, last_rpm: f64, dt_s: f64) -> Command {
        let last = last_rpm.clamp(self.min, self.max);
        let demand = if demand_rpm.is_nan() { last } else { demand_rpm };
        let ranged = demand.clamp(self.min, self.max);
        let reach = self.max_rpm_per_s * dt_s.max(0.0);
        let speed = ranged.clamp(last - reach, last + reach);
        let limit = if speed < ranged {
            Limit::Rising
        } else if speed > ranged {
            Limit::Falling
        } else if demand < self.min {
            Limit::Slowest
        } else if demand > self.max {
            Limit::Fastest
        } else {
            Limit::None
        };
        Command { speed: Rpm::new(speed).unwrap_or_default(), limit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits() -> Limits {
        Limits::new(Rpm::ZERO, Rpm::constant(3.0), 10.0).unwrap()
    }

    #[test]
    fn the_limit_that_acted_is_told() {
        let at = |demand, last| limits().apply(demand, last, 0.05);
        assert_eq!(at(1.2, 1.0), Command { speed: Rpm::constant(1.2), limit: Limit::None });
        assert_eq!(at(9.0, 2.9), Command { speed: Rpm::constant(3.0), limit: Limit::Fastest });
        assert_eq!(at(-1.0, 0.1), Command { speed: Rpm::ZERO, limit: Limit::Slowest });
        assert_eq!(at(2.0, 1.0), Command { speed: Rpm::constant(1.5), limit: Limit::Rising });
        assert_eq!(at(0.0, 1.0), Command { speed: Rpm::constant(0.5), limit: Limit::Falling });
        assert_eq!(at(f64::NAN, 1.0), Command { speed: Rpm::constant(1.0), limit: Limit::None });
    }

    #[test]
    fn limits_that_leave_nothing_are_refused() {
        assert!(Limits::new(Rpm::constant(3.0), Rpm::constant(3.0), 1.0).is_err());
        assert!(Limits::new(Rpm::ZERO, Rpm::constant(3.0), 0.0).is_err());
        assert!(Limits::new(Rpm::ZERO, Rpm::constant(3.0), f64::NAN).is_err());
    }

    proptest! {
        #[test]
        fn limits_hold_for_any_demand(
            demand in any::<f64>(), last in 0.0..3.0_f64, dt in 0.0..1.0_f64,
        ) {
            let speed = limits().apply(demand, last, dt).speed.get();
            prop_assert!((0.0..=3.0).contains(&speed));
            prop_assert!((speed - last).abs() <= 10.0 * dt + 1e-12);
        }
    }
}
