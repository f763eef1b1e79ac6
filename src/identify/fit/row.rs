//! Sums over a row of numbers.

use crate::numeric::number::to_f64;

/// Smallest and largest value.
pub(super) fn min_max(row: &[f64]) -> [f64; 2] {
    row.iter().fold([f64::MAX, f64::MIN], |[least, most], v| [least.min(*v), most.max(*v)])
}

/// Standard deviation.
pub(super) fn standard_deviation(row: &[f64]) -> f64 {
    let n = to_f64(row.len());
    let mean = row.iter().sum::<f64>() / n;
    (row.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>() / n).sqrt()
}

/// Sum of the products of two rows.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
