//! The robots that a cell may choose by `driver` in `[robot]`.
//!
//! To add one: a file in this folder with its settings and its port, and a line in [`ROBOTS`].

mod driver;
pub mod line;
pub mod log;

pub use driver::{Capabilities, Registration, RobotDriver, RobotStart};

/// Every robot driver that a cell may choose.
pub const ROBOTS: [&Registration; 2] = [&line::REGISTRATION, &log::REGISTRATION];
