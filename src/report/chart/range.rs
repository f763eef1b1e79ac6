//! The range of some values.

/// A range of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl ValueRange {
    /// A range by its ends.
    pub const fn new(min: f64, max: f64) -> Self {
        Self { min, max }
    }

    /// The smallest range that contains both.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Largest less smallest value.
    pub fn length(self) -> f64 {
        self.max - self.min
    }

    /// The range with an additional margin on both sides, as a fraction of its length.
    #[must_use]
    pub fn with_margin(self, fraction: f64) -> Self {
        let margin = self.length() * fraction;
        Self { min: self.min - margin, max: self.max + margin }
    }
}
