//! Smoothing without a shift: a polynomial is fitted to a window by least squares and evaluated
//! at one of its samples (bcs-thesis, eqs. (5), (6); Savitzky and Golay 1964). The coefficients
//! are sums over orthonormal polynomials, which avoids the ill-conditioned powers of a long
//! window.

use super::number::to_f64;
use super::row::dot;

/// Largest degree. A choice: higher ones do not smooth.
const MAX_DEGREE: usize = 8;
/// Longest window. A choice against a mistyped number.
const MAX_WINDOW: usize = 10_001;

/// Invalid parameters of the filter.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SavGolError {
    /// A window of a wrong length.
    #[error(
        "a window of {window} samples for a polynomial of degree {degree}: expected an odd number \
         from {} to {MAX_WINDOW}", (*degree + 1) | 1
    )]
    Window {
        /// The window's length, in samples.
        window: usize,
        /// The polynomial's degree.
        degree: usize,
    },
    /// A degree out of range.
    #[error("a polynomial of degree {degree}: expected 0 to {MAX_DEGREE}")]
    Degree {
        /// The polynomial's degree.
        degree: usize,
    },
    /// Fewer samples than the window.
    #[error("{got} samples: a window of {window} needs as many")]
    TooFew {
        /// Samples that there are.
        got: usize,
        /// The window's length.
        window: usize,
    },
}

/// Window and degree of the polynomial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SavGol {
    window: usize,
    degree: usize,
}

impl SavGol {
    /// A smoothing filter: an odd window, a degree below its length.
    pub fn new(window: usize, degree: usize) -> Result<Self, SavGolError> {
        if degree > MAX_DEGREE {
            return Err(SavGolError::Degree { degree });
        }
        if window.is_multiple_of(2) || window <= degree || window > MAX_WINDOW {
            return Err(SavGolError::Window { window, degree });
        }
        Ok(Self { window, degree })
    }

    /// Samples of the window.
    pub fn window(&self) -> usize {
        self.window
    }

    /// Weights of the samples of the window, the oldest first, for the value at sample `at`, from
    /// 0: the sum over the orthonormal polynomials of their values at both samples.
    pub fn coefficients(&self, at: usize) -> Vec<f64> {
        // The window is mapped to −1 to 1.
        let half = to_f64(self.window / 2).max(1.0);
        let position = |sample: usize| (to_f64(sample) - to_f64(self.window / 2)) / half;
        let mut coefficients = vec![0.0; self.window];
        let mut basis = Basis::new((0..self.window).map(position).collect());
        for degree in 0..=self.degree {
            if degree > 0 {
                basis.advance();
            }
            let there = basis.values[at];
            for (coefficient, value) in coefficients.iter_mut().zip(&basis.values) {
                *coefficient += there * value;
            }
        }
        coefficients
    }

    /// As many values as samples: at the middle of each window, and at the ends from the
    /// polynomials of the first and the last window.
    pub fn filter(&self, samples: &[f64]) -> Result<Vec<f64>, SavGolError> {
        let (got, window) = (samples.len(), self.window);
        let (Some(first), Some(last)) =
            (samples.get(..window), got.checked_sub(window).and_then(|from| samples.get(from..)))
        else {
            return Err(SavGolError::TooFew { got, window });
        };
        let middle = self.coefficients(window / 2);
        let mut values = Vec::with_capacity(got);
        values.extend((0..window / 2).map(|at| dot(&self.coefficients(at), first)));
        values.extend(samples.windows(window).map(|seen| dot(&middle, seen)));
        values.extend((window / 2 + 1..window).map(|at| dot(&self.coefficients(at), last)));
        Ok(values)
    }
}

/// The filter for live use: the polynomial of the newest samples, at the last of them. It is
/// noisier than in the middle, and has no delay for polynomials.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveSavGol {
    coefficients: Vec<f64>,
    ring: Vec<f64>,
    next: usize,
}

impl LiveSavGol {
    /// With an empty window.
    pub fn new(filter: &SavGol) -> Self {
        let coefficients = filter.coefficients(filter.window - 1);
        Self { ring: Vec::with_capacity(coefficients.len()), coefficients, next: 0 }
    }

    /// Takes a sample; returns the value there once the window is full.
    pub fn step(&mut self, sample: f64) -> Option<f64> {
        match self.ring.get_mut(self.next) {
            Some(oldest) => *oldest = sample,
            None => self.ring.push(sample),
        }
        self.next = (self.next + 1) % self.coefficients.len();
        if self.ring.len() < self.coefficients.len() {
            return None;
        }
        let (newer, older) = self.ring.split_at(self.next);
        let seen = older.iter().chain(newer);
        Some(self.coefficients.iter().zip(seen).map(|(c, value)| c * value).sum())
    }
}

/// One of the orthonormal polynomials at every sample, and the one before it, by the recurrence
/// b'·q(k+1) = (x − a)·q(k) − b·q(k−1).
struct Basis {
    places: Vec<f64>,
    values: Vec<f64>,
    before: Vec<f64>,
    norm: f64,
}

impl Basis {
    fn new(places: Vec<f64>) -> Self {
        let count = places.len();
        let values = vec![1.0 / to_f64(count).sqrt(); count];
        Self { places, values, before: vec![0.0; count], norm: 0.0 }
    }

    fn advance(&mut self) {
        let weighted = self.places.iter().zip(&self.values).map(|(x, q)| x * q * q);
        let (centre, back) = (weighted.sum::<f64>(), self.norm);
        let row = self.places.iter().zip(&self.values).zip(&self.before);
        let mut next: Vec<f64> = row.map(|((x, q), p)| (x - centre) * q - back * p).collect();
        let norm = dot(&next, &next).sqrt();
        for value in &mut next {
            *value /= norm;
        }
        self.before = std::mem::replace(&mut self.values, next);
        self.norm = norm;
    }
}

#[cfg(test)]
mod tests;
