//! Numbers in their form on the robot's link.

use crate::core::MmPerS;
use crate::link::frame::Decimals;

/// Twelve digits before the point; three such numbers still fit a line.
pub(super) const NUMBERS: Decimals = Decimals { max_magnitude: 999_999_999_999.0 };

/// The speed as the other side receives it: six decimals, at most twelve digits before the point.
pub fn on_wire(speed: MmPerS) -> MmPerS {
    MmPerS::new(NUMBERS.on_wire(speed.get())).unwrap_or(speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_written_as_a_plc_can_read_it() {
        let decimal = |value| NUMBERS.write(value);
        assert_eq!(decimal(112.5), "112.5");
        assert_eq!(decimal(150.0), "150");
        assert_eq!(decimal(1e-9), "0");
        assert_eq!(decimal(-1e-9), "0");
        assert_eq!(decimal(f64::MAX), "999999999999");
        assert_eq!(decimal(0.1 + 0.2), "0.3");
    }

    #[test]
    fn what_arrives_is_known_before_it_is_sent() {
        assert_eq!(on_wire(MmPerS::constant(149.999_999_9)), MmPerS::constant(150.0));
        assert_eq!(on_wire(MmPerS::constant(81.1)), MmPerS::constant(81.1));
    }
}
