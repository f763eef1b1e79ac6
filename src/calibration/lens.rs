//! Models of a lens: the distortion coefficients that are fitted.

use super::camera::NUMBERS;

/// A lens model by its coefficients; the others are 0.
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
    /// [`Lens::Five`] with the radial part divided by 1 + k4 r² + k5 r⁴ + k6 r⁶.
    Rational,
}

impl Lens {
    /// From the fewest to the most coefficients.
    pub const ALL: [Self; 5] = [Self::One, Self::Two, Self::Four, Self::Five, Self::Rational];

    /// Number of coefficients.
    pub fn coefficients(self) -> usize {
        [1, 2, 4, 5, 8][self as usize]
    }

    /// Number of camera parameters: the first ones in the order of [`super::solve::SHARED_NAMES`].
    pub fn numbers(self) -> usize {
        NUMBERS - 8 + self.coefficients()
    }

    /// Its coefficients in words.
    pub fn name(self) -> &'static str {
        let names = ["k1", "k1 k2", "k1 k2 p1 p2", "k1 k2 p1 p2 k3", "k1 k2 p1 p2 k3 k4 k5 k6"];
        names[self as usize]
    }
}
