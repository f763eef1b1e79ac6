//! A job of any length, planned a few seconds at a time (receding horizon).

use super::descent::descend;
use super::flow::{FlowModel, KNOT_S, KnotResponses, float, whole};
use super::grid::QuickChanges;
use super::horizon::{Evaluation, Horizon, Iterate};
use super::limits::limit_acceleration;
use super::profile::{ProfileNode, SpeedProfile};
use super::segment::PathSegment;
use super::subproblem::Bounds;
use super::task::{PlanError, PlanTask};

/// How far ahead a horizon reaches at the nominal speed \[s\]; beyond a quick change within
/// it, it goes on for as long as the flow may take to come back.
const HORIZON_S: f64 = 5.0;
const RECOVERY_S: f64 = 3.0;
/// How long before a quick change its plan begins at the latest, and how long after it the
/// next horizon may begin at the earliest \[s\].
const LEAD_S: f64 = 2.5;
const TAIL_S: f64 = 1.5;
/// At the end of a horizon the speed is the nominal one again, over this many lengths of
/// the nozzle: otherwise a flow that never comes back would look best.
const PINNED_LENGTHS: f64 = 2.0;

/// A job while it is planned.
pub struct RecedingHorizon<'a> {
    task: &'a PlanTask<'a>,
    nominal: &'a SpeedProfile,
    quick: QuickChanges,
    /// Places at which the nominal speed turns upwards \[mm\], which may take time each.
    slow_positions: Vec<f64>,
    extruder: FlowModel,
    /// Nodes that are decided.
    nodes: Vec<ProfileNode>,
    /// When each is passed \[s\].
    times: Vec<f64>,
    knots: Vec<f64>,
}

/// What of a horizon is to be decided.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OpenHorizon {
    /// When its first node is passed \[s\].
    from_s: f64,
    /// Nodes that were decided before.
    decided: usize,
    /// To where it is decided \[mm\].
    until_mm: f64,
}

impl<'a> RecedingHorizon<'a> {
    /// From an extruder that has settled at a command.
    pub fn new(
        task: &'a PlanTask<'a>,
        nominal: &'a SpeedProfile,
        start: f64,
    ) -> Result<Self, PlanError> {
        let first = nominal.path().first().zip(nominal.squares().first());
        Ok(Self {
            task,
            nominal,
            quick: QuickChanges::of(nominal, task.limits.robot.accel_mm_per_s2),
            slow_positions: slow_positions(nominal),
            extruder: FlowModel::settled(task.extruder, start)?,
            nodes: first
                .map(|(s, b)| ProfileNode { path_mm: *s, square: *b })
                .into_iter()
                .collect(),
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
        Ok((SpeedProfile::of_squares(&self.nodes)?, self.knots))
    }

    fn here(&self) -> f64 {
        self.nodes.last().map_or(self.nominal.start_mm(), |node| node.path_mm)
    }

    /// The place that the nominal speed reaches after a time \[mm\].
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
        // A rest shorter than that is planned at once.
        if self.later(to, HORIZON_S - LEAD_S) >= self.nominal.end_mm() {
            self.nominal.end_mm()
        } else {
            to
        }
    }

    /// Where the next horizon begins: as far from all quick changes as can be.
    fn commit_position(&self, here: f64, to: f64) -> f64 {
        let first = self.later(here, HORIZON_S - LEAD_S);
        let unseen = self.quick.within(PathSegment { from_mm: to, to_mm: f64::INFINITY }).next();
        let unseen = unseen.map_or(to, |quick| self.later(quick.from_mm, -LEAD_S));
        let last = self.later(to, -TAIL_S).min(unseen).max(first);
        let positions = (0..=50).map(|k| first + (last - first) * f64::from(k) / 50.0);
        let far = positions.map(|at| (at, self.quick.distance(at)));
        far.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(first, |(at, _)| at)
    }

    /// Plans to one place and decides up to another.
    fn horizon(&mut self, to: f64, until: f64) -> Result<(), PlanError> {
        let here = self.here();
        let back = here - self.task.bead.nozzle_mm - 1e-9;
        let kept = self.nodes.partition_point(|node| node.path_mm < back).saturating_sub(1);
        let from_s = self.times.get(kept).copied().unwrap_or(0.0);
        let mut path: Vec<f64> = self.nodes.iter().skip(kept).map(|node| node.path_mm).collect();
        let mut squares: Vec<f64> = self.nodes.iter().skip(kept).map(|node| node.square).collect();
        let decided = path.len();
        let ahead = self.quick.nodes(
            self.nominal,
            PathSegment { from_mm: here, to_mm: to },
            self.task.bead.nozzle_mm,
        );
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
        let found = descend(&horizon, &bounds, first);
        if let Some((iterate, outcome)) = found {
            self.decide(&iterate, &outcome, OpenHorizon { from_s, decided, until_mm: until });
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
        // All slow-downs up to here may take their time, and what was not taken before.
        let positions = self.slow_positions.iter().filter(|s| **s <= to).count();
        let latest = self.nominal.time_at(to) + limits.budget_s * float(positions);
        let floor = floor.collect();
        let longest_s = latest - from_s;
        Bounds { floor, ceiling, accel, drive: limits.drive, longest_s }
    }

    /// Keeps what is planned up to where the next horizon begins.
    fn decide(&mut self, iterate: &Iterate, outcome: &Evaluation, open: OpenHorizon) {
        let OpenHorizon { from_s, decided, until_mm } = open;
        let nodes =
            outcome.profile.path().iter().zip(&iterate.squares).zip(outcome.profile.times());
        for ((s, b), time) in nodes.skip(decided) {
            self.nodes.push(ProfileNode { path_mm: *s, square: *b });
            self.times.push(from_s + time);
            if *s >= until_mm {
                break;
            }
        }
        let reached = self.times.last().copied().unwrap_or(from_s);
        let open = (reached - self.extruder.now_s()) / KNOT_S;
        // At the end of the job the last part of a knot counts as well.
        let count = if self.here() >= self.nominal.end_mm() { open.ceil() } else { open };
        let knots: Vec<f64> = iterate.knots.iter().copied().take(whole(count)).collect();
        self.extruder.advance(&knots);
        let back = self.here() - 2.0 * self.task.bead.nozzle_mm;
        let kept = self.nodes.partition_point(|node| node.path_mm < back).saturating_sub(1);
        self.extruder.discard_before(self.times.get(kept).copied().unwrap_or(0.0));
        self.knots.extend(knots);
    }
}

/// Places at which a profile turns from falling to rising, the ends included where it is
/// lower there \[mm\].
fn slow_positions(profile: &SpeedProfile) -> Vec<f64> {
    let mut all = Vec::new();
    let mut falling = true;
    let nodes = || profile.path().iter().zip(profile.squares());
    for ((s0, b0), (_, b1)) in nodes().zip(nodes().skip(1)) {
        if b1 > b0 && falling {
            all.push(*s0);
        }
        if b1 != b0 {
            falling = b1 < b0;
        }
    }
    let fell = nodes().zip(nodes().skip(1)).any(|((_, b0), (_, b1))| b1 < b0);
    if falling && fell {
        all.push(profile.end_mm());
    }
    all
}
