//! Numbers as numbers of another kind, where nothing that counts is lost: places
//! and counts are small, and a quantity of seven digits is enough for a pixel.

/// A count or a whole place as a number.
#[expect(clippy::cast_precision_loss, reason = "counts and places are small")]
pub fn to_f64(number: usize) -> f64 {
    number as f64
}

/// The same in single precision.
#[expect(clippy::cast_precision_loss, reason = "counts and places are small")]
pub fn to_f32(number: usize) -> f32 {
    number as f32
}

/// A quantity in single precision.
#[expect(clippy::cast_possible_truncation, reason = "the quantity needs no more")]
pub fn narrow_to_f32(value: f64) -> f32 {
    value as f32
}

/// The last whole place that is not beyond a position.
#[expect(clippy::cast_possible_truncation, reason = "positions are some thousand pixels")]
#[inline(always)]
pub fn floor_to_index(position: f64) -> isize {
    position.floor() as isize
}

/// The whole number at or below a value; 0 below zero, the largest one beyond it.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
pub fn floor_to_count(value: f64) -> usize {
    value as usize
}

/// The nearest number of rows or pixels; 0 of less than none.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "lengths are a few pixels and not negative"
)]
#[inline(always)]
pub fn round_to_count(length: f32) -> usize {
    // Faster than to round: what is cut off is the fraction.
    (length + 0.5).max(0.0) as usize
}
