//! Keeps setpoints within the cell's range and acceleration, and reports which limit acted.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

use crate::core::{MmPerS, MmPerS2, Span};

/// Which limit acted on a setpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum SpeedLimit {
    /// No limit acted.
    #[default]
    None,
    /// The lowest speed of the cell.
    MinSpeed,
    /// The highest speed of the cell.
    MaxSpeed,
    /// The acceleration of the cell, while speeding up.
    Acceleration,
    /// The acceleration of the cell, while slowing down.
    Deceleration,
    /// A limit of the robot's own: it moves slower than its setpoint.
    RobotSlower,
    /// A limit of the robot's own: it moves faster than its setpoint.
    RobotFaster,
}

/// Range and fastest change of setpoints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLimits {
    /// Lowest setpoint.
    pub min_speed: MmPerS,
    /// Highest setpoint.
    pub max_speed: MmPerS,
    /// Fastest change of setpoints.
    pub max_accel: MmPerS2,
}

/// A setpoint within the limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedSpeed {
    /// The setpoint.
    pub speed: MmPerS,
    /// The limit that acted on it.
    pub limit: SpeedLimit,
}

impl SpeedLimits {
    /// The setpoint nearest to a demand within the limits, `dt` after the last one. The
    /// range has priority over the acceleration: a last setpoint outside the range is left
    /// at once.
    pub fn limit_setpoint(&self, demand: MmPerS, last: MmPerS, dt: Span) -> LimitedSpeed {
        let (ranged, range_limit) = if demand < self.min_speed {
            (self.min_speed, SpeedLimit::MinSpeed)
        } else if demand > self.max_speed {
            (self.max_speed, SpeedLimit::MaxSpeed)
        } else {
            (demand, SpeedLimit::None)
        };
        let last = last.max(self.min_speed).min(self.max_speed);
        let max_change = self.max_accel * dt.max(Span::ZERO);
        if ranged > last + max_change {
            LimitedSpeed { speed: last + max_change, limit: SpeedLimit::Acceleration }
        } else if ranged < last - max_change {
            LimitedSpeed { speed: last - max_change, limit: SpeedLimit::Deceleration }
        } else {
            LimitedSpeed { speed: ranged, limit: range_limit }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LIMITS: SpeedLimits = SpeedLimits {
        min_speed: MmPerS::constant(60.0),
        max_speed: MmPerS::constant(150.0),
        max_accel: MmPerS2::constant(100.0),
    };

    fn apply(demand: f64, last: f64, dt_s: f64) -> (f64, SpeedLimit) {
        let limited = LIMITS.limit_setpoint(
            MmPerS::constant(demand),
            MmPerS::constant(last),
            Span::from_secs(dt_s),
        );
        (limited.speed.get(), limited.limit)
    }

    #[test]
    fn the_limit_that_acted_is_named() {
        assert_eq!(apply(100.0, 100.0, 0.2), (100.0, SpeedLimit::None));
        assert_eq!(apply(20.0, 61.0, 0.2), (60.0, SpeedLimit::MinSpeed));
        assert_eq!(apply(500.0, 149.0, 0.2), (150.0, SpeedLimit::MaxSpeed));
        assert_eq!(apply(140.0, 100.0, 0.2), (120.0, SpeedLimit::Acceleration));
        assert_eq!(apply(70.0, 100.0, 0.2), (80.0, SpeedLimit::Deceleration));
    }

    proptest! {
        #[test]
        fn no_demand_leaves_the_range_or_the_acceleration(
            demand in -1e6..1e6, last in 60.0..150.0, dt_s in 0.0..1.0,
        ) {
            let (speed, _) = apply(demand, last, dt_s);
            prop_assert!((60.0..=150.0).contains(&speed));
            prop_assert!((speed - last).abs() <= 100.0 * dt_s + 1e-6);
        }
    }
}
