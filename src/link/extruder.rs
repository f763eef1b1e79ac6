//! The extruder link, version 1: what travels between truebead and an extruder
//! controller, without a socket and without a clock. Framing, counting and
//! validity are those of the robot link; `robot/EXTRUDER.md` tells the rest to
//! the person who programs an extruder controller.
//!
//! ```text
//! bytes → LineSplitter → text → DriveLine / ExtruderLine → Gate (the extruder's side)
//!                                                        → io::extruder (the PC's side)
//! ```

mod drive_line;
mod extruder_line;
mod gate;

pub use drive_line::DriveLine;
pub use extruder_line::{ExtruderHello, ExtruderLine, ExtruderStatus, pump_word};
pub use gate::{Faults, Gate};

use super::fields;

/// Largest magnitude that is written: four such numbers still fit a line.
const LARGEST: f64 = 99_999_999.0;

/// The command as it arrives at the other side: six decimals, at most eight
/// digits before the point.
pub fn on_wire(value: f64) -> f64 {
    decimal(value).parse().unwrap_or(value)
}

fn decimal(value: f64) -> String {
    fields::decimal_within(value, LARGEST)
}

/// A switch as it stands on a line.
const fn switch(on: bool) -> u8 {
    on as u8
}
