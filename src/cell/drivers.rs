//! The keys of `[robot]` and `[extruder]` that belong to a driver, which the cell does not
//! know.

use std::path::Path;

use crate::document::Table;

/// Reads the keys that belong to drivers. Relative paths start from the folder.
pub trait DriverTables {
    /// Reads `driver` of `[robot]` and that driver's own keys.
    fn read_robot(&mut self, table: &Table<'_>, folder: &Path);

    /// Reads `driver` of `[extruder]` and that driver's own keys.
    fn read_extruder(&mut self, table: &Table<'_>, folder: &Path);
}

/// Leaves the keys of drivers unread, for a cell that reaches no device.
#[derive(Debug, Clone, Copy)]
pub struct NoDrivers;

impl DriverTables for NoDrivers {
    fn read_robot(&mut self, table: &Table<'_>, _: &Path) {
        table.allow_unknown_keys();
    }

    fn read_extruder(&mut self, table: &Table<'_>, _: &Path) {
        table.allow_unknown_keys();
    }
}
