//! The extruder link, version 1: messages between truebead and an extruder controller, without a
//! socket and without a clock. Framing, sequence numbers and validity are those of the robot link;
//! `docs/src/reference/extruder-link.md` describes the rest for the programmer of a controller.
//!
//! ```text
//! bytes → LineSplitter → text → DriveLine / ExtruderLine → ExtruderEndpoint (the extruder's side)
//!                                                        → drivers::extruder (the PC's side)
//! ```

mod drive_line;
pub mod endpoint;
mod extruder_line;
mod numbers;

pub use drive_line::DriveLine;
pub use endpoint::{ExtruderEndpoint, ExtruderFaults};
pub use extruder_line::{ExtruderLine, ExtruderStatus, pump_word};
pub use numbers::on_wire;
