//! Whether it is noticed that the width does not answer the speed, and whether that is said of beads
//! on which it does.

use std::ops::Range;

use rayon::prelude::*;

use super::laid_length::LaidLength;
use super::plant::{Control, Draw, Execution, LoopCell, Plan, TARGET_MM};
use super::table::{CaseRow, Quantity};
use crate::control::{Command, Event, Hold, State, Step};
use crate::core::{Mm, Stamp};
use crate::scenario::disturbance::Flow;
use crate::scenario::table::OtherBead;
use crate::sim::cell::{FrameObservation, Observer};
use crate::studies::error::ReproduceError;

/// Length of a bead \[mm\].
const LENGTH_MM: f64 = 3000.0;
/// Change of the commanded ln v since the other bead came into view after which the width must have
/// answered.
const COMMANDED: f64 = 0.10;
/// Gauges beyond the offset within which that must be noticed.
const MAX_GAUGES: f64 = 2.0;
/// Standard deviation of an offset that was measured: more than the 1.5 mm by which six trials
/// differ (bcs-thesis, § 3.1.1).
const KNOWN_OFFSET_SIGMA: Mm = Mm::constant(2.0);

/// Trials of one kind.
#[derive(Debug, Clone, Copy)]
struct Trials {
    control: Control,
    execution: Execution,
    /// Whether the cell states how well the camera's offset is known; without it, a tenth of it.
    is_offset_known: bool,
}

impl Trials {
    const DISTANCE: Self = Self {
        control: Control::Distance,
        execution: Execution::Simulated,
        is_offset_known: false,
    };
    const PI: Self = Self { control: Control::Pi, ..Self::DISTANCE };
    const ALL: [Self; 5] = [
        Self::DISTANCE,
        Self::PI,
        Self { execution: Execution::Rehearsed, ..Self::DISTANCE },
        Self { is_offset_known: true, ..Self::DISTANCE },
        Self { is_offset_known: true, ..Self::PI },
    ];

    fn case(self, what: &str) -> String {
        let by = if self.control == Control::Pi { "PI" } else { "distance" };
        let known = if self.is_offset_known { ", offset known" } else { "" };
        self.execution.case(&format!("{what}, by {by}{known}"))
    }

    fn plan(self, cell: LoopCell) -> Result<Plan, ReproduceError> {
        let mut plan = Plan::new(cell, self.control)?.long(LENGTH_MM).laid(self.execution);
        if self.is_offset_known {
            plan.run.camera.offset_sigma = KNOWN_OFFSET_SIGMA;
        }
        Ok(plan)
    }
}

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = Vec::new();
    for trials in Trials::ALL {
        let case = trials.case("another bead in view");
        let faulty = observe(seeds, |seed| Ok(with_other_bead(trials.plan(cell)?, seed)))?;
        rows.extend(fault_rows(cell, &case, &faulty)?);
        let case = trials.case("no fault");
        let sound = observe(seeds, |seed| Ok(disturbed(trials.plan(cell)?, seed)))?;
        let alarms: Vec<CaseRow> = seeds
            .clone()
            .zip(&sound)
            .filter_map(|(seed, one)| alarm_row(cell, &format!("{case}, seed {seed}"), one))
            .collect();
        let lasted_s: f64 = sound.iter().map(|one| one.lasted_s).sum();
        rows.push(CaseRow::false_alarms(cell, &case, sound.len(), alarms.len(), lasted_s));
        rows.extend(alarms);
    }
    Ok(rows)
}

/// Where on a bead without a fault control held, warned or stopped.
fn alarm_row(cell: LoopCell, case: &str, noticed: &Noticed) -> Option<CaseRow> {
    let (what, path_mm) = match (noticed.held_mm, noticed.warned_mm) {
        (Some(path_mm), _) => ("held: no response", path_mm),
        (None, Some(path_mm)) => ("warned: wrong offset", path_mm),
        (None, None) if !noticed.complete => ("stopped", noticed.laid.path_mm),
        (None, None) => return None,
    };
    Some(CaseRow::new(cell, case, Quantity::mm(what), 1, path_mm, f64::INFINITY))
}

fn fault_rows(
    cell: LoopCell,
    case: &str,
    faulty: &[Noticed],
) -> Result<[CaseRow; 2], ReproduceError> {
    let most_mm =
        Plan::new(cell, Control::Distance)?.run.camera.offset.get() + MAX_GAUGES * cell.gauge_mm;
    // Where the speed hardly changes, there is nothing that the width could answer.
    let after: Vec<f64> = faulty.iter().filter_map(|one| one.after_mm(most_mm)).collect();
    Ok(CaseRow::noticed(cell, case, &after, most_mm, "mm"))
}

fn observe(
    seeds: &Range<u64>,
    plan: impl Fn(u64) -> Result<Plan, ReproduceError> + Send + Sync,
) -> Result<Vec<Noticed>, ReproduceError> {
    seeds.clone().into_par_iter().map(|seed| Noticed::on(&plan(seed)?, seed)).collect()
}

