//! Sums and extremes of a row of numbers.

/// Smallest and largest value; [`f64::MAX`] and [`f64::MIN`] for an empty row.
pub fn min_max(row: &[f64]) -> [f64; 2] {
    row.iter().fold([f64::MAX, f64::MIN], |[least, most], v| [least.min(*v), most.max(*v)])
}

/// Scalar product of two rows; the shorter one gives the length.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
