//! The robots that a cell may choose by `driver` in `[robot]`.
//!
//! To add one: a file in this folder with its settings and its port, and a line in [`ROBOTS`].

mod driver;
pub mod line;
pub mod log;

pub use driver::{Capabilities, RobotDriver, RobotRegistration, RobotStart};

/// Every robot driver that a cell may choose.
pub const ROBOTS: [&RobotRegistration; 2] = [&line::REGISTRATION, &log::REGISTRATION];
