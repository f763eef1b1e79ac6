//! What the reading of a strategy depends on: folder, command quantity, limits and rates.

use std::path::Path;

use crate::document::Table;
use crate::extruder::{CommandLimits, CommandQuantity};

/// Rates of the extruder side \[Hz\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtruderRates {
    /// Steps of the feedforward.
    pub feedforward_hz: f64,
    /// Steps of the control.
    pub control_hz: f64,
    /// Commands and reports.
    pub io_hz: f64,
}

/// What the reading of a strategy depends on.
pub(super) struct ReadContext<'a> {
    pub(super) folder: &'a Path,
    pub(super) drive: CommandQuantity,
    pub(super) limits: Option<CommandLimits>,
    pub(super) rates: ExtruderRates,
}

/// Reads the rates. None may be higher than that of the feedforward.
pub(super) fn read_rates(table: &Table<'_>) -> Option<ExtruderRates> {
    let hz = 0.5..=5000.0;
    let feedforward = table.number_or("feedforward_rate_hz", hz.clone(), 200.0);
    let control = table.number_or("control_rate_hz", hz.clone(), 20.0);
    let io = table.number_or("io_rate_hz", hz, 50.0);
    let rates = ExtruderRates { feedforward_hz: feedforward?, control_hz: control?, io_hz: io? };
    for (key, rate) in [("control_rate_hz", rates.control_hz), ("io_rate_hz", rates.io_hz)] {
        if rate > rates.feedforward_hz {
            let max = format!("at most feedforward_rate_hz = {}", rates.feedforward_hz);
            table.report(key, rate.to_string(), max);
        }
    }
    Some(rates)
}
