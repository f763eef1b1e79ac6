//! Covariance of the estimate for white and for autocorrelated residuals (the sandwich
//! estimator).

use nalgebra::DMatrix;

use super::autoregression::ArModel;
use crate::numeric::linear::{normal_matrix, norms};
use crate::numeric::number::to_f64;

/// Covariances of the parameters.
pub(super) struct Covariances {
    /// For white residuals.
    pub white: DMatrix<f64>,
    /// For residuals with their autocorrelation.
    pub correlated: DMatrix<f64>,
    /// Direction of the parameters that the data determine least, where they hardly determine
    /// it.
    pub weak_direction: Option<Vec<f64>>,
}

/// Smallest eigenvalue of the normalised equations above rounding. A choice.
const MIN_EIGENVALUE: f64 = 1e-11;

/// From the derivatives of the prediction and the model of the residuals.
pub(super) fn covariances(columns: &[Vec<f64>], noise: &ArModel, samples: usize) -> Covariances {
    let sizes = norms(columns);
    let p = columns.len();
    let normal = normal_matrix(columns, &sizes);
    let eigen = normal.clone().symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let is_loose = eigen.eigenvalues[least] < MIN_EIGENVALUE;
    let along = || {
        let direction = eigen.eigenvectors.column(least);
        direction.iter().zip(&sizes).map(|(part, size)| part / size).collect()
    };
    let Some(inverse) = normal.try_inverse() else {
        let infinite = DMatrix::from_diagonal_element(p, p, f64::INFINITY);
        let weak_direction = Some(along());
        return Covariances { white: infinite.clone(), correlated: infinite, weak_direction };
    };
    let freedom = to_f64(samples) / to_f64(samples.saturating_sub(p).max(1));
    let weighted: Vec<Vec<f64>> = columns.iter().map(|c| noise.weight(c)).collect();
    let middle = normal_matrix(&weighted, &sizes);
    let scaled = |m: DMatrix<f64>| {
        DMatrix::from_fn(p, p, |i, j| m[(i, j)] * freedom / (sizes[i] * sizes[j]))
    };
    Covariances {
        white: scaled(&inverse * noise.variance),
        correlated: scaled(&inverse * middle * &inverse),
        weak_direction: is_loose.then(along),
    }
}

#[cfg(test)]
mod tests {
    use super::super::autoregression::tests::lagged;
    use super::*;

    #[test]
    fn the_mean_of_correlated_noise_varies_as_its_standard_error_predicts() {
        let (n, pole) = (400, 0.8);
        let ones = vec![vec![1.0; n]];
        let trials = 300_u32;
        let (mut squares, mut predicted, mut white) = (0.0, 0.0, 0.0);
        for seed in 0..trials {
            let noise = lagged(u64::from(seed), n + 100, pole)[100..].to_vec();
            let mean = noise.iter().sum::<f64>() / 400.0;
            let left: Vec<f64> = noise.iter().map(|e| e - mean).collect();
            let spread = covariances(&ones, &ArModel::of(&left), n);
            squares += mean * mean;
            predicted += spread.correlated[(0, 0)];
            white += spread.white[(0, 0)];
        }
        let (predicted, white) = (predicted / squares, white / squares);
        assert!((0.7..1.2).contains(&predicted), "{predicted}");
        assert!(white < 0.2, "{white}");
    }
}
