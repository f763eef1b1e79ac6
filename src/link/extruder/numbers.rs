//! Numbers and switches in their form on the extruder's link.

use crate::link::frame::Decimals;

/// Eight digits before the point; four such numbers still fit a line.
pub(super) const NUMBERS: Decimals = Decimals { max_magnitude: 99_999_999.0 };

/// The command as the other side receives it: six decimals, at most eight digits before the point.
pub fn on_wire(value: f64) -> f64 {
    NUMBERS.on_wire(value)
}

/// A switch in its form on a line.
pub(super) const fn switch(on: bool) -> u8 {
    on as u8
}
