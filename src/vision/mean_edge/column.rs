//! How much a column of pixels along the bead varies.

use crate::numeric::number::to_f64;

/// Sums over the pixels of a column.
#[derive(Debug, Clone, Copy, Default)]
pub struct ColumnSums {
    sum: f64,
    squares: f64,
    /// Sum of values times their positions about the middle row.
    across: f64,
}

impl ColumnSums {
    /// Adds a value.
    pub fn add(&mut self, position: f64, value: f64) {
        self.sum += value;
        self.squares += value * value;
        self.across += position * value;
    }

    /// Variance of the values about the straight line through them; `rows` is their number.
    pub fn variance_about_line(&self, rows: usize) -> f64 {
        let count = to_f64(rows);
        let along = count * (count * count - 1.0) / 12.0;
        let square = self.squares - self.sum * self.sum / count;
        (square - self.across * self.across / along).max(0.0) / (count - 2.0).max(1.0)
    }
}
