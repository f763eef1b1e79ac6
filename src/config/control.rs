//! `[control]` and `[limits]`: what the controller is to do, and what it may.

use crate::control::limiter::Limits;
use crate::control::pi::PiGains;
use crate::document::Table;
use crate::time::Span;
use crate::units::{Mm, MmPerS, MmPerS2};

/// Fastest that any robot of this kind moves, as a bound on typing errors.
const ANY_SPEED: std::ops::RangeInclusive<f64> = 0.0..=10_000.0;

/// What the width controller is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Width that is asked for.
    pub target: Mm,
    /// Gains of the loop, on the error in millimetres.
    pub gains: PiGains,
    /// Longest time between two widths over which the loop integrates; beyond
    /// it holds.
    pub max_gap: Span,
    /// Longest hold before the controller gives up and stops the robot.
    pub max_hold: Span,
}

/// `target_width_mm`, which stands alone in a cell that only measures.
pub fn read_target(control: &Table<'_>) -> Option<Mm> {
    control.number("target_width_mm", 0.1..=1000.0).and_then(|v| Mm::new(v).ok())
}

/// The rest of `[control]`. There are no defaults for gains.
pub fn read_control(control: &Table<'_>, target: Option<Mm>) -> Option<Control> {
    let law = control.required_choice("law", &[("pi", ())]);
    let kp = control.number("kp_per_s", 0.0..=1e4);
    let ki = control.number("ki_per_s2", 0.0..=1e4);
    // The 2022 paper counts the error in pixels; its gains are of that unit.
    let unit = control.number_or("error_unit_mm", 1e-4..=1e3, 1.0);
    let max_gap = control.number("max_gap_s", 0.01..=60.0);
    let max_hold = control.number("max_hold_s", 0.1..=3600.0);
    law?;
    let unit = unit?;
    Some(Control {
        target: target?,
        gains: PiGains { kp_per_s: kp? / unit, ki_per_s2: ki? / unit },
        max_gap: Span::from_secs(max_gap?),
        max_hold: Span::from_secs(max_hold?),
    })
}

/// `[limits]`. There are no defaults for safety.
pub fn read_limits(limits: &Table<'_>) -> Option<Limits> {
    let min = limits.number("min_speed_mm_per_s", ANY_SPEED);
    let max = limits.number("max_speed_mm_per_s", ANY_SPEED);
    let accel = limits.number("max_accel_mm_per_s2", 1e-3..=1e6);
    let (min, max) = (min?, max?);
    if min >= max {
        limits.report(
            "max_speed_mm_per_s",
            max.to_string(),
            format!("more than min_speed_mm_per_s = {min}"),
        );
        return None;
    }
    Some(Limits {
        min_speed: MmPerS::new(min).ok()?,
        max_speed: MmPerS::new(max).ok()?,
        max_accel: MmPerS2::new(accel?).ok()?,
    })
}
