//! The extruders that a cell may choose by `driver` in `[extruder]`.
//!
//! To add one: a file in this folder with its settings and its port, and a line in
//! [`EXTRUDERS`].

mod driver;
pub mod line;

pub use driver::{DriveRange, ExtruderDriver, ExtruderRegistration, ExtruderStart};

/// Every extruder driver that a cell may choose.
pub const EXTRUDERS: [&ExtruderRegistration; 1] = [&line::REGISTRATION];
