//! `[robot]`: how often the robot gets setpoints, and how a bead begins.

use crate::core::{Mm, MmPerS};
use crate::document::Table;
use crate::width_control::limiter::SpeedLimits;

/// The robot of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotSettings {
    /// Setpoints a second.
    pub rate_hz: f64,
    /// Speed of the first part of a bead.
    pub start_speed: MmPerS,
    /// Path length at the start speed before control begins.
    pub start_length: Mm,
    /// Length of every bead, if the file says so.
    pub bead_length: Option<Mm>,
    /// How long a setpoint holds on the robot \[ms\].
    pub valid_ms: u32,
}

pub(super) fn read_robot(table: &Table<'_>, limits: Option<SpeedLimits>) -> Option<RobotSettings> {
    let rate_hz = table.number("rate_hz", 0.5..=1000.0);
    let start_speed = table.number("start_speed_mm_per_s", 0.0..=10_000.0);
    let start_length = table.number("start_length_mm", 0.0..=1e6);
    let bead_length = table.optional_number("bead_length_mm", 1e-3..=1e9);
    let valid_ms = table.integer_or("valid_ms", 100..=1000, 600);
    if let (Some(rate_hz), Some(valid_ms)) = (rate_hz, valid_ms)
        && u32::try_from(valid_ms).is_ok_and(|ms| f64::from(ms) < 1.5e3 / rate_hz)
    {
        let expected =
            format!("at least {:.0}, one and a half periods of rate_hz", 1.5e3 / rate_hz);
        table.report("valid_ms", valid_ms.to_string(), expected);
    }
    if let (Some(limits), Some(speed)) = (limits, start_speed)
        && !(limits.min_speed.get()..=limits.max_speed.get()).contains(&speed)
    {
        let expected =
            format!("a speed within [limits], {} to {}", limits.min_speed, limits.max_speed);
        table.report("start_speed_mm_per_s", speed.to_string(), expected);
    }
    Some(RobotSettings {
        rate_hz: rate_hz?,
        start_speed: MmPerS::new(start_speed?).ok()?,
        start_length: Mm::new(start_length?).ok()?,
        bead_length: bead_length.and_then(|length| Mm::new(length).ok()),
        valid_ms: u32::try_from(valid_ms?).ok()?,
    })
}