/// From somewhere on the camera sees another bead, 1 to 10 mm off target.
fn with_other_bead(mut plan: Plan, seed: u64) -> Plan {
    let draw = Draw { stream: RESPONSE_STREAM, seed };
    let width_mm = TARGET_MM + draw.sign(1) * draw.between(0, 1.0, 10.0);
    let (from, width) = (Mm::new(draw.between(2, 600.0, 1600.0)), Mm::new(width_mm));
    plan.cell.simulation.other_bead =
        from.ok().zip(width.ok()).map(|(from, width)| OtherBead { from, width });
    plan
}

/// A bead on which nothing is wrong: its flow steps, drifts, waves and pulsates.
fn disturbed(mut plan: Plan, seed: u64) -> Plan {
    let draw = Draw { stream: RESPONSE_STREAM, seed };
    plan.cell.simulation.flow = Flow {
        step_at_mm: draw.between(0, 400.0, 2800.0),
        step_ratio: 1.0 + 0.08 * draw.sign(1),
        drift_per_root_m: draw.between(2, 0.0, 0.02),
        wave_amplitude: draw.between(3, 0.0, 0.02),
        wavelength_mm: draw.ratio_between(4, 60.0, 2400.0),
        pulse_amplitude: draw.between(5, 0.0, 0.03),
        pulse_period_s: draw.ratio_between(6, 0.6, 10.0),
        ..Flow::STEADY
    };
    plan
}

/// What was noticed on a bead. Paths count from its beginning.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Noticed {
    laid: LaidLength,
    /// From where on the camera sees another bead; infinite where it never does.
    fault_from_mm: f64,
    /// The last commanded ln v, and the one at the fault.
    ln_speed: Option<f64>,
    ln_speed_at_fault: Option<f64>,
    /// Where it had changed by [`COMMANDED`] since.
    commanded_mm: Option<f64>,
    /// Where control held because the width does not answer.
    held_mm: Option<f64>,
    /// Where the offset was called wrong.
    warned_mm: Option<f64>,
    lasted_s: f64,
    /// Whether the bead was laid to its end.
    complete: bool,
}

impl Noticed {
    fn on(plan: &Plan, seed: u64) -> Result<Self, ReproduceError> {
        let other = plan.cell.simulation.other_bead;
        let fault_from_mm = other.map_or(f64::INFINITY, |other| other.from.get());
        let mut noticed = Self { fault_from_mm, ..Self::default() };
        let end = plan.observe(seed, &mut noticed)?;
        (noticed.lasted_s, noticed.complete) = (end.duration.secs(), end.complete);
        Ok(noticed)
    }

    /// Path from the change of the commanded speed until it was noticed \[mm\]: infinite if it never
    /// was, `None` if the speed hardly changed, or the bead ended before it had to be noticed.
    fn after_mm(&self, within_mm: f64) -> Option<f64> {
        let commanded_mm = self.commanded_mm?;
        let after_mm = |held_mm: f64| held_mm - commanded_mm;
        let is_missed = !self.complete || self.laid.path_mm > commanded_mm + within_mm;
        self.held_mm.map(after_mm).or(is_missed.then_some(f64::INFINITY))
    }
}

impl Observer for Noticed {
    fn step(&mut self, _: Stamp, event: &Event, step: &Step) {
        self.laid.follow(event);
        if let Some(Command::Speed(speed)) = step.command {
            self.ln_speed = Some(speed.get().ln());
        }
        if self.laid.path_mm >= self.fault_from_mm
            && let Some(ln_speed) = self.ln_speed
        {
            let before = *self.ln_speed_at_fault.get_or_insert(ln_speed);
            if (ln_speed - before).abs() >= COMMANDED {
                self.commanded_mm.get_or_insert(self.laid.path_mm);
            }
        }
        if matches!(step.state, State::Holding(Hold::NoResponse(_))) {
            self.held_mm.get_or_insert(self.laid.path_mm);
        }
        if step.trace.wrong_offset.is_some() {
            self.warned_mm.get_or_insert(self.laid.path_mm);
        }
    }

    fn frame(&mut self, _: &FrameObservation<'_>) {}

    fn is_done(&self) -> bool {
        self.held_mm.is_some()
    }
}

/// Random stream of what is drawn. Derived: the bytes of "response".
const RESPONSE_STREAM: u64 = 0x7265_7370_6f6e_7365;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    #[test]
    fn a_bead_that_the_controller_stops_has_no_error_and_never_settles() {
        for execution in Execution::ALL {
            let plan = with_other_bead(Trials::DISTANCE.plan(LoopCell::ALL[1]).unwrap(), 0);
            let trial = plan.laid(execution).lay(0).unwrap();
            assert!(!trial.complete && trial.smooth.len() > 1000, "{execution:?}");
            let settled_mm = trial.smooth_settles_within(trial.control_start_mm, 500.0, 0.5);
            for figure in [settled_mm, trial.rms_error(300.0), trial.smooth_rms_error(300.0)] {
                assert_eq!(figure, f64::INFINITY, "{execution:?}");
            }
        }
    }
}
