//! How far the parameters may be off: the covariance of the estimate, for white
//! residuals and for residuals of the colour that they have.

use nalgebra::DMatrix;

use super::autoregression::ArModel;
use crate::numeric::linear::{normal_matrix, norms};

/// Covariances of the parameters.
pub(super) struct Covariances {
    /// For white residuals.
    pub white: DMatrix<f64>,
    /// For residuals of their colour.
    pub correlated: DMatrix<f64>,
    /// How the parameters move along the direction in which the data hold least,
    /// where they hold next to nothing.
    pub weak_direction: Option<Vec<f64>>,
}

/// Least eigenvalue of the normalized equations that still tells something.
const MIN_EIGENVALUE: f64 = 1e-11;

/// Of the slopes of the prediction and the residuals' colour.
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
    let loose: Option<Vec<f64>> = is_loose.then(along);
    let endless = || DMatrix::from_diagonal_element(p, p, f64::INFINITY);
    let Some(inverse) = normal.try_inverse() else {
        return Covariances {
            white: endless(),
            correlated: endless(),
            weak_direction: loose.or_else(|| Some(along())),
        };
    };
    #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
    let freedom = samples as f64 / (samples.saturating_sub(p).max(1)) as f64;
    let weighed: Vec<Vec<f64>> = columns.iter().map(|c| noise.weight(c)).collect();
    let middle = normal_matrix(&weighed, &sizes);
    let scaled = |m: DMatrix<f64>| {
        DMatrix::from_fn(p, p, |i, j| m[(i, j)] * freedom / (sizes[i] * sizes[j]))
    };
    Covariances {
        white: scaled(&inverse * noise.variance),
        correlated: scaled(&inverse * middle * &inverse),
        weak_direction: loose,
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
