//! Buffers that are filled again for each frame.

/// Replaces what a buffer holds.
#[inline(always)]
pub fn refill<T>(buffer: &mut Vec<T>, values: impl IntoIterator<Item = T>) {
    buffer.clear();
    buffer.extend(values);
}

/// Fills a buffer with `count` copies of a value.
#[inline(always)]
pub fn reset<T: Clone>(buffer: &mut Vec<T>, count: usize, value: T) {
    buffer.clear();
    buffer.resize(count, value);
}
