//! Live runs on a virtual clock in which something fails: whether control holds in time, and whether
//! it goes on or stops the robot.

use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use super::bead_figures::{self, BeadFigures, late_rows};
use super::live::BEAD_MM;
use super::plant::{
    BAND_MM, Control, Draw, Execution, LoopCell, Plan, REHEARSED, START_MM, TARGET_MM,
};
use super::steps::{STEP_AFTER_MM, STEP_RATIO};
use super::table::{CaseRow, Quantity, quantile};
use crate::assembly::LoadedCell;
use crate::cell::file::Purpose;
use crate::control::{Hold, State, Step};
use crate::core::{MAX_SILENCE, Mm, RobotMode, Span, Stamp};
use crate::numeric::number::to_f64;
use crate::rehearsal::fault::{Fault, FaultKind};
use crate::rehearsal::{PAUSE, Rehearsal, Rehearsed};
use crate::studies::error::ReproduceError;

/// Length of a bead \[mm\]. Derived: two metres and more after the fault.
const LENGTH_MM: f64 = 3000.0;
/// Duration after which a run is ended \[s\]. Derived: the bead at the slowest speed takes 50 s.
const MAX_DURATION_S: f64 = 60.0;
/// When faults begin, uniform between two times \[s\]. Derived: the bead is in its width by then.
const FROM_S: (f64, f64) = (8.0, 12.0);
/// Largest distance of a step of the flow from the place of the fault \[mm\]. Derived: so far behind the
/// nozzle does the camera of the study's cell still see, with its longest gauge.
const STEP_WITHIN_MM: f64 = 150.0;
/// Length of bead after a fault within which it has its width again \[mm\]. Derived: a hold of some 150 mm
/// until bead that is laid after it is seen, three widths, and what a step of the flow needs then.
const SETTLES_WITHIN_MM: f64 = 500.0;
/// The same where PI control takes over \[mm\]. Derived: twice the 440 mm that it needs from 38.6 to 42 mm,
/// papers.md, "004".
const PI_SETTLES_WITHIN_MM: f64 = 880.0;
/// Length of bead that may be missing at the end \[mm\]. Derived: the way between two reports, of which
/// the last one says that the robot does not print any more.
const LAST_MM: f64 = 3.0;
/// Time within which a report says what has happened \[s\]. Derived: its period, the longest way of it, and
/// 2 ms.
const REPORT_S: f64 = 0.025;
/// Time for which a width is on the way \[s\]. Derived: `latency_ms` of the study's cell.
const WAY_S: f64 = 0.02;
/// Time for which a robot may keep another speed than its setpoint, and hold for it, before it is
/// stopped \[s\]: `docs/src/how-to/run-a-cell.md`, § What the controller does.
const MISMATCH_S: (f64, f64) = (0.5, 2.0);

/// A fault and what has to come of it.
#[derive(Debug, Clone, Copy)]
struct FaultCase {
    name: &'static str,
    kind: FaultKind,
    /// How long it lasts \[s\]; infinite for good.
    lasts_s: f64,
    /// Within which time control has to hold \[s\]; infinite where it need not.
    held_within_s: f64,
    /// Within which time the robot has to be stopped \[s\]; `None` where control has to go on.
    stopped_within_s: Option<f64>,
    /// Length of bead after the fault that is not judged \[mm\].
    settles_within_mm: f64,
}

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = sound_rows(cell, seeds)?;
    for case in cases(cell)? {
        let judged = |seed| Judged::of(cell, &case, seed);
        let runs: Vec<Judged> =
            seeds.clone().into_par_iter().map(judged).collect::<Result<_, _>>()?;
        rows.extend(case.rows(cell, &runs));
    }
    Ok(rows)
}

/// Runs in which nothing fails.
fn sound_rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let plan = Plan::new(cell, Control::Distance)?.long(BEAD_MM);
    let mut plan = plan.laid(Execution::Rehearsed);
    let flow = &mut plan.cell.simulation.flow;
    (flow.step_at_mm, flow.step_ratio) = (START_MM + STEP_AFTER_MM, STEP_RATIO);
    let beads = plan.each(seeds, |trial| BeadFigures::of(cell, trial))?;
    let mut rows = bead_figures::rows(cell, REHEARSED, &beads)?;
    let of_cell: Vec<(LoopCell, BeadFigures)> =
        beads.into_iter().map(|bead| (cell, bead)).collect();
    rows.extend(late_rows(&String::from(cell), REHEARSED, &of_cell));
    Ok(rows)
}

