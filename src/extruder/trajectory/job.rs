//! The plan of a job, bead by bead.

use std::sync::Arc;

use crate::core::{Mm, Mm3PerS, MmPerS, Span, Unit};

/// Rows that are closer in time are not used for rates \[s\]: the difference of rounded numbers
/// would dominate.
const MIN_ROW_SPACING_S: f64 = 1e-3;

/// A row of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlanRow {
    pub(super) time_s: f64,
    pub(super) path_mm: f64,
    pub(super) speed_mm_per_s: f64,
    pub(super) command: f64,
    pub(super) flow_mm3_per_s: f64,
}

/// A point of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlannedPoint {
    /// Time since the plan of the bead began \[s\].
    pub time_s: f64,
    /// Command of the extruder, in its unit.
    pub command: f64,
    /// Predicted flow.
    pub flow: Mm3PerS,
}

/// The plan of one bead, by path from where the bead begins.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedTrajectory {
    rows: Vec<PlanRow>,
}

/// The plan of a job, bead by bead.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedJob {
    /// Unit of the commands.
    pub unit: Unit,
    beads: Vec<Arc<PlannedTrajectory>>,
}

impl PlannedJob {
    /// From at least one bead, with at least two rows each.
    pub(super) fn new(unit: Unit, beads: Vec<Vec<PlanRow>>) -> Self {
        let trajectory = |rows| Arc::new(PlannedTrajectory { rows });
        Self { unit, beads: beads.into_iter().map(trajectory).collect() }
    }

    /// The plan of the bead with this number, from 0; cyclic.
    pub fn bead(&self, number: usize) -> &Arc<PlannedTrajectory> {
        &self.beads[number % self.beads.len()]
    }

    /// Beads of the job.
    pub fn beads(&self) -> &[Arc<PlannedTrajectory>] {
        &self.beads
    }

    /// Smallest and largest speed \[mm/s\].
    pub fn speeds(&self) -> (f64, f64) {
        self.range(|row| row.speed_mm_per_s)
    }

    /// Smallest and largest command, in its unit.
    pub fn commands(&self) -> (f64, f64) {
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
        let apart = pairs.filter(|(a, b)| b.time_s - a.time_s >= MIN_ROW_SPACING_S);
        apart.map(|(a, b)| (of(b) - of(a)).abs() / (b.time_s - a.time_s)).fold(0.0, f64::max)
    }

    fn range(&self, of: impl Fn(&PlanRow) -> f64) -> (f64, f64) {
        let all = self.beads.iter().flat_map(|bead| &bead.rows).map(of);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    }
}

impl PlannedTrajectory {
    /// Length of the bead.
    pub fn end(&self) -> Mm {
        Mm::new(self.rows.last().map_or(0.0, |row| row.path_mm)).unwrap_or_default()
    }

    /// Flow over speed at the bead's beginning: the planned section \[mm²\].
    pub fn section_mm2(&self) -> f64 {
        self.rows.first().map_or(0.0, |row| row.flow_mm3_per_s / row.speed_mm_per_s)
    }

    /// The planned point at a position; before and after the bead that of its ends.
    pub fn at(&self, path: Mm) -> PlannedPoint {
        let path_mm = path.get();
        let after = self.rows.partition_point(|row| row.path_mm < path_mm);
        let here = interpolate(&self.rows, after, |row| row.path_mm, path_mm);
        let flow = Mm3PerS::new(here.flow_mm3_per_s).unwrap_or_default();
        PlannedPoint { time_s: here.time_s, command: here.command, flow }
    }

    /// Mean speed over a time from a position on.
    pub fn speed(&self, path: Mm, lasts: Span) -> MmPerS {
        let from = path.get().clamp(0.0, self.end().get());
        let until_s = self.at(path).time_s + lasts.secs();
        let after = self.rows.partition_point(|row| row.time_s < until_s);
        let to = interpolate(&self.rows, after, |row| row.time_s, until_s);
        // After the end of the plan the last speed continues.
        let beyond_s = (until_s - to.time_s).max(0.0);
        let length_mm = to.path_mm - from + to.speed_mm_per_s * beyond_s;
        MmPerS::new((length_mm / lasts.secs().max(1e-6)).max(0.0)).unwrap_or_default()
    }
}

/// Linear interpolation to `key(row) == value` between the row with an index and the one before;
/// outside the table its first or last row.
fn interpolate(
    rows: &[PlanRow],
    after: usize,
    key: impl Fn(&PlanRow) -> f64,
    value: f64,
) -> PlanRow {
    let Some(to) = rows.get(after) else { return rows[rows.len() - 1] };
    let Some(from) = after.checked_sub(1).and_then(|at| rows.get(at)) else { return *to };
    let fraction = ((value - key(from)) / (key(to) - key(from))).clamp(0.0, 1.0);
    let mix = |column: fn(&PlanRow) -> f64| column(from) + fraction * (column(to) - column(from));
    PlanRow {
        time_s: mix(|row| row.time_s),
        path_mm: mix(|row| row.path_mm),
        speed_mm_per_s: mix(|row| row.speed_mm_per_s),
        command: mix(|row| row.command),
        flow_mm3_per_s: mix(|row| row.flow_mm3_per_s),
    }
}
