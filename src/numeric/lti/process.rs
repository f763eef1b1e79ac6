//! Process models of first and second order.

use super::polynomial::multiply;
use super::transfer::{ModelError, TransferFunction};

/// First order with dead time: K·(Tz·s + 1)/(T·s + 1)·e^(−Ls).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstOrder {
    /// K: static gain.
    pub gain: f64,
    /// T \[s\].
    pub time_constant_s: f64,
    /// Tz \[s\]; 0 for no zero, negative for a zero in the right half plane.
    pub zero_s: f64,
    /// L \[s\].
    pub dead_time_s: f64,
}

/// Second order with dead time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SecondOrder {
    /// K·(Tz·s + 1)/((T1·s + 1)(T2·s + 1))·e^(−Ls).
    Real {
        /// K: static gain.
        gain: f64,
        /// T1 and T2 \[s\].
        time_constants_s: [f64; 2],
        /// Tz \[s\]; 0 for no zero.
        zero_s: f64,
        /// L \[s\].
        dead_time_s: f64,
    },
    /// K·(Tz·s + 1)/(T²·s² + 2ζT·s + 1)·e^(−Ls).
    Oscillating {
        /// K: static gain.
        gain: f64,
        /// T: one over the natural frequency \[s\].
        period_s: f64,
        /// ζ: below 1 it overshoots.
        damping: f64,
        /// Tz \[s\]; 0 for no zero.
        zero_s: f64,
        /// L \[s\].
        dead_time_s: f64,
    },
}

impl FirstOrder {
    /// As a transfer function. Fails where the time constant is not above zero or a number is
    /// not finite.
    pub fn transfer(&self) -> Result<TransferFunction, ModelError> {
        let t = positive("a time constant", self.time_constant_s)?;
        TransferFunction::new(&zero(self.gain, self.zero_s), &[t, 1.0], self.dead_time_s)
    }
}

impl SecondOrder {
    /// As a transfer function. Fails where a time constant or the damping is
    /// not above zero or a number is not finite.
    pub fn transfer(&self) -> Result<TransferFunction, ModelError> {
        match *self {
            Self::Real { gain, time_constants_s: [t1, t2], zero_s, dead_time_s } => {
                let first = [positive("a time constant", t1)?, 1.0];
                let second = [positive("a time constant", t2)?, 1.0];
                let den = multiply(&first, &second);
                TransferFunction::new(&zero(gain, zero_s), &den, dead_time_s)
            }
            Self::Oscillating { gain, period_s, damping, zero_s, dead_time_s } => {
                let t = positive("one over the natural frequency", period_s)?;
                let middle = 2.0 * positive("the damping", damping)? * t;
                TransferFunction::new(&zero(gain, zero_s), &[t * t, middle, 1.0], dead_time_s)
            }
        }
    }
}

fn zero(gain: f64, zero_s: f64) -> [f64; 2] {
    [gain * zero_s, gain]
}

fn positive(what: &'static str, value: f64) -> Result<f64, ModelError> {
    if !value.is_finite() {
        return Err(ModelError::NotFinite { what, value });
    }
    if value > 0.0 { Ok(value) } else { Err(ModelError::NotPositive { what, value }) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn a_second_order_has_the_poles_of_its_damping() {
        let model = SecondOrder::Oscillating {
            gain: 2.0,
            period_s: 0.5,
            damping: 0.6,
            zero_s: 0.0,
            dead_time_s: 0.1,
        };
        let tf = model.transfer().unwrap();
        for pole in tf.poles() {
            assert!((pole.re + 1.2).abs() < 1e-12 && (pole.im.abs() - 1.6).abs() < 1e-12);
        }
        assert_eq!((tf.num(), tf.dc_gain(), tf.dead_time_s()), (&[2.0][..], 2.0, 0.1));
    }

    #[test]
    fn real_poles_and_the_zero_stand_where_they_were_put() {
        let model = SecondOrder::Real {
            gain: 3.0,
            time_constants_s: [0.25, 2.0],
            zero_s: 0.5,
            dead_time_s: 0.0,
        };
        let tf = model.transfer().unwrap();
        let mut poles: Vec<f64> = tf.poles().iter().map(|pole| pole.re).collect();
        poles.sort_by(f64::total_cmp);
        assert!((poles[0] + 4.0).abs() < 1e-12 && (poles[1] + 0.5).abs() < 1e-12);
        assert!((tf.zeros()[0].re + 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_time_constant_of_zero_is_refused() {
        let model = FirstOrder { gain: 1.0, time_constant_s: 0.0, zero_s: 0.0, dead_time_s: 0.4 };
        let words = model.transfer().unwrap_err().to_string();
        assert_eq!(words, "a time constant is 0; it must be above zero");
    }
}
