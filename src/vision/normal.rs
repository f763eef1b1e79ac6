//! Normal equations of fits with few unknowns.

/// Normal equations of a small fit.
pub struct Normal<const N: usize> {
    matrix: nalgebra::SMatrix<f64, N, N>,
    /// Right-hand side.
    pub vector: nalgebra::SVector<f64, N>,
}

impl<const N: usize> Default for Normal<N> {
    fn default() -> Self {
        Self { matrix: nalgebra::SMatrix::zeros(), vector: nalgebra::SVector::zeros() }
    }
}

impl<const N: usize> Normal<N> {
    /// Adds an observation: its derivatives, what it misses, its weight.
    pub fn add(&mut self, row: [f64; N], miss: f64, weight: f64) {
        for i in 0..N {
            let weighted = weight * row[i];
            self.vector[i] += weighted * miss;
            for (j, other) in row.iter().take(i + 1).enumerate() {
                self.matrix[(i, j)] += weighted * other;
            }
        }
    }

    /// Holds one unknown: `miss` from where it is held.
    pub fn hold(&mut self, which: usize, weight: f64, miss: f64) {
        self.matrix[(which, which)] += weight;
        self.vector[which] += weight * miss;
    }

    /// The inverse of the matrix, `None` where it has none.
    pub fn inverse(&mut self) -> Option<nalgebra::SMatrix<f64, N, N>>
    where
        nalgebra::Const<N>: nalgebra::DimMin<nalgebra::Const<N>>,
    {
        for k in 0..N {
            self.matrix[(k, k)] *= 1.0 + 1e-9;
            self.matrix[(k, k)] += 1e-12;
        }
        self.matrix.fill_upper_triangle_with_lower_triangle();
        Some(self.matrix.cholesky()?.inverse())
    }
}
