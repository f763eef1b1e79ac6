//! One round: the convex subproblem about an iterate, and the change that solves it.

use nalgebra::{DMatrix, DVector};

use super::flow::KNOT_S;
use super::horizon::{Evaluation, Horizon, Iterate};
use super::quadratic::{ConstraintRows, Quadratic, Term, minimise};
use super::time_gradient::PassingTimes;
use crate::extruder::limits::CommandLimits;

/// Added to the scaled Hessian's diagonal, for directions that cost nothing.
const RIDGE: f64 = 1e-7;

/// What a choice has to keep.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Least square of the speed at each node \[mm²/s²\].
    pub floor: Vec<f64>,
    /// Largest, which keeps the acceleration itself \[mm²/s²\].
    pub ceiling: Vec<f64>,
    /// Acceleration \[mm/s²\].
    pub accel: f64,
    /// Of the command.
    pub drive: CommandLimits,
    /// Longest time from the first node to the last \[s\].
    pub longest_s: f64,
}

/// The problem of a round, with its unknowns as shares: of the squares of the speed that
/// are free, and of the drive's range.
struct Subproblem<'a> {
    horizon: &'a Horizon<'a>,
    bounds: &'a Bounds,
    choice: &'a Iterate,
    /// Column of each node that is free.
    columns: Vec<Option<usize>>,
    /// Node or, after all nodes, knot of each column.
    variables: Vec<usize>,
    /// What a share of one is.
    scale: Vec<f64>,
    rows: ConstraintRows,
}

/// The change that the convex problem about a choice asks for, with squares of the speed
/// that change by at most a share of themselves.
pub fn solve_subproblem(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    iterate: &Iterate,
    outcome: &Evaluation,
    trust_radius: f64,
) -> Option<Iterate> {
    let mut round = Subproblem::new(horizon, bounds, iterate);
    round.keep_speeds(trust_radius);
    round.keep_acceleration();
    round.keep_drive();
    round.keep_time(outcome);
    round.solve(outcome)
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
        Self {
            horizon,
            bounds,
            choice: iterate,
            columns,
            variables,
            scale,
            rows: ConstraintRows::default(),
        }
    }

    /// Columns and nodes that are free.
    fn free(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let nodes = self.choice.squares.len();
        self.variables
            .clone()
            .into_iter()
            .enumerate()
            .filter(move |(_, variable)| *variable < nodes)
    }

    fn keep_speeds(&mut self, trust_radius: f64) {
        for (column, node) in self.free() {
            let now = self.choice.squares[node];
            let up = (self.bounds.ceiling[node] / now - 1.0).min(trust_radius);
            let down = (1.0 - self.bounds.floor[node] / now).min(trust_radius);
            self.rows.add_upper_bound([Term { column, value: 1.0 }], up.max(0.0));
            self.rows.add_upper_bound([Term { column, value: -1.0 }], down.max(0.0));
        }
    }

    fn keep_acceleration(&mut self) {
        let (path, squares) = (&self.horizon.path, &self.choice.squares);
        for node in 1..squares.len() {
            let most = 2.0 * self.bounds.accel * (path[node] - path[node - 1]);
            let rise = (squares[node] - squares[node - 1]) / most;
            let ends = [(node, 1.0), (node - 1, -1.0)];
            let term = |(end, sign): &(usize, f64)| {
                Some(Term { column: self.columns[*end]?, value: sign * squares[*end] / most })
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

    fn keep_drive(&mut self) {
        let (min, max) = self.bounds.drive.range();
        let span = self.horizon.drive_span;
        let most = self.bounds.drive.rate_per_s() * KNOT_S / span;
        let first = self.variables.len() - self.choice.knots.len();
        let mut before = self.horizon.extruder.command();
        for (column, now) in (first..).zip(&self.choice.knots) {
            self.rows.add_upper_bound([Term { column, value: 1.0 }], (max - now) / span);
            self.rows.add_upper_bound([Term { column, value: -1.0 }], (now - min) / span);
            let rise = (now - before) / span;
            for sign in [1.0, -1.0] {
                let last = (column > first).then(|| Term { column: column - 1, value: -sign });
                let terms = [Term { column, value: sign }].into_iter().chain(last);
                self.rows.add_upper_bound(terms, (most - sign * rise).max(0.0));
            }
            before = *now;
        }
    }

    fn keep_time(&mut self, outcome: &Evaluation) {
        let slope = PassingTimes::new(&outcome.profile).to_end();
        let left = self.bounds.longest_s - outcome.profile.duration_s();
        let value = |column: usize, node: usize| slope[node] * self.scale[column];
        let terms: Vec<_> =
            self.free().map(|(column, node)| Term { column, value: value(column, node) }).collect();
        self.rows.add_upper_bound(terms, left.max(0.0));
    }

    fn solve(self, outcome: &Evaluation) -> Option<Iterate> {
        let Quadratic { hessian, gradient } = self.horizon.model(self.choice, outcome);
        let (variables, scale) = (&self.variables, &self.scale);
        let size = 1.0 / outcome.cost.max(f64::MIN_POSITIVE);
        let p = DMatrix::from_fn(variables.len(), variables.len(), |i, j| {
            let ridge = if i == j { RIDGE } else { 0.0 };
            hessian[(variables[i], variables[j])] * scale[i] * scale[j] * size + ridge
        });
        let scaled =
            variables.iter().zip(scale).map(|(variable, scale)| gradient[*variable] * scale * size);
        let q = DVector::from_iterator(variables.len(), scaled);
        let x = minimise(&Quadratic { hessian: p, gradient: q }, self.rows)?;
        let nodes = self.choice.squares.len();
        let mut all = vec![0.0; nodes + self.choice.knots.len()];
        for ((variable, scale), fraction) in variables.iter().zip(scale).zip(x.iter()) {
            all[*variable] = fraction * scale;
        }
        let knots = all.split_off(nodes);
        Some(Iterate { squares: all, knots })
    }
}
