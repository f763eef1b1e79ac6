//! Linear least squares by normal equations whose columns are scaled to one size.

use nalgebra::{DMatrix, DVector};

use super::row::dot;

/// Coefficients of the columns that together come nearest to a row, the smallest
/// such where columns repeat each other.
pub(super) fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    let sizes: Vec<f64> = columns.iter().map(|c| dot(c, c).sqrt().max(f64::MIN_POSITIVE)).collect();
    let n = columns.len();
    let normal = normal_matrix(columns, &sizes);
    let right = DVector::from_fn(n, |i, _| dot(&columns[i], target) / sizes[i]);
    let solved = normal.svd(true, true).solve(&right, 1e-13).ok()?;
    let found: Vec<f64> = solved.iter().zip(&sizes).map(|(x, size)| x / size).collect();
    found.iter().all(|x| x.is_finite()).then_some(found)
}

/// All products of columns that are divided by sizes.
pub(super) fn normal_matrix(columns: &[Vec<f64>], sizes: &[f64]) -> DMatrix<f64> {
    let n = columns.len();
    let mut normal = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let product = dot(&columns[i], &columns[j]) / (sizes[i] * sizes[j]);
            normal[(i, j)] = product;
            normal[(j, i)] = product;
        }
    }
    normal
}
