//! Conversions between kinds of numbers whose loss is harmless: indices and counts are small,
//! and seven digits are enough for a pixel.

/// A count or an index as a floating-point number.
#[inline]
pub fn to_f64(number: impl Count) -> f64 {
    number.to_f64()
}

/// An integer that counts something; exact as a number up to 2⁵³.
pub trait Count {
    /// The integer as a floating-point number.
    fn to_f64(self) -> f64;
}

impl Count for usize {
    #[expect(clippy::cast_precision_loss, reason = "counts and places are small")]
    #[inline]
    fn to_f64(self) -> f64 {
        self as f64
    }
}

impl Count for u64 {
    #[expect(clippy::cast_precision_loss, reason = "counts are small")]
    #[inline]
    fn to_f64(self) -> f64 {
        self as f64
    }
}

/// A count or an index in single precision.
#[expect(clippy::cast_precision_loss, reason = "counts and places are small")]
pub fn to_f32(number: usize) -> f32 {
    number as f32
}

/// A number, rounded to single precision.
#[expect(clippy::cast_possible_truncation, reason = "the quantity needs no more")]
pub fn narrow_to_f32(value: f64) -> f32 {
    value as f32
}

/// The largest integer not above a number.
#[expect(clippy::cast_possible_truncation, reason = "positions are some thousand pixels")]
#[inline(always)]
pub fn floor_to_index(position: f64) -> isize {
    position.floor() as isize
}

/// The whole part of a number; 0 for a negative number and for NaN, saturating at the largest.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
#[inline]
pub fn to_count(number: f64) -> usize {
    number as usize
}

/// The nearest integer; 0 for a negative number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "lengths are a few pixels and not negative"
)]
#[inline(always)]
pub fn round_to_count(length: f32) -> usize {
    // Faster than rounding: the cast truncates.
    (length + 0.5).max(0.0) as usize
}
