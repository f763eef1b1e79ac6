//! `[control]` and `[limits]`: target, width controller, and limits of the setpoints.

use crate::core::{Mm, MmPerS, MmPerS2, Span, WidthRange};
use crate::document::Table;
use crate::vision::Gauge;
use crate::width_control::limiter::SpeedLimits;
use crate::width_control::pi::PiGains;
use crate::width_control::strategy::{STRATEGIES, WidthControlSettings};
use crate::width_control::target::{Knot, Layers, WidthTarget};

/// Accepted speeds \[mm/s\], as a bound on typing errors.
const SPEED_RANGE: std::ops::RangeInclusive<f64> = 0.0..=10_000.0;

/// Keys of the PI controller's gains, and their accepted values.
const GAIN_KEYS: [&str; 2] = ["kp_per_s", "ki_per_s2"];
const GAIN_RANGE: std::ops::RangeInclusive<f64> = 0.0..=1e4;

/// Reads `target_width_mm`, the only key of `[control]` that measuring needs.
pub fn read_target(control: &Table<'_>) -> Option<Mm> {
    control.number("target_width_mm", 0.1..=1000.0).and_then(|v| Mm::new(v).ok())
}

/// How well the width must be kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceSettings {
    /// Largest error of a width.
    pub tolerance: Mm,
    /// Largest fraction of the bead's length that may be out of tolerance before a command ends
    /// with status 3.
    pub max_out_fraction: f64,
}

/// Tolerance where the cell gives none, as a fraction of the target, by the contract of `[control]`.
const TOLERANCE_RATIO: f64 = 0.02;
/// Fraction of the length that may be out of it where the cell gives none, by the contract of
/// `[control]`.
const MAX_OUT_FRACTION: f64 = 0.05;

/// Reads `tolerance_mm` and `max_out_of_tolerance`.
pub fn read_tolerance(control: &Table<'_>, target: &WidthTarget) -> Option<ToleranceSettings> {
    let tolerance = control.optional_number("tolerance_mm", 1e-3..=100.0);
    let max_out = control.number_or("max_out_of_tolerance", 0.0..=1.0, MAX_OUT_FRACTION);
    let tolerance = tolerance.unwrap_or(TOLERANCE_RATIO * target.nominal().get());
    Some(ToleranceSettings { tolerance: Mm::new(tolerance).ok()?, max_out_fraction: max_out? })
}

/// Reads the rest of `[control]`. There are no defaults for gains, nor for the exponent.
pub fn read_control(
    control: &Table<'_>,
    target: Option<WidthTarget>,
) -> Option<WidthControlSettings> {
    let names = STRATEGIES.map(|strategy| (strategy.name, strategy));
    let strategy = control.required_choice("strategy", &names);
    let gains = read_gains(control);
    // Where PI control is only the fallback, or not used, the gains may be absent.
    let gains_optional = strategy.is_some_and(|strategy| !strategy.needs_gains)
        && !GAIN_KEYS.iter().any(|key| control.has(key));
    if !gains_optional {
        for key in GAIN_KEYS.iter().filter(|key| !control.has(key)) {
            control.report_absent(key, "a number; there are no defaults for gains");
        }
    }
    let strategy = if let Some(strategy) = strategy {
        (strategy.read)(control)
    } else {
        control.allow_unknown_keys();
        None
    };
    let max_gap = control.number("max_gap_s", 0.01..=60.0);
    let max_hold = control.number("max_hold_s", 0.1..=3600.0);
    Some(WidthControlSettings {
        target: target?,
        strategy: strategy?,
        gains: if gains_optional { None } else { Some(gains?) },
        max_gap: Span::from_secs(max_gap?),
        max_hold: Span::from_secs(max_hold?),
    })
}

/// Gains of the PI controller, where both stand in the file.
fn read_gains(control: &Table<'_>) -> Option<PiGains> {
    // The 2022 paper counts the error in pixels; its gains are of that unit.
    let unit = control.number_or("error_unit_mm", 1e-4..=1e3, 1.0)?;
    let [kp, ki] = GAIN_KEYS.map(|key| control.optional_number(key, GAIN_RANGE));
    Some(PiGains { kp_per_s: kp? / unit, ki_per_s2: ki? / unit })
}

