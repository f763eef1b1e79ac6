//! Positions between two pixels, rounded to a few phases.

/// Splits a position into the pixel at or before it and the nearest of `phases`
/// positions between that and the next.
#[inline(always)]
pub fn split(at: f32, phases: usize) -> (isize, usize) {
    #[expect(clippy::cast_precision_loss, reason = "there are few phases")]
    let fine = at * phases as f32 + 0.5;
    #[expect(clippy::cast_possible_truncation, reason = "a position near the gauge")]
    let whole = fine as isize;
    // Truncation is a floor except for negative positions, left of the gauge.
    let fine = whole - isize::from(fine < 0.0);
    let phases = phases.cast_signed();
    (fine.div_euclid(phases), fine.rem_euclid(phases).cast_unsigned())
}

/// Where a phase lies after its pixel \[px\].
#[expect(clippy::cast_precision_loss, reason = "there are few phases")]
pub fn offset(phase: usize, phases: usize) -> f64 {
    phase as f64 / phases as f64
}
