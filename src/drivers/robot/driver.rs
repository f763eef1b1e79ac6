//! The interface of a robot driver: its registration, its capabilities, and its start.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crossbeam_channel::Sender;

use crate::core::MmPerS;
use crate::document::Table;
use crate::drivers::StartError;
use crate::io::clock::RunClock;
use crate::run::ports::{RobotEvent, RobotPort};

/// A robot driver as a cell chooses it.
#[derive(Debug)]
pub struct RobotRegistration {
    /// Its name in `driver` of `[robot]`.
    pub name: &'static str,
    /// Capabilities of its robots.
    pub capabilities: Capabilities,
    /// Reads its own keys of `[robot]`; `None` if they are wrong. Relative paths start from the
    /// folder.
    pub read: fn(&Table<'_>, &Path) -> Option<Arc<dyn RobotDriver>>,
}

/// Capabilities of a driver's robots.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
pub struct Capabilities {
    /// They report the slowest and the fastest setpoint that they accept.
    pub reports_limits: bool,
    /// A setpoint expires at the robot, so that the robot stops by itself when it loses the PC.
    pub setpoints_expire: bool,
    /// They report the distance along the path.
    pub reports_path: bool,
    /// They report the nozzle's position in space, beyond its height.
    pub reports_position: bool,
    /// They report the direction in which the nozzle moves.
    pub reports_heading: bool,
    /// They report their actual speed.
    pub reads_speed_back: bool,
    /// Resolution of setpoints; 0 for any value.
    pub resolution: MmPerS,
}

impl fmt::Display for Capabilities {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let facts = [
            (self.reports_limits, "own limits"),
            (self.setpoints_expire, "setpoints expire"),
            (self.reports_path, "path"),
            (self.reports_position, "position"),
            (self.reports_heading, "heading"),
            (self.reads_speed_back, "speed read back"),
        ];
        let has: Vec<&str> = facts.iter().filter(|fact| fact.0).map(|fact| fact.1).collect();
        f.write_str(&has.join(", "))?;
        if self.resolution > MmPerS::ZERO {
            write!(f, ", steps of {}", self.resolution)?;
        }
        Ok(())
    }
}

/// A robot with its driver's settings.
pub trait RobotDriver: fmt::Debug + Send + Sync {
    /// Address of the robot in messages and reports, such as `host:port`.
    fn address(&self) -> String;

    /// Starts to connect. From then on the robot's reports arrive on `start.events`.
    fn start(&self, start: RobotStart) -> Result<Box<dyn RobotPort>, StartError>;
}

/// What a robot driver is given at its start.
#[derive(Debug)]
pub struct RobotStart {
    /// The clock of the run.
    pub clock: RunClock,
    /// Slowest setpoint of the cell.
    pub min: MmPerS,
    /// Fastest setpoint of the cell.
    pub max: MmPerS,
    /// Speed at the start of a bead.
    pub start_speed: MmPerS,
    /// Time for which a setpoint is valid after the report that it refers to \[ms\].
    pub valid_ms: u64,
    /// Receives the robot's reports. Unbounded: a driver never waits for it.
    pub events: Sender<RobotEvent>,
}
