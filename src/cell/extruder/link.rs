//! `driver` of `[extruder]` and what belongs to it: how a live run reaches the
//! extruder. A simulated cell needs none of it.

use crate::document::Table;

/// How long a command holds at the extruder unless the file says so \[ms\].
const VALID_MS: u64 = 300;

/// How a live run reaches an extruder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExtruderLink {
    /// Host and port of the extruder controller.
    pub address: String,
    /// How long a command holds at the extruder \[ms\].
    pub valid_ms: u64,
}

/// Reads the link of an extruder that is told and reports `io_hz` times a
/// second; none where the file has no driver.
pub(super) fn read(table: &Table<'_>, io_hz: Option<f64>) -> Option<ExtruderLink> {
    if !["driver", "address", "valid_ms"].iter().any(|key| table.has(key)) {
        return None;
    }
    let driver = table.required_choice("driver", &[("line", ())]);
    let address = table.text("address");
    let valid_ms = table.integer_or("valid_ms", 100..=1000, VALID_MS);
    if let Some(address) = address
        && !address.contains(':')
    {
        table.report("address", format!("\"{address}\""), "host:port");
    }
    if let (Some(io_hz), Some(valid_ms)) = (io_hz, valid_ms)
        && u32::try_from(valid_ms).is_ok_and(|ms| f64::from(ms) < 1.5e3 / io_hz)
    {
        let expected =
            format!("at least {:.0}, one and a half periods of io_rate_hz", 1.5e3 / io_hz);
        table.report("valid_ms", valid_ms.to_string(), expected);
    }
    driver?;
    Some(ExtruderLink { address: address?.to_owned(), valid_ms: valid_ms? })
}
