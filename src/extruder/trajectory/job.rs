//! What is planned for a job, bead after bead.

use std::sync::Arc;

use crate::core::quantity::Unit;
use crate::core::time::Span;
use crate::core::units::{Mm, Mm3PerS, MmPerS};

/// Rows nearer to each other tell no rate \[s\].
const MIN_ROW_SPACING_S: f64 = 1e-3;

/// What is planned for one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlanRow {
    pub(super) time_s: f64,
    pub(super) path_mm: f64,
    pub(super) speed_mm_per_s: f64,
    pub(super) command: f64,
    pub(super) flow_mm3_per_s: f64,
}

/// A moment of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedPoint {
    /// Time since the plan of the bead began \[s\].
    pub time_s: f64,
    /// What the extruder is told, in the unit of the command.
    pub command: f64,
    /// Flow that is foretold.
    pub flow: Mm3PerS,
}

/// The plan of one bead. The path is counted from where the bead begins.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedTrajectory {
    rows: Vec<PlanRow>,
}

/// The plan of a job, bead after bead.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedJob {
    /// Unit of the commands.
    pub unit: Unit,
    beads: Vec<Arc<PlannedTrajectory>>,
}

/// The smallest and the largest of something.
pub type Range = (f64, f64);

impl PlannedJob {
    /// Of beads with at least two rows each, at least one of them.
    pub(super) fn new(unit: Unit, beads: Vec<Vec<PlanRow>>) -> Self {
        let course = |rows| Arc::new(PlannedTrajectory { rows });
        Self { unit, beads: beads.into_iter().map(course).collect() }
    }

    /// The plan of the bead with this number, from 0; after the last the first follows.
    pub fn bead(&self, number: usize) -> &Arc<PlannedTrajectory> {
        &self.beads[number % self.beads.len()]
    }

    /// Beads of the job.
    pub fn beads(&self) -> &[Arc<PlannedTrajectory>] {
        &self.beads
    }

    /// Speeds \[mm/s\].
    pub fn speeds(&self) -> Range {
        self.range(|row| row.speed_mm_per_s)
    }

    /// Commands, in their unit.
    pub fn commands(&self) -> Range {
        self.range(|row| row.command)
    }

    /// Largest acceleration, either way \[mm/s²\].
    pub fn steepest_speed(&self) -> f64 {
        self.steepest(|row| row.speed_mm_per_s)
    }

    /// Fastest change of the command, either way, in its unit per second.
    pub fn steepest_command(&self) -> f64 {
        self.steepest(|row| row.command)
    }

    fn steepest(&self, of: impl Fn(&PlanRow) -> f64) -> f64 {
        let pairs =
            self.beads.iter().flat_map(|bead| bead.rows.iter().zip(bead.rows.iter().skip(1)));
        // Rows that lie closer than this are even to what their digits tell.
        let apart = pairs.filter(|(a, b)| b.time_s - a.time_s >= MIN_ROW_SPACING_S);
        apart.map(|(a, b)| (of(b) - of(a)).abs() / (b.time_s - a.time_s)).fold(0.0, f64::max)
    }

    fn range(&self, of: impl Fn(&PlanRow) -> f64) -> Range {
        let all = self.beads.iter().flat_map(|bead| &bead.rows).map(of);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    }
}

impl PlannedTrajectory {
    /// Where the bead ends.
    pub fn end(&self) -> Mm {
        Mm::new(self.rows.last().map_or(0.0, |row| row.path_mm)).unwrap_or_default()
    }

    /// Flow for each speed at the bead's beginning, which is the section that was planned
    /// for \[mm²\].
    pub fn section_mm2(&self) -> f64 {
        self.rows.first().map_or(0.0, |row| row.flow_mm3_per_s / row.speed_mm_per_s)
    }

    /// What is planned for a place; before the bead that of its beginning, after it that
    /// of its end.
    pub fn at(&self, path: Mm) -> PlannedPoint {
        let path_mm = path.get();
        let after = self.rows.partition_point(|row| row.path_mm < path_mm);
        let here = between(&self.rows, after, |row| row.path_mm, path_mm);
        PlannedPoint {
            time_s: here.time_s,
            command: here.command,
            flow: Mm3PerS::new(here.flow_mm3_per_s).unwrap_or_default(),
        }
    }

    /// Mean speed over the time that follows on a place.
    pub fn speed(&self, path: Mm, lasts: Span) -> MmPerS {
        let from = path.get().clamp(0.0, self.end().get());
        let until_s = self.at(path).time_s + lasts.secs();
        let after = self.rows.partition_point(|row| row.time_s < until_s);
        let to = between(&self.rows, after, |row| row.time_s, until_s);
        // Beyond the plan its last speed goes on.
        let beyond_s = (until_s - to.time_s).max(0.0);
        let way_mm = to.path_mm - from + to.speed_mm_per_s * beyond_s;
        MmPerS::new((way_mm / lasts.secs().max(1e-6)).max(0.0)).unwrap_or_default()
    }
}

/// The row at a value between the one before a place of the table and the one there; the
/// first or the last beyond them.
fn between(rows: &[PlanRow], after: usize, of: impl Fn(&PlanRow) -> f64, value: f64) -> PlanRow {
    let Some(to) = rows.get(after) else { return rows[rows.len() - 1] };
    let Some(from) = after.checked_sub(1).and_then(|at| rows.get(at)) else { return *to };
    let fraction = ((value - of(from)) / (of(to) - of(from))).clamp(0.0, 1.0);
    let mix = |of: fn(&PlanRow) -> f64| of(from) + fraction * (of(to) - of(from));
    PlanRow {
        time_s: mix(|row| row.time_s),
        path_mm: mix(|row| row.path_mm),
        speed_mm_per_s: mix(|row| row.speed_mm_per_s),
        command: mix(|row| row.command),
        flow_mm3_per_s: mix(|row| row.flow_mm3_per_s),
    }
}
