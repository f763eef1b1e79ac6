//! A dead zone around the feedforward: a fraction of a correction within the noise is applied,
//! all of one well beyond it, continuous in between. After the dead zone and the return to the
//! feedforward of Ma et al. 2026, but on the correction itself, which avoids limit cycles at its
//! edge.

/// The zones of corrections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadZone {
    /// Fraction of a correction that is applied within the dead zone, 0 to 1.
    pub inner_gain: f64,
    /// Size of correction up to which that fraction is applied \[MPa\].
    pub inner: f64,
    /// Size from which all of it is applied \[MPa\].
    pub outer: f64,
}

impl DeadZone {
    /// The applied correction \[MPa\]: odd, continuous, monotonic.
    pub fn applied(&self, correction: f64) -> f64 {
        let size = correction.abs();
        let made = if size <= self.inner {
            self.inner_gain * size
        } else if size < self.outer {
            let at_rim = self.inner_gain * self.inner;
            at_rim + (self.outer - at_rim) * (size - self.inner) / (self.outer - self.inner)
        } else {
            size
        };
        made.copysign(correction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ZONE: DeadZone = DeadZone { inner_gain: 0.3, inner: 0.03, outer: 0.07 };

    #[test]
    fn a_fraction_within_and_all_beyond() {
        assert!((ZONE.applied(0.02) - 0.006).abs() < 1e-15);
        assert_eq!(ZONE.applied(-0.07), -0.07);
        assert_eq!(ZONE.applied(5.0), 5.0);
    }

    proptest! {
        #[test]
        fn it_is_continuous_and_monotonic(at in -0.2..0.2_f64, more in 0.0..1e-3_f64) {
            let (low, high) = (ZONE.applied(at), ZONE.applied(at + more));
            prop_assert!(high >= low);
            prop_assert!(high - low <= 2.0 * more);
        }
    }
}
