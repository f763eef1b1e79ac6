//! The keys of an extruder's command and of its limits, which carry its unit.

use crate::document::Table;
use crate::extruder::{CommandLimits, Drive};

/// Any number that a command of an extruder can be, as a bound on slips.
pub(super) const ANY: std::ops::RangeInclusive<f64> = -1e9..=1e9;

/// The keys of a command's limits, which carry its unit.
pub(super) struct Keys {
    pub(super) value: &'static str,
    pub(super) min: &'static str,
    pub(super) max: &'static str,
    pub(super) rate: &'static str,
}

/// The keys of a command of this quantity.
pub(super) const fn keys(drive: Drive) -> Keys {
    macro_rules! keys {
        ($unit:literal) => {
            Keys {
                value: concat!("constant_", $unit),
                min: concat!("min_", $unit),
                max: concat!("max_", $unit),
                rate: concat!("max_", $unit, "_per_s"),
            }
        };
    }
    match drive {
        Drive::Rpm => keys!("rpm"),
        Drive::Volts => keys!("v"),
        Drive::Pressure => keys!("mpa"),
        Drive::Flow => keys!("mm3_per_s"),
        Drive::MassFlow => keys!("kg_per_s"),
        Drive::Filling => keys!("filling"),
    }
}

/// The limits of a command. There are no defaults.
pub(super) fn read_limits(table: &Table<'_>, drive: Drive) -> Option<CommandLimits> {
    let keys = keys(drive);
    let min = table.number(keys.min, ANY);
    let max = table.number(keys.max, ANY);
    let rate = table.number(keys.rate, 1e-9..=1e12);
    let (min, max) = (min?, max?);
    if min >= max {
        table.report(keys.max, max.to_string(), format!("more than {} = {min}", keys.min));
        return None;
    }
    CommandLimits::new(min, max, rate?).ok()
}
