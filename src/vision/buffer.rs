//! Buffers that are filled anew for each frame.

/// Replaces what a buffer holds.
#[inline(always)]
pub fn refill<T>(buffer: &mut Vec<T>, values: impl IntoIterator<Item = T>) {
    buffer.clear();
    buffer.extend(values);
}

/// Replaces what a buffer holds by a value, so many times.
#[inline(always)]
pub fn reset<T: Clone>(buffer: &mut Vec<T>, count: usize, value: T) {
    buffer.clear();
    buffer.resize(count, value);
}
