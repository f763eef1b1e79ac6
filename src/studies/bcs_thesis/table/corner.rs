//! The 90° corner, for which the thesis leaves the coordination of robot and extruder open: both
//! planned together, compared with an extruder without a plan.

use rayon::prelude::*;

use super::draw;
use crate::plan::Plan;
use crate::studies::bcs_thesis::corner::{
    Baseline, BudgetRow, CornerError, CornerRun, DriveMode, Errors, JUDGED_MM, Scenario, UNMODELLED,
};
use crate::studies::error::ReproduceError;
use crate::studies::study::{Effort, Section, TableRows};

/// Seeds of the unmodelled flow.
pub const SEEDS: u64 = 20;
/// Largest times that the plan may add \[s\]; the table has the results of the last one.
const BUDGETS_S: [f64; 8] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0];
/// With fewer seeds than this the corner is planned for [`QUICK_S`] only.
const QUICK_SEEDS: u64 = 10;
/// Largest added times with few seeds \[s\].
const QUICK_S: [f64; 4] = [0.0, 0.2, 0.5, 1.0];

const CASE: &str = "90° corner, at most 1 s added";
const STRAIGHT_LEVEL: &str = "90° corner, level that suits the straight";
const BEST_LEVEL: &str = "90° corner, level of the least error within ±100 mm";
/// The plan is for the mean over the nozzle's length; these rows average the same runs over other
/// lengths \[mm\].
const OTHER_LENGTHS: &str = "90° corner, planned for 20 mm, without noise";
const LENGTHS: [(f64, &str); 5] = [
    (10.0, "width error RMS, mean over 10 mm"),
    (15.0, "width error RMS, mean over 15 mm"),
    (20.0, "width error RMS, mean over 20 mm"),
    (25.0, "width error RMS, mean over 25 mm"),
    (30.0, "width error RMS, mean over 30 mm"),
];

/// Plans and runs the corner for every added time; the rows are those of the longest.
pub fn corner(effort: Effort, rows: &mut TableRows) -> Result<Section, ReproduceError> {
    let seeds = effort.seeds.unwrap_or(SEEDS);
    let budgets: &[f64] = if seeds < QUICK_SEEDS { &QUICK_S } else { &BUDGETS_S };
    let scenario = Scenario::default();
    let found: Result<Vec<BudgetRow>, CornerError> =
        budgets.par_iter().map(|budget_s| scenario.row(*budget_s, seeds)).collect();
    let found = found?;
    let Some(last) = found.last() else { return Err(ReproduceError::NoRun) };
    let plan = scenario.plan(last.budget_s, UNMODELLED)?;
    push(last, rows);
    // A harder comparison: each baseline at the voltage level of its own least error here.
    for baseline in Baseline::ALL {
        let errors = baseline.run_at_best_level(&scenario, &plan.speed)?.errors(seeds);
        push_one(BEST_LEVEL, baseline, errors, last.planned, rows);
    }
    let runs = runs(&scenario, &plan)?;
    for (length_mm, quantity) in LENGTHS {
        let [theirs, _, ours] = runs.each_ref().map(|run| 100.0 * run.quiet_over(length_mm).rms());
        rows.compare(OTHER_LENGTHS, (quantity, "%"), theirs, ours);
    }
    let heading = "A 90° corner, robot and extruder planned together";
    Ok(Section::new(heading, hint(last, seeds), draw::corner(&found, &runs)))
}

fn hint(last: &BudgetRow, seeds: u64) -> String {
    format!(
        "100 mm/s, 2 mm/s at the apex, 2 m/s², the thesis' G1 and G2 from 0 to 10 V, nozzle of \
         20 mm; errors of the width are root mean squares within ±{JUDGED_MM:.0} mm of the corner \
         over {seeds} seeds, with {:.0} % of the flow's change that no model tells. A baseline is \
         the better of its own and the planned speed. The bound is the plan for a flow that is \
         fully known, against the constant extruder: what drive, plant and acceleration leave. \
         Of 1 s the plan takes {:.2} s. Runs over path are drawn without noise. What the apex lays \
         too much, the plan takes off a nozzle's length before and after it, where the mean over \
         exactly that length does not see it: over 10 to 30 mm less is gained, as the table says.",
        100.0 * UNMODELLED.ratio,
        last.added_s,
    )
}

fn push(last: &BudgetRow, rows: &mut TableRows) {
    const KINDS: [(DriveMode, [&str; 2]); 2] = [
        (DriveMode::Constant, ["width error RMS, constant extruder", "ratio to constant extruder"]),
        (
            DriveMode::Proportional,
            ["width error RMS, proportional extruder", "ratio to proportional extruder"],
        ),
    ];
    for (drive, [error, _]) in KINDS {
        let best = 100.0 * last.ratio(drive) * last.planned.noisy;
        rows.compare(CASE, (error, "%"), best, 100.0 * last.planned.noisy);
    }
    for (drive, [_, ratio]) in KINDS {
        rows.ours(CASE, (ratio, "1"), last.ratio(drive));
    }
    let bound = ("ratio to constant extruder, bound without noise", "1");
    rows.ours(CASE, bound, last.bound_ratio(DriveMode::Constant));
    rows.ours(CASE, ("time added", "s"), last.added_s);
    for (baseline, errors) in &last.baselines {
        push_one(STRAIGHT_LEVEL, *baseline, *errors, last.planned, rows);
    }
}

fn push_one(case: &str, baseline: Baseline, errors: Errors, ours: Errors, rows: &mut TableRows) {
    let quantity = match (baseline.drive, baseline.planned_speed) {
        (DriveMode::Constant, false) => "width error RMS, constant, own speed",
        (DriveMode::Constant, true) => "width error RMS, constant, planned speed",
        (DriveMode::Proportional, false) => "width error RMS, proportional, own speed",
        (DriveMode::Proportional, true) => "width error RMS, proportional, planned speed",
    };
    rows.compare(case, (quantity, "%"), 100.0 * errors.noisy, 100.0 * ours.noisy);
}

/// Both baselines at the robot's own speed, and the plan.
fn runs(scenario: &Scenario, plan: &Plan) -> Result<[CornerRun; 3], CornerError> {
    let own = |drive| Baseline { drive, planned_speed: false }.run(scenario, &plan.speed);
    let planned = CornerRun::new(scenario, &plan.speed, |time| plan.command_at(time))?;
    Ok([own(DriveMode::Constant)?, own(DriveMode::Proportional)?, planned])
}