fn cases(cell: LoopCell) -> Result<Vec<FaultCase>, ReproduceError> {
    let run = Plan::new(cell, Control::Distance)?.run;
    let (gap_s, hold_s) = (run.control.max_gap.secs(), run.control.max_hold.secs());
    let (frame_s, tick_s) = (1.0 / cell.vision_hz, 1.0 / cell.link_hz);
    // A missing width is noticed when a setpoint is due; that frames are equal, by a frame.
    let blind_s = gap_s + frame_s + tick_s + WAY_S;
    let frozen_s = gap_s + 2.0 * frame_s + WAY_S;
    let silent_s = MAX_SILENCE.secs() + REPORT_S;
    let stops = |held_s: f64, hold_s: f64| Some(held_s + hold_s + 2.0 * tick_s);
    let case = |name, kind, lasts_s, held_within_s, stopped_within_s| FaultCase {
        name,
        kind,
        lasts_s,
        held_within_s,
        stopped_within_s,
        settles_within_mm: SETTLES_WITHIN_MM,
    };
    let path_stands = FaultCase {
        settles_within_mm: PI_SETTLES_WITHIN_MM,
        ..case("path stands", FaultKind::PathStands, f64::INFINITY, f64::INFINITY, None)
    };
    let (good, never) = (f64::INFINITY, f64::INFINITY);
    let late = FaultKind::CameraLate(Span::from_millis(800));
    let jump = FaultKind::PathShifted(Mm::constant(300.0));
    let behind = FaultKind::ClockBehind(Span::from_millis(5000));
    let slow = FaultKind::RobotSlow(0.8);
    let (mismatch_s, mismatch_hold_s) = MISMATCH_S;
    // Ten frames at 10 Hz and seven at 50 Hz: what an HTTP camera loses when it starts again.
    let lost_s = if cell.is_fast() { 0.15 } else { 1.0 };
    let lost_within_s = if lost_s > gap_s { blind_s } else { never };
    Ok(vec![
        case("camera frozen for 2 s", FaultKind::CameraFrozen, 2.0, frozen_s, None),
        case("camera frozen", FaultKind::CameraFrozen, good, frozen_s, stops(frozen_s, hold_s)),
        case("camera 0.8 s late", late, good, blind_s, stops(blind_s, hold_s)),
        case("camera silent for a moment", FaultKind::CameraSilent, lost_s, lost_within_s, None),
        case("camera silent", FaultKind::CameraSilent, good, blind_s, stops(blind_s, hold_s)),
        case("camera fails", FaultKind::CameraFails, good, tick_s, stops(tick_s, hold_s)),
        case("path jumps by 300 mm", jump, good, REPORT_S, None),
        path_stands,
        case("robot clock stands", FaultKind::ClockStands, good, silent_s, stops(silent_s, hold_s)),
        case("robot clock 5 s behind", behind, good, silent_s, stops(silent_s, hold_s)),
        case("robot silent for 0.25 s", FaultKind::RobotMute, 0.25, never, None),
        case("robot silent for 1 s", FaultKind::RobotMute, 1.0, silent_s, None),
        case("robot unplugged for 0.7 s", FaultKind::RobotUnplugged, 0.7, silent_s, None),
        case("robot at 80 % of its setpoint", slow, good, mismatch_s + 3.0 * REPORT_S, {
            stops(mismatch_s, mismatch_hold_s)
        }),
        case("disk full", FaultKind::DiskFull, good, never, Some(tick_s)),
    ])
}

