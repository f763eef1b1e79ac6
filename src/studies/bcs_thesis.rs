//! The experiments of the bead characterisation thesis: an extruder driven by a voltage lays
//! a bead on a wheel. The plant is that of its chapter 3.

pub mod bounds;
pub mod corner;
pub mod fit_table;
pub mod on_off;
pub mod start_stop;
pub mod table;

use crate::numeric::lti::{ModelError, TransferFunction};

/// G1, drive voltage \[V\] to screw speed \[rpm\]:
/// (439s + 35.08)/(1.523s² + 11.44s + 1)·e^(−0.054s). Section 3.3.1; 35.08 is the DC gain.
pub fn drive() -> Result<TransferFunction, ModelError> {
    TransferFunction::new(&[439.0, 35.08], &[1.523, 11.44, 1.0], 0.054)
}

/// Poles of G2 at −0.738 ± 0.993i 1/s: real and imaginary part. Bead characterisation thesis,
/// § 3.3.2.
pub const FLOW_POLES_PER_S: [f64; 2] = [0.738, 0.993];
/// Zeros of G2 at −3.84 ± 6.88i 1/s. Bead characterisation thesis, § 3.3.2, prints their
/// reciprocals (−0.0619 ± 0.1108i), which would give a high-frequency gain of 95; these values
/// reproduce its table 3 (papers.md).
pub const FLOW_ZEROS_PER_S: [f64; 2] = [3.84, 6.88];
/// DC gain of G2 \[mm³/s per rpm\], which the thesis does not give: papers.md, "19.05 used".
pub const FLOW_GAIN: f64 = 19.05;

/// G2, screw speed \[rpm\] to flow at the nozzle \[mm³/s\].
pub fn flow() -> Result<TransferFunction, ModelError> {
    let pair = |[re, im]: [f64; 2]| [1.0, 2.0 * re, re * re + im * im];
    let (num, den) = (pair(FLOW_ZEROS_PER_S), pair(FLOW_POLES_PER_S));
    let gain = FLOW_GAIN * den[2] / num[2];
    TransferFunction::new(&num.map(|c| gain * c), &den, 0.0)
}

/// The flow model at constant wheel speed, eq. (22):
/// (9.175s² + 149.2s + 905.3)/(s² + 12.84s + 47.52).
pub fn flow_at_constant_speed() -> Result<TransferFunction, ModelError> {
    TransferFunction::new(&[9.175, 149.2, 905.3], &[1.0, 12.84, 47.52], 0.0)
}

/// G3, command to wheel speed: 2.517/(0.0377s + 1)·e^(−0.009s). Section 3.3.3.
pub fn wheel() -> Result<TransferFunction, ModelError> {
    TransferFunction::new(&[2.517], &[0.0377, 1.0], 0.009)
}

/// GC, the wheel's inverse with a lag: (0.0377s + 1)/(2.517(0.01s + 1)). Section 4.1.
pub fn wheel_inverse() -> Result<TransferFunction, ModelError> {
    wheel()?.inverse_through(&TransferFunction::new(&[1.0], &[0.01, 1.0], 0.0)?)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn the_flow_has_the_published_poles_and_the_reciprocal_of_the_printed_zeros() {
        let flow = flow().unwrap();
        assert!((flow.dc_gain() - 19.05).abs() < 1e-12);
        assert!(flow.poles().iter().all(|p| (p.re + 0.738).abs() < 1e-9));
        for zero in flow.zeros() {
            let printed = 1.0 / zero;
            assert!((printed.re + 0.0619).abs() < 1e-4 && (printed.im.abs() - 0.1108).abs() < 1e-4);
        }
    }

    #[test]
    fn the_inverse_of_the_wheel_is_the_published_compensator() {
        let inverse = wheel_inverse().unwrap();
        assert_eq!(inverse.num(), [0.0377, 1.0]);
        assert!((inverse.den()[0] - 0.025_17).abs() < 1e-15);
        assert_eq!(inverse.dead_time_s(), 0.0);
    }
}
