//! The mean of a sample with its confidence interval.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::average::mean;
use super::number::to_f64;

/// Confidence level of the intervals. By definition of "95 %" in the tables.
const CONFIDENCE: f64 = 0.95;

/// A mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The mean; NaN without values.
    pub mean: f64,
    /// Half the interval that holds it with 95 % confidence, by Student's t; `None` for a single
    /// value, and where one is not finite.
    pub confidence: Option<f64>,
}

impl Estimate {
    /// Of independent values.
    pub fn of(values: &[f64]) -> Self {
        let count = to_f64(values.len());
        let middle = mean(values.iter().copied());
        let variance = mean(values.iter().map(|value| (value - middle).powi(2)));
        let spread = (variance / (count - 1.0).max(1.0)).sqrt();
        let factor = confidence_factor(count).filter(|_| spread.is_finite());
        Self { mean: middle, confidence: factor.map(|times| times * spread) }
    }

    /// In another unit: `factor` of it are one of the present one.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        let confidence = self.confidence.map(|half| half * factor.abs());
        Self { mean: self.mean * factor, confidence }
    }
}

/// Half the confidence interval of a mean of `count` values, in standard errors of the mean.
fn confidence_factor(count: f64) -> Option<f64> {
    let student = StudentsT::new(0.0, 1.0, count - 1.0).ok()?;
    Some(student.inverse_cdf(0.5 * (1.0 + CONFIDENCE)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_that_of_students_t() {
        let estimate = Estimate::of(&[1.0, 2.0, 3.0, 6.0]);
        assert_eq!(estimate.mean, 3.0);
        // s² = 14/3, s/√4 = 1.0801; Student's t of 3 degrees of freedom is 3.1824.
        assert!((estimate.confidence.unwrap() - 3.1824 * 1.0801).abs() < 1e-3);
        assert!((confidence_factor(100.0).unwrap() - 1.9842).abs() < 1e-3);
        let in_halves = estimate.times(-2.0);
        assert_eq!(in_halves.mean, -6.0);
        assert!((in_halves.confidence.unwrap() - 2.0 * 3.1824 * 1.0801).abs() < 2e-3);
    }

    #[test]
    fn one_value_and_values_that_were_not_reached_have_no_interval() {
        assert_eq!(Estimate::of(&[2.0]).confidence, None);
        assert_eq!(Estimate::of(&[1.0, f64::INFINITY, 2.0]).confidence, None);
    }
}
