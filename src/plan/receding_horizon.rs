//! A job of any length, planned a few seconds at a time (receding horizon).

use super::descent::descend;
use super::flow::{FlowModel, KNOT_S, KnotResponses, whole};
use super::grid::QuickChanges;
use super::horizon::{Evaluation, Horizon, Iterate};
use super::limits::limit_acceleration;
use super::profile::{ProfileNode, SpeedProfile};
use super::segment::PathSegment;
use super::subproblem::Bounds;
use super::task::{PlanError, PlanTask};
use crate::numeric::number::to_f64;

/// Length of a horizon at the nominal speed \[s\].
const HORIZON_S: f64 = 5.0;
/// Time after the last quick change in it by which a horizon is extended \[s\]: the flow recovers in
/// about that time.
const RECOVERY_S: f64 = 3.0;
/// Latest begin of the horizon before a quick change \[s\]: the flow needs about that time to follow.
const LEAD_S: f64 = 2.5;
/// Time at the end of a horizon that is not decided \[s\]: its plan ignores what comes later.
const TAIL_S: f64 = 1.5;
/// Lengths of the nozzle at the end of a horizon over which the speed is the nominal one: otherwise a
/// flow that never recovers would be the optimum.
const PINNED_LENGTHS: f64 = 2.0;

/// The state of planning a job.
pub struct RecedingHorizon<'a> {
    task: &'a PlanTask<'a>,
    nominal: &'a SpeedProfile,
    quick: QuickChanges,
    /// Positions of minima of the nominal speed \[mm\], each of which may add time.
    slow_positions: Vec<f64>,
    extruder: FlowModel,
    /// Decided nodes.
    nodes: Vec<ProfileNode>,
    /// Time at which each is passed \[s\].
    times: Vec<f64>,
    knots: Vec<f64>,
}

impl<'a> RecedingHorizon<'a> {
    /// From the steady state of a command.
    pub fn new(
        task: &'a PlanTask<'a>,
        nominal: &'a SpeedProfile,
        start: f64,
    ) -> Result<Self, PlanError> {
        let first = nominal.pieces().next().map(|(first, _)| first);
        Ok(Self {
            task,
            nominal,
            quick: QuickChanges::of(nominal, task.limits.robot.accel_mm_per_s2),
            slow_positions: slow_positions(nominal),
            extruder: FlowModel::settled(task.extruder, start)?,
            nodes: first.into_iter().collect(),
            times: vec![0.0],
            knots: Vec::new(),
        })
    }

    /// Speed and knots of the whole job.
    pub fn plan(mut self) -> Result<(SpeedProfile, Vec<f64>), PlanError> {
        let end = self.nominal.end_mm();
        loop {
            let here = self.here();
            if here >= end {
                break;
            }
            let to = self.horizon_end(here);
            let until = if to >= end { end } else { self.commit_position(here, to) };
            self.horizon(to, until)?;
        }
        let (path, squares) = self.nodes.iter().map(|node| (node.path_mm, node.square)).unzip();
        Ok((SpeedProfile::of_squares(path, squares)?, self.knots))
    }

    fn here(&self) -> f64 {
        self.nodes.last().map_or(self.nominal.start_mm(), |node| node.path_mm)
    }

    /// The position that the nominal speed reaches after a time \[mm\].
    fn later(&self, position_mm: f64, by_s: f64) -> f64 {
        let at = self.nominal.time_at(position_mm) + by_s;
        if at >= self.nominal.duration_s() {
            return self.nominal.end_mm();
        }
        self.nominal.path_at(at.max(0.0))
    }

    fn horizon_end(&self, here: f64) -> f64 {
        let to = self.later(here, HORIZON_S);
        let quick = self.quick.within(PathSegment { from_mm: here, to_mm: to }).last();
        let to = quick.map_or(to, |quick| to.max(self.later(quick.to_mm, RECOVERY_S)));
        // A short rest of the job belongs to this horizon.
        if self.later(to, HORIZON_S - LEAD_S) >= self.nominal.end_mm() {
            self.nominal.end_mm()
        } else {
            to
        }
    }

    /// Begin of the next horizon: as far from all quick changes as possible.
    fn commit_position(&self, here: f64, to: f64) -> f64 {
        let first = self.later(here, HORIZON_S - LEAD_S);
        let unseen = self.quick.within(PathSegment { from_mm: to, to_mm: f64::INFINITY }).next();
        let unseen = unseen.map_or(to, |quick| self.later(quick.from_mm, -LEAD_S));
        let last = self.later(to, -TAIL_S).min(unseen).max(first);
        let positions = (0..=50).map(|k| first + (last - first) * f64::from(k) / 50.0);
        let far = positions.map(|at| (at, self.quick.distance(at)));
        far.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(first, |(at, _)| at)
    }

