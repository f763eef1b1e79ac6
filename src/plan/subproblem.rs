//! The convex subproblem about an iterate, and the change that solves it.

use nalgebra::{DMatrix, DVector};

use super::flow::KNOT_S;
use super::horizon::{Evaluation, Horizon, Iterate};
use super::quadratic::{ConstraintRows, Quadratic, Term, minimise};
use super::time_gradient::PassingTimes;
use crate::extruder::limits::CommandLimits;

/// Regularisation of the scaled Hessian's diagonal, for directions without cost.
const RIDGE: f64 = 1e-7;

/// Bounds of an iterate.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Smallest square of the speed at each node \[mm²/s²\].
    pub floor: Vec<f64>,
    /// Largest square that can be reached within the acceleration \[mm²/s²\].
    pub ceiling: Vec<f64>,
    /// Acceleration \[mm/s²\].
    pub accel: f64,
    /// Limits of the command.
    pub drive: CommandLimits,
    /// Longest time from the first node to the last \[s\].
    pub longest_s: f64,
}

/// The subproblem, with relative unknowns: of the free squares of the speed, and of the drive's range.
struct Subproblem<'a> {
    horizon: &'a Horizon<'a>,
    bounds: &'a Bounds,
    iterate: &'a Iterate,
    /// Column of each free node.
    columns: Vec<Option<usize>>,
    /// Node or, after all nodes, knot of each column.
    variables: Vec<usize>,
    /// Scale of each column.
    scale: Vec<f64>,
    rows: ConstraintRows,
}

/// The step of sequential convex programming: the change of the iterate that solves the quadratic
/// problem about it, with relative changes of the squares of the speed within a trust radius.
/// `None` where the solver finds none.
pub fn solve_subproblem(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    iterate: &Iterate,
    evaluation: &Evaluation,
    trust_radius: f64,
) -> Option<Iterate> {
    let mut problem = Subproblem::new(horizon, bounds, iterate);
    problem.constrain_speeds(trust_radius);
    problem.constrain_acceleration();
    problem.constrain_drive();
    problem.constrain_time(evaluation);
    problem.solve(evaluation)
}

impl<'a> Subproblem<'a> {
    fn new(horizon: &'a Horizon<'a>, bounds: &'a Bounds, iterate: &'a Iterate) -> Self {
        let nodes = iterate.squares.len();
        let limits = bounds.floor.iter().zip(&bounds.ceiling).zip(&iterate.squares);
        let mut variables = Vec::new();
        let columns = limits.enumerate().map(|(node, ((low, high), now))| {
            (low < high && *now > 0.0).then(|| {
                variables.push(node);
                variables.len() - 1
            })
        });
        let columns = columns.collect();
        let mut scale: Vec<f64> =
            variables.iter().filter_map(|node| iterate.squares.get(*node).copied()).collect();
        variables.extend(nodes..nodes + iterate.knots.len());
        scale.resize(variables.len(), horizon.drive_span);
        let rows = ConstraintRows::default();
        Self { horizon, bounds, iterate, columns, variables, scale, rows }
    }

    /// Columns and indices of the free nodes.
    fn free(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let nodes = self.iterate.squares.len();
        let variables = self.variables.clone().into_iter().enumerate();
        variables.filter(move |(_, variable)| *variable < nodes)
    }

    fn constrain_speeds(&mut self, trust_radius: f64) {
        for (column, node) in self.free() {
            let now = self.iterate.squares[node];
            let up = (self.bounds.ceiling[node] / now - 1.0).min(trust_radius);
            let down = (1.0 - self.bounds.floor[node] / now).min(trust_radius);
            self.rows.add_upper_bound([Term { column, value: 1.0 }], up.max(0.0));
            self.rows.add_upper_bound([Term { column, value: -1.0 }], down.max(0.0));
        }
    }

    fn constrain_acceleration(&mut self) {
        let (path, squares) = (&self.horizon.path, &self.iterate.squares);
        for node in 1..squares.len() {
            let max_rise = 2.0 * self.bounds.accel * (path[node] - path[node - 1]);
            let rise = (squares[node] - squares[node - 1]) / max_rise;
            let ends = [(node, 1.0), (node - 1, -1.0)];
            let term = |(end, sign): &(usize, f64)| {
                Some(Term { column: self.columns[*end]?, value: sign * squares[*end] / max_rise })
            };
            let terms: Vec<Term> = ends.iter().filter_map(term).collect();
            if terms.is_empty() {
                continue;
            }
            for sign in [1.0, -1.0] {
                let terms = terms.iter().map(|term| Term { value: sign * term.value, ..*term });
                self.rows.add_upper_bound(terms, (1.0 - sign * rise).max(0.0));
            }
        }
    }

    fn constrain_drive(&mut self) {
        let (min, max) = self.bounds.drive.range();
        let span = self.horizon.drive_span;
        let max_rise = self.bounds.drive.rate_per_s() * KNOT_S / span;
        let first = self.variables.len() - self.iterate.knots.len();
        let mut before = self.horizon.extruder.command();
        for (column, now) in (first..).zip(&self.iterate.knots) {
            self.rows.add_upper_bound([Term { column, value: 1.0 }], (max - now) / span);
            self.rows.add_upper_bound([Term { column, value: -1.0 }], (now - min) / span);
            let rise = (now - before) / span;
            for sign in [1.0, -1.0] {
                let last = (column > first).then(|| Term { column: column - 1, value: -sign });
                let terms = [Term { column, value: sign }].into_iter().chain(last);
                self.rows.add_upper_bound(terms, (max_rise - sign * rise).max(0.0));
            }
            before = *now;
        }
    }

    fn constrain_time(&mut self, evaluation: &Evaluation) {
        let slope = PassingTimes::new(&evaluation.profile).to_end();
        let left = self.bounds.longest_s - evaluation.profile.duration_s();
        let value = |column: usize, node: usize| slope[node] * self.scale[column];
        let terms: Vec<_> =
            self.free().map(|(column, node)| Term { column, value: value(column, node) }).collect();
        self.rows.add_upper_bound(terms, left.max(0.0));
    }

    fn solve(self, evaluation: &Evaluation) -> Option<Iterate> {
        let Quadratic { hessian, gradient } = self.horizon.model(self.iterate, evaluation);
        let (variables, scale) = (&self.variables, &self.scale);
        let size = 1.0 / evaluation.cost.max(f64::MIN_POSITIVE);
        let p = DMatrix::from_fn(variables.len(), variables.len(), |i, j| {
            let ridge = if i == j { RIDGE } else { 0.0 };
            hessian[(variables[i], variables[j])] * scale[i] * scale[j] * size + ridge
        });
        let scaled =
            variables.iter().zip(scale).map(|(variable, scale)| gradient[*variable] * scale * size);
        let q = DVector::from_iterator(variables.len(), scaled);
        let x = minimise(&Quadratic { hessian: p, gradient: q }, self.rows)?;
        let nodes = self.iterate.squares.len();
        let mut all = vec![0.0; nodes + self.iterate.knots.len()];
        for ((variable, scale), fraction) in variables.iter().zip(scale).zip(x.iter()) {
            all[*variable] = fraction * scale;
        }
        let knots = all.split_off(nodes);
        Some(Iterate { squares: all, knots })
    }
}