/// Reports target widths outside the gauge's accepted range. `layers` is the table with the layers'
/// widths.
pub fn check_target(
    control: &Table<'_>,
    layers: Option<&Table<'_>>,
    target: &WidthTarget,
    gauge: &Gauge,
) {
    let WidthRange { min: low, max: high } = gauge.width_range;
    let outside = |width: &Mm| !gauge.width_range.contains(*width);
    let report = |table: &Table<'_>, key: &'static str, width: Mm| {
        let expected = format!("within width_range_mm of [gauge], {low} to {high}");
        table.report(key, format!("{}", width.get()), expected);
    };
    if outside(&target.nominal()) {
        report(control, "target_width_mm", target.nominal());
    }
    if let Some(width) = target.knots().iter().map(|knot| knot.width).find(outside) {
        report(control, "path_width_mm", width);
    }
    let widths = target.layers().map(|layers| layers.widths.as_slice()).unwrap_or_default();
    if let (Some(table), Some(width)) = (layers, widths.iter().copied().find(outside)) {
        report(table, "width_mm", width);
    }
}

/// Reads the target width, with its profile along the path and by layer.
pub fn read_target_profile(
    control: &Table<'_>,
    layers: Option<&Table<'_>>,
    width: Option<Mm>,
) -> Option<WidthTarget> {
    let along = read_path_profile(control);
    let layers = layers.map(read_layers);
    let mut target = WidthTarget::constant(width?).along(along?);
    if let Some(layers) = layers {
        target = target.by_layer(layers?);
    }
    Some(target)
}

/// `path_mm` and `path_width_mm`, which belong together.
fn read_path_profile(control: &Table<'_>) -> Option<Vec<Knot>> {
    if !control.has("path_mm") && !control.has("path_width_mm") {
        return Some(Vec::new());
    }
    let positions = control.list("path_mm", 0.0..=1e7);
    let widths = control.list("path_width_mm", 0.1..=1000.0);
    let (positions, widths) = (positions?, widths?);
    if positions.len() != widths.len() {
        let found = format!("{} numbers", widths.len());
        control.report(
            "path_width_mm",
            found,
            format!("{}, one for each path_mm", positions.len()),
        );
        return None;
    }
    let falls =
        positions.iter().zip(positions.iter().skip(1)).find(|(before, after)| after < before);
    if let Some((before, after)) = falls {
        let found = format!("{after} after {before}");
        control.report(
            "path_mm",
            found,
            "positions in the order of the path; the same one twice is a step",
        );
        return None;
    }
    let knot = |(path, width): (f64, f64)| {
        Some(Knot { path: Mm::new(path).ok()?, width: Mm::new(width).ok()? })
    };
    positions.into_iter().zip(widths).map(knot).collect()
}

/// `[layers]`.
fn read_layers(table: &Table<'_>) -> Option<Layers> {
    let height = table.number("height_mm", 0.01..=1e3);
    let first = table.number_or("first_z_mm", -1e5..=1e5, 0.0);
    let widths =
        if table.has("width_mm") { table.list("width_mm", 0.1..=1000.0) } else { Some(Vec::new()) };
    let widths: Option<Vec<Mm>> = widths?.into_iter().map(|width| Mm::new(width).ok()).collect();
    Some(Layers { first_z: Mm::new(first?).ok()?, height: Mm::new(height?).ok()?, widths: widths? })
}

/// `[limits]`. There are no defaults for safety.
pub fn read_limits(limits: &Table<'_>) -> Option<SpeedLimits> {
    let min = limits.number("min_speed_mm_per_s", SPEED_RANGE);
    let max = limits.number("max_speed_mm_per_s", SPEED_RANGE);
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
    Some(SpeedLimits {
        min_speed: MmPerS::new(min).ok()?,
        max_speed: MmPerS::new(max).ok()?,
        max_accel: MmPerS2::new(accel?).ok()?,
    })
}