    /// Plans to one position and decides up to another.
    fn horizon(&mut self, to: f64, until: f64) -> Result<(), PlanError> {
        let here = self.here();
        let back = here - self.task.bead.nozzle_mm - 1e-9;
        let kept = self.nodes.partition_point(|node| node.path_mm < back).saturating_sub(1);
        let from_s = self.times.get(kept).copied().unwrap_or(0.0);
        let mut path: Vec<f64> = self.nodes.iter().skip(kept).map(|node| node.path_mm).collect();
        let mut squares: Vec<f64> = self.nodes.iter().skip(kept).map(|node| node.square).collect();
        let decided = path.len();
        let open = PathSegment { from_mm: here, to_mm: to };
        let ahead = self.quick.nodes(self.nominal, open, self.task.bead.nozzle_mm);
        path.extend(ahead.iter().skip(1));
        squares.extend(ahead.iter().skip(1).map(|s| self.nominal.square_at(*s)));
        let bounds = self.bounds(&path, squares, decided, from_s, to);
        let count = whole((from_s + bounds.longest_s - self.extruder.now_s()) / KNOT_S) + 1;
        let responses = KnotResponses::new(self.task.extruder, count)?;
        let first = Iterate {
            squares: bounds.ceiling.clone(),
            knots: vec![self.extruder.command(); count],
        };
        let span = PathSegment { from_mm: path.first().copied().unwrap_or(here), to_mm: to };
        let (min, max) = self.task.limits.drive.range();
        let horizon = Horizon {
            bead: self.task.bead,
            unmodelled: self.task.unmodelled,
            drive_span: max - min,
            windows: self.quick.windows(span, &self.task.bead),
            change_segments: self.quick.change_segments(span, self.task.bead.nozzle_mm),
            path,
            from_s,
            extruder: &self.extruder,
            knot_responses: &responses,
        };
        if let Some((iterate, evaluation)) = descend(&horizon, &bounds, first) {
            self.decide(&iterate, &evaluation, from_s, decided, until);
        }
        Ok(())
    }

    fn bounds(
        &self,
        path: &[f64],
        mut ceiling: Vec<f64>,
        decided: usize,
        from_s: f64,
        to: f64,
    ) -> Bounds {
        let limits = &self.task.limits;
        let accel = limits.robot.accel_mm_per_s2;
        limit_acceleration(path, &mut ceiling, accel);
        let slowest = limits.robot.slowest_mm_per_s.powi(2);
        let pinned = to - PINNED_LENGTHS * self.task.bead.nozzle_mm;
        let floor = path.iter().zip(&ceiling).enumerate().map(|(i, (s, high))| {
            if i < decided || *s >= pinned { *high } else { slowest.min(*high) }
        });
        // Each minimum up to here may add its time; unused time carries over.
        let positions = self.slow_positions.iter().filter(|s| **s <= to).count();
        let latest = self.nominal.time_at(to) + limits.budget_s * to_f64(positions);
        let floor = floor.collect();
        let longest_s = latest - from_s;
        Bounds { floor, ceiling, accel, drive: limits.drive, longest_s }
    }

    /// Decides the plan of a horizon that begins at `from_s` with `decided` nodes, up to the begin of
    /// the next one \[mm\].
    fn decide(
        &mut self,
        iterate: &Iterate,
        evaluation: &Evaluation,
        from_s: f64,
        decided: usize,
        until_mm: f64,
    ) {
        let nodes =
            evaluation.profile.path().iter().zip(&iterate.squares).zip(evaluation.profile.times());
        for ((s, b), time) in nodes.skip(decided) {
            self.nodes.push(ProfileNode { path_mm: *s, square: *b });
            self.times.push(from_s + time);
            if *s >= until_mm {
                break;
            }
        }
        let reached = self.times.last().copied().unwrap_or(from_s);
        let open = (reached - self.extruder.now_s()) / KNOT_S;
        // At the end of the job a part of a knot counts as one.
        let count = if self.here() >= self.nominal.end_mm() { open.ceil() } else { open };
        let knots: Vec<f64> = iterate.knots.iter().copied().take(whole(count)).collect();
        self.extruder.advance(&knots);
        let back = self.here() - 2.0 * self.task.bead.nozzle_mm;
        let kept = self.nodes.partition_point(|node| node.path_mm < back).saturating_sub(1);
        self.extruder.discard_before(self.times.get(kept).copied().unwrap_or(0.0));
        self.knots.extend(knots);
    }
}

/// Positions of the minima of a profile \[mm\], its ends included.
fn slow_positions(profile: &SpeedProfile) -> Vec<f64> {
    let mut all = Vec::new();
    let mut falling = true;
    for (from, to) in profile.pieces() {
        if to.square > from.square && falling {
            all.push(from.path_mm);
        }
        if to.square != from.square {
            falling = to.square < from.square;
        }
    }
    if falling && profile.pieces().any(|(from, to)| to.square < from.square) {
        all.push(profile.end_mm());
    }
    all
}
