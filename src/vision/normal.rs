//! Normal equations of fits with few unknowns.

use nalgebra::{Cholesky, SMatrix, SVector};

/// Normal equations of a small fit.
pub struct Normal<const N: usize> {
    matrix: [[f64; N]; N],
    /// Right-hand side.
    pub vector: SVector<f64, N>,
}

impl<const N: usize> Default for Normal<N> {
    fn default() -> Self {
        Self { matrix: [[0.0; N]; N], vector: SVector::zeros() }
    }
}

impl<const N: usize> Normal<N> {
    /// Adds an observation: its derivatives, what it misses, its weight.
    #[inline(always)]
    pub fn add(&mut self, row: [f64; N], miss: f64, weight: f64) {
        for i in 0..N {
            let weighted = weight * row[i];
            self.vector[i] += weighted * miss;
            // Whole rows, of which one half would do, fit the processor's vectors.
            for (sum, other) in self.matrix[i].iter_mut().zip(row) {
                *sum += weighted * other;
            }
        }
    }

    /// Holds one unknown: `miss` from where it is held.
    pub fn hold(&mut self, which: usize, weight: f64, miss: f64) {
        self.matrix[which][which] += weight;
        self.vector[which] += weight * miss;
    }

    /// Solves them; `None` where they have no solution.
    pub fn solve(&mut self) -> Option<Solved<N>>
    where
        nalgebra::Const<N>: nalgebra::DimMin<nalgebra::Const<N>>,
    {
        for k in 0..N {
            self.matrix[k][k] *= 1.0 + 1e-9;
            self.matrix[k][k] += 1e-12;
        }
        let cholesky = Cholesky::new(SMatrix::from(self.matrix))?;
        let unknowns = cholesky.solve(&self.vector);
        Some(Solved { unknowns, cholesky })
    }
}

/// Solved equations.
pub struct Solved<const N: usize> {
    /// The unknowns.
    pub unknowns: SVector<f64, N>,
    cholesky: Cholesky<f64, nalgebra::Const<N>>,
}

impl<const N: usize> Solved<N> {
    /// Variance of an unknown, for observations of variance 1.
    pub fn variance(&self, which: usize) -> f64 {
        let mut one = SVector::<f64, N>::zeros();
        one[which] = 1.0;
        self.cholesky.solve(&one)[which]
    }

    /// Covariance of the unknowns, for observations of variance 1.
    pub fn covariance(&self) -> SMatrix<f64, N, N> {
        self.cholesky.inverse()
    }
}
