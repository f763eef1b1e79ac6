//! The course of an edge with as few degrees of freedom as a gauge supports.

/// A course along the gauge: its mean position, and half of what it moves by from end to
/// end \[px\]; the bend is a parabola's with a mean of zero.
#[derive(Debug, Clone, Copy, Default)]
pub struct ParabolicCourse {
    pub at: f64,
    pub tilt: f64,
    pub bend: f64,
}

impl ParabolicCourse {
    /// Position at a place along the gauge, −1 to 1 \[px\].
    pub fn at(&self, place: f64) -> f64 {
        self.at + self.tilt * place + self.bend * bend_at(place)
    }
}

/// A parabola from −1 to 1 whose mean is zero.
pub fn bend_at(place: f64) -> f64 {
    place * place - 1.0 / 3.0
}
