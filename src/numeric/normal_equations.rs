//! Normal equations of fits with few unknowns.

use nalgebra::{Cholesky, SMatrix, SVector};

/// Normal equations of a fit with few parameters.
pub struct NormalEquations<const N: usize> {
    matrix: [[f64; N]; N],
    /// Right-hand side.
    pub vector: SVector<f64, N>,
}

impl<const N: usize> Default for NormalEquations<N> {
    fn default() -> Self {
        Self { matrix: [[0.0; N]; N], vector: SVector::zeros() }
    }
}

impl<const N: usize> NormalEquations<N> {
    /// Adds an observation: its derivatives, its residual, its weight.
    #[inline(always)]
    pub fn add(&mut self, row: [f64; N], miss: f64, weight: f64) {
        for i in 0..N {
            let weighted = weight * row[i];
            self.vector[i] += weighted * miss;
            // Whole rows are faster in vector instructions than the triangle that would be
            // enough.
            for (sum, other) in self.matrix[i].iter_mut().zip(row) {
                *sum += weighted * other;
            }
        }
    }

    /// Adds a prior for one parameter: `miss` is the distance of the prior from the current
    /// value.
    pub fn add_prior(&mut self, which: usize, weight: f64, miss: f64) {
        self.matrix[which][which] += weight;
        self.vector[which] += weight * miss;
    }

    /// The sum with the equations of other observations.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        let sum = |row: usize, column: usize| self.matrix[row][column] + other.matrix[row][column];
        Self {
            matrix: std::array::from_fn(|row| std::array::from_fn(|column| sum(row, column))),
            vector: self.vector + other.vector,
        }
    }

    /// Decrease of the weighted sum of squares by a step.
    #[inline(always)]
    pub fn decrease_after(&self, step: &SVector<f64, N>) -> f64 {
        2.0 * self.vector.dot(step) - (SMatrix::from(self.matrix) * step).dot(step)
    }

    /// The equations after a step.
    #[inline(always)]
    pub fn after(&self, step: &SVector<f64, N>) -> Self {
        let vector = self.vector - SMatrix::from(self.matrix) * step;
        Self { matrix: self.matrix, vector }
    }

    /// The equations of some parameters, with the others fixed.
    #[inline(always)]
    pub fn of_unknowns<const M: usize>(&self, of: [usize; M]) -> PartialEquations<M> {
        PartialEquations {
            matrix: SMatrix::from_fn(|row, column| self.matrix[of[row]][of[column]]),
            vector: SVector::from_fn(|row, _| self.vector[of[row]]),
        }
    }

    /// Solves them; `None` if they are singular.
    pub fn solve(&mut self) -> Option<NormalSolution<N>>
    where
        nalgebra::Const<N>: nalgebra::DimMin<nalgebra::Const<N>>,
    {
        for k in 0..N {
            self.matrix[k][k] *= 1.0 + 1e-9;
            self.matrix[k][k] += 1e-12;
        }
        let cholesky = Cholesky::new(SMatrix::from(self.matrix))?;
        let unknowns = cholesky.solve(&self.vector);
        Some(NormalSolution { unknowns, cholesky })
    }
}

/// Normal equations of some of the parameters.
pub struct PartialEquations<const M: usize> {
    matrix: SMatrix<f64, M, M>,
    vector: SVector<f64, M>,
}

impl<const M: usize> PartialEquations<M> {
    /// Largest decrease of the sum of squares by these parameters; 0 where the observations do
    /// not determine them.
    #[inline(always)]
    pub fn max_decrease(&self) -> f64 {
        let unknowns = Cholesky::new(self.matrix);
        unknowns.map_or(0.0, |unknowns| self.vector.dot(&unknowns.solve(&self.vector)))
    }
}

/// Solved equations.
pub struct NormalSolution<const N: usize> {
    /// The parameters.
    pub unknowns: SVector<f64, N>,
    cholesky: Cholesky<f64, nalgebra::Const<N>>,
}

impl<const N: usize> NormalSolution<N> {
    /// Variance of a parameter for observations of variance 1.
    pub fn variance(&self, which: usize) -> f64 {
        let mut one = SVector::<f64, N>::zeros();
        one[which] = 1.0;
        self.cholesky.solve(&one)[which]
    }

    /// Covariance of the parameters for observations of variance 1.
    pub fn covariance(&self) -> SMatrix<f64, N, N> {
        self.cholesky.inverse()
    }
}
