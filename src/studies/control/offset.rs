//! Whether it is noticed that the camera's offset is wrong.

use std::ops::Range;

use rayon::prelude::*;

use super::laid_length::LaidLength;
use super::plant::{Control, Draw, Execution, LoopCell, Plan};
use super::table::{CaseRow, Quantity, quantile};
use crate::control::{Command, Event, Step};
use crate::core::Stamp;
use crate::numeric::number::to_f64;
use crate::sim::cell::{FrameObservation, Observer};
use crate::studies::error::ReproduceError;
use crate::width_control::watch::WrongOffset;

/// Length of a bead \[mm\]. Derived: it holds the start, a step of the flow, and the offset behind both.
const LENGTH_MM: f64 = 3000.0;
/// Error of the offset, as a fraction. Derived: two standard deviations of an offset of which the cell
/// states no more.
const ERROR: f64 = 0.2;
/// Change of ln v that shows it. Derived: 2.5 % of the width with the exponent of Shojaei Barjuei et al.
/// 2022, ten times the roughness of a bead.
const CHANGE: f64 = 0.10;
/// Changes after which it must be noticed. Derived: one may be the flow's.
const CHANGES: usize = 2;

/// The rows of a cell. Under PI control the offset is not tested.
pub fn rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = Vec::new();
    for execution in Execution::ALL {
        rows.extend(rows_laid(cell, seeds, execution)?);
    }
    Ok(rows)
}

fn rows_laid(
    cell: LoopCell,
    seeds: &Range<u64>,
    execution: Execution,
) -> Result<[CaseRow; 4], ReproduceError> {
    let all: Vec<Warned> = seeds
        .clone()
        .into_par_iter()
        .map(|seed| Warned::on(&plan(cell, seed)?.laid(execution), seed))
        .collect::<Result<_, ReproduceError>>()?;
    let is_shown = |one: &&Warned| one.is_lost() || one.passed_mm().is_some();
    let shown: Vec<&Warned> = all.iter().filter(is_shown).collect();
    let late = to_f64(shown.iter().filter(|one| one.is_late()).count());
    let stopped = to_f64(all.iter().filter(|one| !one.complete).count());
    let wrong_side = to_f64(all.iter().filter(|one| one.names_wrong_side()).count());
    let after: Vec<f64> = shown.iter().map(|one| one.after_mm()).collect();
    let row = |beads, quantity, value, required| {
        let case = execution.case("offset 20 % wrong");
        CaseRow::new(cell, &case, quantity, beads, value, required)
    };
    let noticed = Quantity::mm("noticed after the first change, median");
    let (of_shown, of_all) = (to_f64(shown.len()), to_f64(all.len()));
    Ok([
        row(shown.len(), Quantity::ratio("fraction not noticed in time"), late / of_shown, 0.05),
        row(
            all.len(),
            Quantity::ratio("fraction that names the wrong side"),
            wrong_side / of_all,
            0.01,
        ),
        row(shown.len(), noticed, quantile(&after, 0.5), f64::INFINITY),
        row(all.len(), Quantity::ratio("fraction stopped"), stopped / of_all, 0.01),
    ])
}

/// The controller looks in the wrong place, and the flow steps.
fn plan(cell: LoopCell, seed: u64) -> Result<Plan, ReproduceError> {
    let mut plan = Plan::new(cell, Control::Distance)?.long(LENGTH_MM);
    let draw = Draw { stream: OFFSET_STREAM, seed };
    plan.assumed_offset = 1.0 + ERROR * draw.sign(0);
    let flow = &mut plan.cell.simulation.flow;
    flow.step_at_mm = draw.between(1, 800.0, 2000.0);
    flow.step_ratio = 1.0 + 0.08 * draw.sign(2);
    Ok(plan)
}

/// When it was noticed. Paths count from the beginning of the bead \[mm\].
#[derive(Debug, Clone, PartialEq)]
struct Warned {
    offset_mm: f64,
    /// Path beyond the offset within which a change is seen.
    seen_within_mm: f64,
    laid: LaidLength,
    /// The commanded ln v at the last change.
    ln_speed: f64,
    /// Where ln v had changed by [`CHANGE`], apart from changes that are seen together.
    changes_mm: Vec<f64>,
    noticed_mm: Option<f64>,
    /// The first offset that was found, and the stated one.
    found: Option<WrongOffset>,
    /// Whether the bead was laid to its end.
    complete: bool,
}

