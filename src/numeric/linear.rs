//! Linear least squares by normal equations whose columns are scaled to unit norm.

use nalgebra::{DMatrix, DVector};

use super::row::dot;

/// Singular values below this are taken for zero: rounding of normal equations of unit
/// diagonal leaves some 1e-16 times the number of samples.
const MIN_SINGULAR_VALUE: f64 = 1e-13;

/// Coefficients of the columns whose sum is nearest to `target`; the minimum-norm solution
/// for linearly dependent columns. `None` where it is not finite.
pub fn least_squares(columns: &[Vec<f64>], target: &[f64]) -> Option<Vec<f64>> {
    let norms = norms(columns);
    let normal = normal_matrix(columns, &norms);
    let right = DVector::from_fn(columns.len(), |i, _| dot(&columns[i], target) / norms[i]);
    let solved = normal.svd(true, true).solve(&right, MIN_SINGULAR_VALUE).ok()?;
    let found: Vec<f64> = solved.iter().zip(&norms).map(|(x, norm)| x / norm).collect();
    found.iter().all(|x| x.is_finite()).then_some(found)
}

/// Euclidean norms of the columns; at least [`f64::MIN_POSITIVE`].
pub fn norms(columns: &[Vec<f64>]) -> Vec<f64> {
    columns.iter().map(|c| dot(c, c).sqrt().max(f64::MIN_POSITIVE)).collect()
}

/// The matrix `AᵀA` of the columns, each divided by its norm.
pub fn normal_matrix(columns: &[Vec<f64>], norms: &[f64]) -> DMatrix<f64> {
    let n = columns.len();
    let mut normal = DMatrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let product = dot(&columns[i], &columns[j]) / (norms[i] * norms[j]);
            normal[(i, j)] = product;
            normal[(j, i)] = product;
        }
    }
    normal
}
