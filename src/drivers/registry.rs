//! The drivers that a cell file chooses, and their own keys in its tables.

use std::path::Path;
use std::sync::Arc;

use super::extruder::{self, EXTRUDERS, ExtruderDriver};
use super::robot::{self, ROBOTS, RobotDriver};
use crate::cell::drivers::DriverTables;
use crate::document::Table;

/// The devices of a cell, with their drivers' settings; `None` if the cell has no such device.
#[derive(Debug, Clone, Default)]
pub struct Devices {
    /// The robot.
    pub robot: Option<Device<dyn RobotDriver, robot::RobotRegistration>>,
    /// The extruder.
    pub extruder: Option<Device<dyn ExtruderDriver, extruder::ExtruderRegistration>>,
}

/// A device: its driver with settings, and the driver's registration.
#[derive(Debug)]
pub struct Device<D: ?Sized, R: 'static> {
    /// The driver with its settings.
    pub driver: Arc<D>,
    /// The driver's registration.
    pub registration: &'static R,
}

impl<D: ?Sized, R> Clone for Device<D, R> {
    fn clone(&self) -> Self {
        Self { driver: Arc::clone(&self.driver), registration: self.registration }
    }
}

impl DriverTables for Devices {
    fn read_robot(&mut self, table: &Table<'_>, folder: &Path) {
        let names = ROBOTS.map(|robot| (robot.name, robot));
        let Some(registration) = table.required_choice("driver", &names) else {
            table.allow_unknown_keys();
            return;
        };
        let driver = (registration.read)(table, folder);
        self.robot = driver.map(|driver| Device { driver, registration });
    }

    fn read_extruder(&mut self, table: &Table<'_>, folder: &Path) {
        if !["driver", "address", "valid_ms"].iter().any(|key| table.has(key)) {
            return;
        }
        let names = EXTRUDERS.map(|extruder| (extruder.name, extruder));
        let Some(registration) = table.required_choice("driver", &names) else {
            table.allow_unknown_keys();
            return;
        };
        let driver = (registration.read)(table, folder);
        if let (Some(driver), Some(robot)) = (&driver, &self.robot)
            && driver.address() == robot.driver.address()
        {
            let expected = "another than robot.address: each has a controller of its own";
            table.report("address", format!("\"{}\"", driver.address()), expected);
        }
        self.extruder = driver.map(|driver| Device { driver, registration });
    }
}
