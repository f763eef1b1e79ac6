//! The address of a device on a line link.

use crate::document::Table;

/// Reads `address`, `host:port`; `None` if it is missing or has no port.
pub fn read_address(table: &Table<'_>) -> Option<String> {
    let address = table.text("address")?;
    if !address.contains(':') {
        table.report("address", format!("\"{address}\""), "host:port");
        return None;
    }
    Some(address.to_owned())
}
