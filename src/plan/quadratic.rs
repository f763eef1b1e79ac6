//! The convex problem of one iteration: minimise ½·xᵀPx + qᵀx subject to A·x ≤ b, by the interior-point
//! solver Clarabel.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};
use nalgebra::{DMatrix, DVector};

/// A quadratic function ½·xᵀPx + qᵀx.
#[derive(Debug, Clone, PartialEq)]
pub struct Quadratic {
    /// P.
    pub hessian: DMatrix<f64>,
    /// q.
    pub gradient: DVector<f64>,
}

/// A term value·x(column) of a constraint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// Index of the unknown.
    pub column: usize,
    /// Its coefficient.
    pub value: f64,
}

/// Constraints A·x ≤ bound, as (row, column, value).
#[derive(Debug, Clone, Default)]
pub struct ConstraintRows {
    indices: (Vec<usize>, Vec<usize>),
    values: Vec<f64>,
    bounds: Vec<f64>,
}

impl ConstraintRows {
    /// Adds Σ value·x(column) ≤ bound.
    pub fn add_upper_bound(&mut self, terms: impl IntoIterator<Item = Term>, bound: f64) {
        for Term { column, value } in terms {
            self.indices.0.push(self.bounds.len());
            self.indices.1.push(column);
            self.values.push(value);
        }
        self.bounds.push(bound);
    }
}

/// The minimum of a function under constraints; `None` where the solver fails.
pub fn minimise(function: &Quadratic, rows: ConstraintRows) -> Option<DVector<f64>> {
    let Quadratic { hessian: p, gradient: q } = function;
    let unknowns = q.len();
    let upper = upper_triangle(p);
    let count = rows.bounds.len();
    let a =
        CscMatrix::new_from_triplets(count, unknowns, rows.indices.0, rows.indices.1, rows.values);
    let settings = DefaultSettingsBuilder::default().verbose(false).max_iter(60).build().ok()?;
    let cones = [SupportedConeT::NonnegativeConeT(count)];
    let mut solver =
        DefaultSolver::new(&upper, q.as_slice(), &a, &rows.bounds, &cones, settings).ok()?;
    solver.solve();
    let found = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
    let x = DVector::from_column_slice(&solver.solution.x);
    (found && x.iter().all(|v| v.is_finite())).then_some(x)
}

fn upper_triangle(p: &DMatrix<f64>) -> CscMatrix<f64> {
    let n = p.ncols();
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    for (column, entries) in p.column_iter().enumerate() {
        for (row, value) in entries.iter().enumerate().take(column + 1) {
            rows.push(row);
            values.push(*value);
        }
        starts.push(rows.len());
    }
    CscMatrix::new(n, n, starts, rows, values)
}
