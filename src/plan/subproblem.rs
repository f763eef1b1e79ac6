//! One round: the convex subproblem about an iterate, and the change that solves it.

use nalgebra::{DMatrix, DVector};

use super::flow::KNOT_S;
use super::horizon::{Choice, Horizon, Outcome};
use super::quadratic::{Quadratic, Rows, Term, least};
use super::time_gradient::Clock;
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
struct Round<'a> {
    horizon: &'a Horizon<'a>,
    bounds: &'a Bounds,
    choice: &'a Choice,
    /// Column of each node that is free.
    columns: Vec<Option<usize>>,
    /// Node or, after all nodes, knot of each column.
    places: Vec<usize>,
    /// What a share of one is.
    scale: Vec<f64>,
    rows: Rows,
}

/// The change that the convex problem about a choice asks for, with squares of the speed
/// that change by at most a share of themselves.
pub fn step(
    horizon: &Horizon<'_>,
    bounds: &Bounds,
    choice: &Choice,
    outcome: &Outcome,
    reach: f64,
) -> Option<Choice> {
    let mut round = Round::new(horizon, bounds, choice);
    round.keep_speeds(reach);
    round.keep_acceleration();
    round.keep_drive();
    round.keep_time(outcome);
    round.solve(outcome)
}

impl<'a> Round<'a> {
    fn new(horizon: &'a Horizon<'a>, bounds: &'a Bounds, choice: &'a Choice) -> Self {
        let nodes = choice.squares.len();
        let limits = bounds.floor.iter().zip(&bounds.ceiling).zip(&choice.squares);
        let mut places = Vec::new();
        let columns = limits.enumerate().map(|(node, ((low, high), now))| {
            (low < high && *now > 0.0).then(|| {
                places.push(node);
                places.len() - 1
            })
        });
        let columns = columns.collect();
        let mut scale: Vec<f64> =
            places.iter().filter_map(|node| choice.squares.get(*node).copied()).collect();
        places.extend(nodes..nodes + choice.knots.len());
        scale.resize(places.len(), horizon.drive_span);
        Self { horizon, bounds, choice, columns, places, scale, rows: Rows::default() }
    }

    /// Columns and nodes that are free.
    fn free(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let nodes = self.choice.squares.len();
        self.places.clone().into_iter().enumerate().filter(move |(_, place)| *place < nodes)
    }

    fn keep_speeds(&mut self, reach: f64) {
        for (column, node) in self.free() {
            let now = self.choice.squares[node];
            let up = (self.bounds.ceiling[node] / now - 1.0).min(reach);
            let down = (1.0 - self.bounds.floor[node] / now).min(reach);
            self.rows.at_most([Term { column, value: 1.0 }], up.max(0.0));
            self.rows.at_most([Term { column, value: -1.0 }], down.max(0.0));
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
                self.rows.at_most(terms, (1.0 - sign * rise).max(0.0));
            }
        }
    }

    fn keep_drive(&mut self) {
        let (min, max) = self.bounds.drive.range();
        let span = self.horizon.drive_span;
        let most = self.bounds.drive.rate_per_s() * KNOT_S / span;
        let first = self.places.len() - self.choice.knots.len();
        let mut before = self.horizon.extruder.command();
        for (column, now) in (first..).zip(&self.choice.knots) {
            self.rows.at_most([Term { column, value: 1.0 }], (max - now) / span);
            self.rows.at_most([Term { column, value: -1.0 }], (now - min) / span);
            let rise = (now - before) / span;
            for sign in [1.0, -1.0] {
                let last = (column > first).then(|| Term { column: column - 1, value: -sign });
                let terms = [Term { column, value: sign }].into_iter().chain(last);
                self.rows.at_most(terms, (most - sign * rise).max(0.0));
            }
            before = *now;
        }
    }

    fn keep_time(&mut self, outcome: &Outcome) {
        let slope = Clock::new(&outcome.profile).to_end();
        let left = self.bounds.longest_s - outcome.profile.duration_s();
        let value = |column: usize, node: usize| slope[node] * self.scale[column];
        let terms: Vec<_> =
            self.free().map(|(column, node)| Term { column, value: value(column, node) }).collect();
        self.rows.at_most(terms, left.max(0.0));
    }

    fn solve(self, outcome: &Outcome) -> Option<Choice> {
        let Quadratic { hessian, gradient } = self.horizon.model(self.choice, outcome);
        let (places, scale) = (&self.places, &self.scale);
        let size = 1.0 / outcome.cost.max(f64::MIN_POSITIVE);
        let p = DMatrix::from_fn(places.len(), places.len(), |i, j| {
            let ridge = if i == j { RIDGE } else { 0.0 };
            hessian[(places[i], places[j])] * scale[i] * scale[j] * size + ridge
        });
        let scaled = places.iter().zip(scale).map(|(place, scale)| gradient[*place] * scale * size);
        let q = DVector::from_iterator(places.len(), scaled);
        let x = least(&Quadratic { hessian: p, gradient: q }, self.rows)?;
        let nodes = self.choice.squares.len();
        let mut all = vec![0.0; nodes + self.choice.knots.len()];
        for ((place, scale), share) in places.iter().zip(scale).zip(x.iter()) {
            all[*place] = share * scale;
        }
        let knots = all.split_off(nodes);
        Some(Choice { squares: all, knots })
    }
}
