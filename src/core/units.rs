//! Physical quantities as types. Every value is finite by construction, and
//! only the operators that mean something exist.

use std::fmt;
use std::ops::{Add, Div, Mul, Neg, Sub};

use serde::{Deserialize, Serialize};

use super::time::Span;

/// A number that was not finite where a physical quantity was expected.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{value} is not a finite number of {unit}")]
pub struct NotFinite {
    /// What was found.
    pub value: f64,
    /// Unit of the quantity that was expected.
    pub unit: &'static str,
}

/// Overflow saturates. The operands of every operator are finite, so NaN can only come from a
/// factor that is not finite; it becomes zero.
fn saturate(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(f64::MIN, f64::MAX) }
}

macro_rules! unit {
    ($(#[$doc:meta])* $name:ident, $symbol:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default, Serialize, Deserialize)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name(f64);

        impl $name {
            /// Zero.
            pub const ZERO: Self = Self(0.0);
            /// Symbol of the unit.
            pub const SYMBOL: &'static str = $symbol;

            /// Takes a finite number; fails on NaN and infinities.
            pub fn new(value: f64) -> Result<Self, NotFinite> {
                if value.is_finite() {
                    Ok(Self(value))
                } else {
                    Err(NotFinite { value, unit: $symbol })
                }
            }

            /// A constant; fails to compile unless it is finite.
            pub const fn constant(value: f64) -> Self {
                assert!(value.is_finite(), "a constant must be finite");
                Self(value)
            }

            /// The bare number, in the unit of the type.
            pub const fn get(self) -> f64 {
                self.0
            }

            /// Magnitude.
            pub fn abs(self) -> Self {
                Self(self.0.abs())
            }

            /// The smaller of two.
            pub fn min(self, other: Self) -> Self {
                Self(self.0.min(other.0))
            }

            /// The larger of two.
            pub fn max(self, other: Self) -> Self {
                Self(self.0.max(other.0))
            }
        }

        impl TryFrom<f64> for $name {
            type Error = NotFinite;
            fn try_from(value: f64) -> Result<Self, NotFinite> {
                Self::new(value)
            }
        }

        impl From<$name> for f64 {
            fn from(value: $name) -> f64 {
                value.0
            }
        }

        impl Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(saturate(self.0 + other.0))
            }
        }

        impl Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(saturate(self.0 - other.0))
            }
        }

        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }

        impl Mul<f64> for $name {
            type Output = Self;
            fn mul(self, factor: f64) -> Self {
                Self(saturate(self.0 * factor))
            }
        }

        impl Div for $name {
            type Output = f64;
            fn div(self, other: Self) -> f64 {
                self.0 / other.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(&self.0, f)?;
                f.write_str(concat!(" ", $symbol))
            }
        }
    };
}

unit!(
    /// Length on the bead, the bed or along the path \[mm\].
    Mm, "mm"
);
unit!(
    /// Length in the image \[px\].
    Px, "px"
);
unit!(
    /// Speed along the path \[mm/s\].
    MmPerS, "mm/s"
);
unit!(
    /// Acceleration along the path \[mm/s²\].
    MmPerS2, "mm/s²"
);
unit!(
    /// Area of a bead's section \[mm²\].
    Mm2, "mm²"
);
unit!(
    /// Volume of material a second \[mm³/s\].
    Mm3PerS, "mm³/s"
);
unit!(
    /// Pressure at the nozzle, in megapascal.
    MPa, "MPa"
);
unit!(
    /// Speed of a screw or of a wheel, in turns a minute \[rpm\].
    Rpm, "rpm"
);

impl Mul<Span> for MmPerS {
    type Output = Mm;
    fn mul(self, span: Span) -> Mm {
        Mm(saturate(self.0 * span.secs()))
    }
}

impl Mul<Mm2> for MmPerS {
    type Output = Mm3PerS;
    fn mul(self, section: Mm2) -> Mm3PerS {
        Mm3PerS(saturate(self.0 * section.0))
    }
}

impl Mul<Span> for MmPerS2 {
    type Output = MmPerS;
    fn mul(self, span: Span) -> MmPerS {
        MmPerS(saturate(self.0 * span.secs()))
    }
}

/// Narrowest and widest width of a bead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthRange {
    /// The narrowest.
    pub min: Mm,
    /// The widest.
    pub max: Mm,
}

impl WidthRange {
    /// Whether a width lies within it, its ends included.
    pub fn contains(&self, width: Mm) -> bool {
        width >= self.min && width <= self.max
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_refused_at_the_boundary() {
        assert!(Mm::new(f64::NAN).is_err());
        assert!(MmPerS::new(f64::INFINITY).is_err());
        assert!(serde_json::from_str::<Mm>("1e999").is_err());
        let message = Mm::new(f64::NAN).unwrap_err().to_string();
        assert_eq!(message, "NaN is not a finite number of mm");
    }

    #[test]
    fn operators_never_leave_the_finite_numbers() {
        let huge = Mm::constant(f64::MAX);
        assert_eq!((huge + huge).get(), f64::MAX);
        assert_eq!((huge * f64::NAN).get(), 0.0);
        assert_eq!((huge * -2.0).get(), f64::MIN);
    }

    #[test]
    fn a_section_at_a_speed_is_a_flow() {
        let flow = MmPerS::constant(30.0) * Mm2::constant(4.0);
        assert_eq!(flow.get(), 120.0);
    }

    #[test]
    fn a_speed_over_a_span_is_a_length() {
        let path = MmPerS::constant(112.5) * Span::from_secs(0.2);
        assert!((path.get() - 22.5).abs() < 1e-12);
    }
}
