//! Solution of normal equations by Cholesky factors, with the parameters of one placement
//! eliminated (the Schur complement).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SMatrix};

use super::equations::{Equations, SHARED};

/// Smallest standard deviation of a parameter with the others known over that with the others
/// unknown. A choice: below it rounding exceeds the information in the images.
const MIN_PIVOT: f64 = 1e-5;

/// Normal equations of one placement with its own parameters eliminated.
#[derive(Debug, Clone)]
pub struct Elimination {
    /// Information on the shared parameters with the placement free.
    pub reduced: SMatrix<f64, SHARED, SHARED>,
    /// Information on the placement with the shared parameters known.
    pub placement: Factor,
    /// How the placement follows the shared parameters, whitened.
    pub follows: DMatrix<f64>,
}

impl Elimination {
    /// `None` where the corners do not determine the placement.
    pub fn of(equations: &Equations) -> Option<Self> {
        let position = Factor::of(&equations.placement)?;
        let follows = position.whiten(&equations.both);
        let left = equations.shared - as_shared(&(follows.transpose() * &follows));
        Some(Self { reduced: left, placement: position, follows })
    }
}

/// A matrix of the shared parameters with fixed size.
fn as_shared(matrix: &DMatrix<f64>) -> SMatrix<f64, SHARED, SHARED> {
    SMatrix::from_fn(|row, column| matrix[(row, column)])
}

/// Factor of a positive definite matrix M by which xᵀM⁻¹x is a sum of squares. Parameters whose
/// row and column are 0 are known and have no variance.
#[derive(Debug, Clone)]
pub struct Factor {
    /// Scales the matrix to a diagonal of ones.
    unit: DVector<f64>,
    /// Cholesky factor of the scaled matrix.
    lower: Cholesky<f64, Dyn>,
}

impl Factor {
    /// `None` for a matrix that is not positive definite, or nearly singular.
    pub fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        let unit = matrix.diagonal().map(|on| if on == 0.0 { 0.0 } else { 1.0 / on.sqrt() });
        let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
            if row == column { 1.0 } else { matrix[(row, column)] * unit[row] * unit[column] }
        });
        let lower = Cholesky::new(scaled)?;
        let apart = lower.l_dirty().diagonal().iter().all(|&on| on > MIN_PIVOT);
        apart.then_some(Self { unit, lower })
    }

    /// [`Self::of`] for a matrix of the shared parameters.
    pub fn of_shared(matrix: &SMatrix<f64, SHARED, SHARED>) -> Option<Self> {
        Self::of(&DMatrix::from_fn(SHARED, SHARED, |row, column| matrix[(row, column)]))
    }

    /// Columns whose squared norms are xᵀM⁻¹x.
    pub fn whiten(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = x.clone();
        for (mut row, unit) in scaled.row_iter_mut().zip(&self.unit) {
            row *= *unit;
        }
        self.lower.l_dirty().solve_lower_triangular_unchecked(&scaled)
    }

    /// M⁻¹x.
    pub fn solve(&self, x: &DVector<f64>) -> DVector<f64> {
        self.lower.solve(&x.component_mul(&self.unit)).component_mul(&self.unit)
    }

    /// Variances of the parameters, in units of the noise variance.
    pub fn variances(&self) -> DVector<f64> {
        let whitened = self.whiten(&DMatrix::identity(self.unit.len(), self.unit.len()));
        DVector::from_iterator(
            self.unit.len(),
            whitened.column_iter().map(|column| column.norm_squared()),
        )
    }
}
