//! Rows of the gauge that belong together.

/// Rows along the bead, as those of a band or of a caliper line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowRange {
    /// The first row.
    pub first: usize,
    /// The row after the last.
    pub end: usize,
}

impl RowRange {
    /// Rows from `first` to the one before `end`.
    pub const fn new(first: usize, end: usize) -> Self {
        Self { first, end }
    }

    /// Middle of the rows \[px\].
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    pub fn middle(self) -> f64 {
        (self.first + self.end - 1) as f64 / 2.0
    }
}
