//! Models of a lens: which of the coefficients of distortion are fitted.

use super::camera::NUMBERS;

/// A model of a lens, by the coefficients it has; the others are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Lens {
    /// k1.
    One,
    /// k1 k2.
    Two,
    /// k1 k2 p1 p2.
    Four,
    /// k1 k2 p1 p2 k3 (Brown 1971).
    Five,
    /// The same over 1 + k4 r² + k5 r⁴ + k6 r⁶.
    Rational,
}

impl Lens {
    /// From the one with the fewest coefficients to the one with the most.
    pub const ALL: [Self; 5] = [Self::One, Self::Two, Self::Four, Self::Five, Self::Rational];

    /// How many coefficients are fitted.
    pub fn coefficients(self) -> usize {
        match self {
            Self::One => 1,
            Self::Two => 2,
            Self::Four => 4,
            Self::Five => 5,
            Self::Rational => 8,
        }
    }

    /// How many of the camera's numbers are: in the order of
    /// [`super::camera::NAMES`] the first so many.
    pub fn numbers(self) -> usize {
        NUMBERS - 8 + self.coefficients()
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::One => "k1",
            Self::Two => "k1 k2",
            Self::Four => "k1 k2 p1 p2",
            Self::Five => "k1 k2 p1 p2 k3",
            Self::Rational => "k1 k2 p1 p2 k3 k4 k5 k6",
        }
    }
}