/// The rows of a cell whose extruder is commanded.
pub fn extruder_rows(seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let text = include_str!("../../../cells/extruder-pressure.toml").to_owned();
    let loaded = LoadedCell::from_text(Path::new("extruder-pressure.toml"), text, Purpose::Run)?;
    let run = loaded.cell.run.as_ref().ok_or(ReproduceError::NoRun)?;
    let part = run.extruder.as_ref().ok_or(ReproduceError::NoRun)?;
    let valid_s = 1e-3 * to_f64(part.extruder.valid_ms);
    let held_within_s = valid_s + 1.0 / part.extruder.rates.feedforward_hz + REPORT_S;
    let stopped_within_s = held_within_s + part.extruder.max_hold.secs() + 2.0 / run.robot.rate_hz;
    let mut rows = Vec::new();
    for (name, kind) in
        [("pump fails", FaultKind::PumpFails), ("extruder unplugged", FaultKind::ExtruderUnplugged)]
    {
        let stopped_within_s = Some(stopped_within_s);
        let lasts_s = f64::INFINITY;
        let settles_within_mm = SETTLES_WITHIN_MM;
        let case =
            FaultCase { name, kind, lasts_s, held_within_s, stopped_within_s, settles_within_mm };
        let judged = |seed| {
            let mut cell = loaded.cell.clone();
            cell.simulation.seed = seed + 1;
            let from_s = Draw { stream: FAULT_STREAM, seed }.between(0, FROM_S.0, FROM_S.1);
            let fault = case.fault(from_s);
            let run = Rehearsal {
                cell: &cell,
                run,
                assumed_run: run,
                calibration: &loaded.calibration,
                extruder: loaded.simulated_extruder()?.map(|side| side.extruder),
                faults: vec![fault],
                duration: Span::from_secs(MAX_DURATION_S),
            };
            Ok(Judged::judge(&run.run()?, &fault, &case))
        };
        let runs: Vec<Judged> =
            seeds.clone().into_par_iter().map(judged).collect::<Result<_, ReproduceError>>()?;
        rows.extend(case.rows("extruder-pressure.toml", &runs));
    }
    Ok(rows)
}

impl FaultCase {
    /// The fault, from a time on \[s\].
    fn fault(&self, from_s: f64) -> Fault {
        let until_s = (from_s + self.lasts_s).min(2.0 * MAX_DURATION_S);
        let (from, until) = (Stamp::from_secs(from_s), Stamp::from_secs(until_s));
        Fault { kind: self.kind, from, until }
    }

    fn rows(&self, cell: impl Into<String>, runs: &[Judged]) -> Vec<CaseRow> {
        let (case, cell) = (Execution::Rehearsed.case(self.name), cell.into());
        let row = |quantity, value, required| {
            CaseRow::new(cell.clone(), &case, quantity, runs.len(), value, required)
        };
        let fraction = |fails: &dyn Fn(&Judged) -> bool| {
            to_f64(runs.iter().filter(|one| fails(one)).count()) / to_f64(runs.len())
        };
        let mut rows = Vec::new();
        if self.held_within_s.is_finite() {
            let held: Vec<f64> = runs.iter().map(|one| one.held_s).collect();
            let late = fraction(&|one| one.held_s > self.held_within_s);
            let largest = Quantity::new("held after, longest", "s");
            rows.push(row(Quantity::ratio("fraction not held in time"), late, 0.01));
            rows.push(row(largest, quantile(&held, 1.0), f64::INFINITY));
        } else if self.stopped_within_s.is_none() {
            let needless = fraction(&|one| one.held_s.is_finite());
            rows.push(row(Quantity::ratio("fraction held without need"), needless, 0.01));
        }
        rows.push(if let Some(within_s) = self.stopped_within_s {
            let late = fraction(&|one| one.stopped_s > within_s);
            row(Quantity::ratio("fraction not stopped in time"), late, 0.01)
        } else {
            let off = fraction(&|one| one.error_mm > BAND_MM);
            row(Quantity::ratio("fraction not in its width again"), off, 0.05)
        });
        rows
    }
}

/// What came of a run. Times count from the fault.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Judged {
    /// When control first held \[s\].
    held_s: f64,
    /// When the robot was stopped \[s\].
    stopped_s: f64,
    /// Largest error of the bead without its roughness, from where it has to have its width again on
    /// \[mm\]; infinite where the bead was not laid to its end.
    error_mm: f64,
}