impl Warned {
    fn on(plan: &Plan, seed: u64) -> Result<Self, ReproduceError> {
        let offset_mm = plan.run.camera.offset.get();
        let seen_within_mm = ERROR * offset_mm + 2.0 * plan.cell.simulation.gauge_length.get();
        let mut warned = Self {
            offset_mm,
            seen_within_mm,
            laid: LaidLength::default(),
            ln_speed: plan.run.robot.start_speed.get().ln(),
            changes_mm: Vec::new(),
            noticed_mm: None,
            found: None,
            complete: false,
        };
        warned.complete = plan.observe(seed, &mut warned)?.complete;
        Ok(warned)
    }

    /// Where the nozzle was when the last change that must show the error had been seen whole \[mm\].
    fn passed_mm(&self) -> Option<f64> {
        let last = self.changes_mm.get(CHANGES - 1)?;
        Some(last + self.offset_mm + self.seen_within_mm).filter(|passed| *passed < LENGTH_MM)
    }

    /// Whether it was stopped before anything was noticed.
    fn is_lost(&self) -> bool {
        !self.complete && self.noticed_mm.is_none()
    }

    fn is_late(&self) -> bool {
        self.is_lost() || self.passed_mm() < self.noticed_mm.or(Some(f64::INFINITY))
    }

    /// Whether the offset that was found lies on the wrong side of the stated one.
    fn names_wrong_side(&self) -> bool {
        self.found.is_some_and(|WrongOffset { found_mm, stated_mm }| {
            (found_mm > stated_mm) != (self.offset_mm > stated_mm.get())
        })
    }

    /// Path from the first change until it was noticed \[mm\]; infinite if it never was.
    fn after_mm(&self) -> f64 {
        let first = self.changes_mm.first().copied().unwrap_or_default();
        self.noticed_mm.map_or(f64::INFINITY, |noticed| noticed - first)
    }
}

impl Observer for Warned {
    fn step(&mut self, _: Stamp, event: &Event, step: &Step) {
        self.laid.follow(event);
        if let Some(Command::Speed(speed)) = step.command {
            let ln_speed = speed.get().ln();
            let apart = self
                .changes_mm
                .last()
                .is_none_or(|last| self.laid.path_mm - last > self.seen_within_mm);
            if (ln_speed - self.ln_speed).abs() >= CHANGE {
                self.ln_speed = ln_speed;
                if apart {
                    self.changes_mm.push(self.laid.path_mm);
                }
            }
        }
        if let Some(found) = step.trace.wrong_offset {
            self.noticed_mm.get_or_insert(self.laid.path_mm);
            self.found.get_or_insert(found);
        }
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}
}

/// Random stream of what is drawn. Derived: the bytes of "offset".
const OFFSET_STREAM: u64 = 0x6f66_6673_6574;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn a_live_run_with_a_wrong_offset_finds_the_one_of_its_camera() {
        let cell = LoopCell::ALL[1];
        for factor in [0.8, 1.2] {
            let mut plan = plan(cell, 0).unwrap().laid(Execution::Rehearsed);
            plan.assumed_offset = factor;
            let warned = Warned::on(&plan, 0).unwrap();
            let WrongOffset { found_mm, stated_mm } = warned.found.unwrap();
            let camera_mm = plan.run.camera.offset.get();
            assert!((stated_mm.get() - factor * camera_mm).abs() < 1e-9, "{stated_mm:?}");
            assert!((found_mm.get() - camera_mm).abs() < 8.0, "{factor}: {found_mm:?}");
        }
    }

    /// The answer to a step of the flow comes a quarter of the stated offset later.
    #[test]
    fn a_bead_whose_camera_is_a_quarter_farther_back_than_stated_is_laid_to_its_end() {
        for (cell, seed) in [(0, 10), (0, 11), (0, 20), (1, 2), (1, 9), (1, 10)] {
            let plan = plan(LoopCell::ALL[cell], seed).unwrap().laid(Execution::Rehearsed);
            let warned = Warned::on(&plan, seed).unwrap();
            assert!(warned.complete && warned.found.is_some(), "cell {cell}, {seed}: {warned:?}");
        }
    }
}
