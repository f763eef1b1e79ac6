//! The keys of an extruder's command and of its limits, which carry its unit.

use crate::document::Table;
use crate::extruder::{CommandLimits, CommandQuantity};

/// Accepted commands in any unit, as a bound on typing errors.
pub(super) const ANY_COMMAND: std::ops::RangeInclusive<f64> = -1e9..=1e9;

/// The keys of a command's limits, which carry its unit.
pub(super) struct CommandKeys {
    pub(super) value: &'static str,
    pub(super) min: &'static str,
    pub(super) max: &'static str,
    pub(super) rate: &'static str,
}

/// The keys of a command of this quantity.
pub(super) const fn command_keys(drive: CommandQuantity) -> CommandKeys {
    macro_rules! keys {
        ($unit:literal) => {
            CommandKeys {
                value: concat!("constant_", $unit),
                min: concat!("min_", $unit),
                max: concat!("max_", $unit),
                rate: concat!("max_", $unit, "_per_s"),
            }
        };
    }
    match drive {
        CommandQuantity::Rpm => keys!("rpm"),
        CommandQuantity::Volts => keys!("v"),
        CommandQuantity::Pressure => keys!("mpa"),
        CommandQuantity::Flow => keys!("mm3_per_s"),
        CommandQuantity::MassFlow => keys!("kg_per_s"),
        CommandQuantity::Filling => keys!("filling"),
    }
}

/// The limits of a command. There are no defaults.
pub(super) fn read_limits(table: &Table<'_>, drive: CommandQuantity) -> Option<CommandLimits> {
    let keys = command_keys(drive);
    let min = table.number(keys.min, ANY_COMMAND);
    let max = table.number(keys.max, ANY_COMMAND);
    let rate = table.number(keys.rate, 1e-9..=1e12);
    let (min, max) = (min?, max?);
    if min >= max {
        table.report(keys.max, max.to_string(), format!("more than {} = {min}", keys.min));
        return None;
    }
    CommandLimits::new(min, max, rate?).ok()
}
