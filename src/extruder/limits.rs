//! Keeps an extruder's commands within their range and rate, and reports which limit acted.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use crate::core::Span;

/// Range and rate of commands, in the unit of the extruder's command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandLimits {
    min: f64,
    max: f64,
    rate_per_s: f64,
}

/// Limits that leave no command.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum LimitError {
    /// The range is empty.
    #[error("commands from {min} to {max}: the largest must be more than the smallest")]
    Empty {
        /// Smallest command.
        min: f64,
        /// Largest command.
        max: f64,
    },
    /// A command could never change; fastest change per second.
    #[error("commands that change by {0} a second: more than 0 is needed")]
    Rate(f64),
}

/// Which limit acted on a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CommandLimit {
    /// No limit acted.
    #[default]
    None,
    /// The smallest command.
    Min,
    /// The largest command.
    Max,
    /// The fastest rise.
    Rise,
    /// The fastest fall.
    Fall,
}

impl CommandLimits {
    /// From `min` to `max`, with at most `rate_per_s` of change per second.
    pub fn new(min: f64, max: f64, rate_per_s: f64) -> Result<Self, LimitError> {
        if !(min.is_finite() && max.is_finite() && min < max) {
            return Err(LimitError::Empty { min, max });
        }
        if !(rate_per_s.is_finite() && rate_per_s > 0.0) {
            return Err(LimitError::Rate(rate_per_s));
        }
        Ok(Self { min, max, rate_per_s })
    }

    /// Smallest and largest command.
    pub const fn range(&self) -> (f64, f64) {
        (self.min, self.max)
    }

    /// Fastest change per second.
    pub const fn rate_per_s(&self) -> f64 {
        self.rate_per_s
    }

    /// The same limits for deviations from a command.
    pub fn about(&self, command: f64) -> Self {
        Self { min: self.min - command, max: self.max - command, ..*self }
    }

    /// The command while nothing is extruded: 0, or the nearest in range.
    pub const fn idle(&self) -> f64 {
        0.0_f64.clamp(self.min, self.max)
    }

    /// The command nearest to a demand within the limits, `dt` after the last one. A demand
    /// that is not finite repeats the last command. The range has priority over the rate: a
    /// last command outside the range is left at once.
    pub fn apply(&self, demand: f64, last: f64, dt: Span) -> (f64, CommandLimit) {
        let last = if last.is_finite() { last.clamp(self.min, self.max) } else { self.min };
        if !demand.is_finite() {
            return (last, CommandLimit::None);
        }
        let (ranged, limit) = if demand < self.min {
            (self.min, CommandLimit::Min)
        } else if demand > self.max {
            (self.max, CommandLimit::Max)
        } else {
            (demand, CommandLimit::None)
        };
        let max_change = self.rate_per_s * dt.max(Span::ZERO).secs();
        if ranged > last + max_change {
            (last + max_change, CommandLimit::Rise)
        } else if ranged < last - max_change {
            (last - max_change, CommandLimit::Fall)
        } else {
            (ranged, limit)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn limits() -> CommandLimits {
        CommandLimits::new(5.0, 60.0, 40.0).unwrap()
    }

    #[test]
    fn the_limit_that_acted_is_named() {
        let apply = |demand, last, dt_s| limits().apply(demand, last, Span::from_secs(dt_s));
        assert_eq!(apply(30.0, 30.0, 0.02), (30.0, CommandLimit::None));
        assert_eq!(apply(0.0, 5.5, 0.02), (5.0, CommandLimit::Min));
        assert_eq!(apply(99.0, 59.9, 0.02), (60.0, CommandLimit::Max));
        assert_eq!(apply(50.0, 30.0, 0.5), (50.0, CommandLimit::None));
        assert_eq!(apply(55.0, 30.0, 0.5), (50.0, CommandLimit::Rise));
        assert_eq!(apply(5.0, 30.0, 0.5), (10.0, CommandLimit::Fall));
        assert_eq!(apply(f64::NAN, 30.0, 0.5), (30.0, CommandLimit::None));
    }

    #[test]
    fn empty_limits_are_refused() {
        assert!(CommandLimits::new(5.0, 5.0, 1.0).is_err());
        assert!(CommandLimits::new(0.0, f64::NAN, 1.0).is_err());
        let error = CommandLimits::new(0.0, 5.0, 0.0).unwrap_err().to_string();
        assert!(error.contains("by 0 a second"), "{error}");
    }

    proptest! {
        #[test]
        fn no_demand_leaves_the_range(demand in prop::num::f64::ANY, last in prop::num::f64::ANY) {
            let (command, _) = limits().apply(demand, last, Span::from_secs(0.02));
            prop_assert!((5.0..=60.0).contains(&command), "{command}");
        }
    }
}
