//! Medians and quantiles by selection; the values are left in another order.

use std::cmp::Ordering;

use super::number::{to_count, to_f64};

/// Derived: 1/Φ⁻¹(¾), the standard deviation of a normal distribution over its median absolute
/// deviation.
pub const SIGMA_PER_MEDIAN: f64 = 1.4826;

/// Derived: Φ⁻¹(¾)², the median of the square of a standard normal variable.
pub const MEDIAN_OF_SQUARED_NORMAL: f64 = 0.455;

/// Numbers that have an order.
pub trait Ordered: Copy {
    /// The total order of IEEE 754.
    fn order(&self, other: &Self) -> Ordering;
}

impl Ordered for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Ordered for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

/// The value at a rank, from 0 for the smallest; `None` if there are not as many.
#[inline(always)]
pub fn at<T: Ordered>(values: &mut [T], rank: usize) -> Option<T> {
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, T::order).1)
}

/// The median; the upper one of an even number. `None` without values.
#[inline(always)]
pub fn median<T: Ordered>(values: &mut [T]) -> Option<T> {
    let middle = values.len() / 2;
    at(values, middle)
}

/// The median of numbers from an iterator; the upper one of an even number. `None` without values.
pub fn median_of(values: impl Iterator<Item = f64>) -> Option<f64> {
    median(&mut values.collect::<Vec<_>>())
}

/// The median; the mean of the middle two of an even number. `None` without values.
pub fn mean_median(values: &mut [f64]) -> Option<f64> {
    let count = values.len();
    let upper = median(values)?;
    if count % 2 == 1 {
        return Some(upper);
    }
    Some(f64::midpoint(at(values, count / 2 - 1)?, upper))
}

/// The value at the rank nearest to a fraction of the way from the smallest to the largest. `None`
/// without values.
pub fn quantile(values: &mut [f64], fraction: f64) -> Option<f64> {
    at(values, to_count((fraction * to_f64(values.len().saturating_sub(1))).round()))
}

/// Median absolute deviation from `median`; the deviations replace the values. `None` without
/// values.
#[inline(always)]
pub fn median_deviation(values: &mut [f32], median: f32) -> Option<f32> {
    for value in &mut *values {
        *value = (*value - median).abs();
    }
    self::median(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::normal_distribution::cumulative;

    #[test]
    fn the_constants_are_those_of_the_normal_distribution() {
        assert!((cumulative(1.0 / SIGMA_PER_MEDIAN) - 0.75).abs() < 1e-5);
        assert!((cumulative(MEDIAN_OF_SQUARED_NORMAL.sqrt()) - 0.75).abs() < 1e-4);
    }

    #[test]
    fn ranks_are_those_of_the_sorted_values() {
        let mut values = [5.0, -1.0, 3.0, 9.0];
        assert_eq!(at(&mut values, 0), Some(-1.0));
        assert_eq!(median(&mut values), Some(5.0));
        assert_eq!(median(&mut values[..0]), None);
        assert_eq!(at(&mut [1.0f32], 1), None);
    }

    #[test]
    fn the_median_of_an_even_number_lies_between_the_middle_two() {
        assert_eq!(mean_median(&mut [4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(mean_median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(mean_median(&mut []), None);
    }

    #[test]
    fn a_quantile_is_the_value_at_the_nearest_rank() {
        let mut values: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        assert_eq!(quantile(&mut values, 0.99), Some(99.0));
        assert_eq!(quantile(&mut [7.0, 5.0], 0.5), Some(7.0));
        assert_eq!(quantile(&mut [], 0.5), None);
    }

    #[test]
    fn a_few_far_values_change_no_deviation() {
        let mut values = [1.0, 2.0, 3.0, 4.0, 900.0];
        assert_eq!(median_deviation(&mut values, 3.0), Some(1.0));
        assert_eq!(median_deviation(&mut [], 0.0), None);
    }
}