impl Judged {
    fn of(cell: LoopCell, case: &FaultCase, seed: u64) -> Result<Self, ReproduceError> {
        let mut plan = Plan::new(cell, Control::Distance)?.long(LENGTH_MM);
        let draw = Draw { stream: FAULT_STREAM, seed };
        let from_s = draw.between(0, FROM_S.0, FROM_S.1);
        let speed = plan.run.robot.start_speed.get();
        let start_mm = plan.run.robot.start_length.get();
        let flow = &mut plan.cell.simulation.flow;
        let place_mm = start_mm + SLOWER * speed * (from_s - PAUSE.secs() - start_mm / speed);
        flow.step_at_mm = place_mm + draw.between(1, -STEP_WITHIN_MM, STEP_WITHIN_MM);
        flow.step_ratio = 1.0 + 0.08 * draw.between(2, 0.0, 1.0);
        let fault = case.fault(from_s);
        let run = plan.rehearse(seed, vec![fault], Span::from_secs(MAX_DURATION_S))?;
        Ok(Self::judge(&run, &fault, case))
    }

    fn judge(run: &Rehearsed, fault: &Fault, case: &FaultCase) -> Self {
        let since = |at: Option<Stamp>| at.map_or(f64::INFINITY, |at| (at - fault.from).secs());
        let holds = |step: &Step| match &step.state {
            State::Holding(why) => *why != Hold::Stopping,
            state => matches!(state, State::Fault(_)),
        };
        let before = run.steps.iter().rev().find(|(at, _, _)| *at < fault.from);
        let held = run.steps.iter().find(|(at, _, step)| *at >= fault.from && holds(step));
        // A hold of before says nothing about the fault.
        let held = held.filter(|_| before.is_some_and(|(_, _, step)| !holds(step)));
        let stopped =
            run.robot.iter().find(|(at, state)| *at >= fault.from && state.mode == RobotMode::Stop);
        Self {
            held_s: since(held.map(|one| one.0)),
            stopped_s: since(stopped.map(|one| one.0)),
            error_mm: error_after_mm(run, fault, case.settles_within_mm),
        }
    }
}

/// Largest error of a bead from some way after a fault on; one that stays counts from its beginning.
fn error_after_mm(run: &Rehearsed, fault: &Fault, settles_within_mm: f64) -> f64 {
    let last = run.robot.last().map_or(Stamp::START, |one| one.0);
    let over = if fault.until < last { fault.until } else { fault.from };
    let place = run.robot.iter().find(|(at, _)| *at >= over).map(|(_, state)| state.path_mm.get());
    let (Some(place_mm), Some(end_mm)) = (place, run.bead.end_mm()) else { return f64::INFINITY };
    if end_mm < LENGTH_MM - LAST_MM {
        return f64::INFINITY;
    }
    let (mut at, mut worst) = (place_mm + settles_within_mm, 0.0_f64);
    while at < end_mm {
        let error = run.bead.smooth_width_at(at).map_or(f64::INFINITY, |width| width - TARGET_MM);
        worst = worst.max(error.abs());
        at += 1.0;
    }
    worst
}

/// Speed for 42 mm over that for 38.6. Derived: papers.md, "004", table 2.
const SLOWER: f64 = 0.69;
/// Random stream of the draws. Derived: the bytes of "fault".
const FAULT_STREAM: u64 = 0x0066_6175_6c74;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// Taken for a speed that changes once, what the robot did in the meantime swung the width by 5 mm
    /// afterwards.
    #[test]
    fn after_a_silent_link_the_bead_keeps_its_width() {
        let kind = FaultKind::RobotMute;
        for cell in LoopCell::ALL {
            let plan = Plan::new(cell, Control::Distance).unwrap().long(LENGTH_MM);
            for (seed, lasts_s) in [(0_u32, 0.7), (1, 0.7), (2, 1.0), (3, 1.0)] {
                let from = Stamp::from_secs(10.0 + 0.037 * f64::from(seed));
                let fault = Fault { kind, from, until: from + Span::from_secs(lasts_s) };
                let duration = Span::from_secs(MAX_DURATION_S);
                let run = plan.rehearse(seed.into(), vec![fault], duration).unwrap();
                // Until then the robot may keep its hold speed: it has no valid setpoint.
                let error_mm = error_after_mm(&run, &fault, 30.0);
                assert!(error_mm < BAND_MM, "{cell:?}, {lasts_s} s, seed {seed}: {error_mm}");
            }
        }
    }
}
