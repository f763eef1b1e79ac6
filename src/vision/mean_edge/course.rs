//! A line or a parabola along the gauge.

/// A course along the gauge: its mean position, and half of what it moves by from end to
/// end \[px\]; the bend is a parabola's with a mean of zero.
#[derive(Debug, Clone, Copy, Default)]
pub struct ParabolicCourse {
    pub at: f64,
    pub tilt: f64,
    pub bend: f64,
}

impl ParabolicCourse {
    /// Position at a position along the gauge, −1 to 1 \[px\].
    pub fn at(&self, position: f64) -> f64 {
        self.at + self.tilt * position + self.bend * bend_at(position)
    }
}

/// A parabola from −1 to 1 whose mean is zero.
pub fn bend_at(position: f64) -> f64 {
    position * position - 1.0 / 3.0
}
