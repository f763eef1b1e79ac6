//! From the width of the start speed to the target, and steps of the flow.

use std::ops::Range;

use super::plant::{BAND_MM, Control, Execution, LoopCell, Plan};
use super::table::{CaseRow, Quantity, quantile};
use crate::numeric::average::mean;
use crate::studies::error::ReproduceError;
use crate::trials::layer::LayerTrial;

/// Path from the first controlled setpoint to a step of the flow \[mm\].
pub const STEP_AFTER_MM: f64 = 600.0;
/// Flow after a step over the one before it: the 8 % of papers.md, "004".
pub const STEP_RATIO: f64 = 1.08;
/// Path after which the width has settled after the start \[mm\]: in the median, and in 95 %.
pub const START_LIMITS_MM: (f64, f64) = (10.0, 20.0);
/// Path after the first controlled setpoint from which the error of a live bead counts \[mm\].
pub const JUDGED_AFTER_START_MM: f64 = 200.0;
/// Path over which the flow is too small \[mm\].
const LOW_FOR_MM: f64 = 600.0;
/// Length of bead after the flow is back \[mm\].
const AFTER_LOW_MM: f64 = 1400.0;
/// Path from the first controlled setpoint from which the error counts \[mm\].
const JUDGED_AFTER_MM: f64 = 500.0;

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let plan = Plan::new(cell, Control::Distance)?;
    let mut rows = start_rows(cell, &plan, seeds)?;
    rows.extend(more_flow_rows(cell, &plan, seeds)?);
    for execution in Execution::ALL {
        rows.push(less_flow_row(cell, plan.clone().laid(execution), seeds)?);
    }
    Ok(rows)
}

fn start_rows(
    cell: LoopCell,
    plan: &Plan,
    seeds: &Range<u64>,
) -> Result<Vec<CaseRow>, ReproduceError> {
    let mean_square = |trial: &LayerTrial| {
        trial.mean_square_over(cell.gauge_mm, trial.control_start_mm + JUDGED_AFTER_MM)
    };
    let figures = plan.each(seeds, |trial| {
        let settled = trial.smooth_settles_within(trial.control_start_mm, f64::INFINITY, BAND_MM);
        (settled, mean_square(trial))
    })?;
    let (settled, squares): (Vec<f64>, Vec<f64>) = figures.into_iter().unzip();
    let smooth = plan.clone().smooth().each(seeds, mean_square)?;
    let row = |quantity, value, required| {
        CaseRow::new(cell, "42 mm from 38.6", quantity, settled.len(), value, required)
    };
    let alone = plan.roughness_over_gauge_mm();
    Ok(vec![
        row(Quantity::mm("settled, median"), quantile(&settled, 0.5), START_LIMITS_MM.0),
        row(Quantity::mm("settled, 95 %"), quantile(&settled, 0.95), START_LIMITS_MM.1),
        row(Quantity::ratio("RMS over roughness alone"), pooled(&squares) / alone, 1.3),
        row(Quantity::mm("RMS without roughness"), pooled(&smooth), 0.02),
    ])
}

fn more_flow_rows(
    cell: LoopCell,
    plan: &Plan,
    seeds: &Range<u64>,
) -> Result<Vec<CaseRow>, ReproduceError> {
    let at = plan.run.robot.start_length.get() + STEP_AFTER_MM;
    let mut plan = plan.clone();
    let flow = &mut plan.cell.simulation.flow;
    (flow.step_at_mm, flow.step_ratio) = (at, STEP_RATIO);
    let settled = plan.each(seeds, |trial| settled_after(trial, at))?;
    let (median, most) = step_limits_mm(cell);
    let row = |quantity, value, required| {
        CaseRow::new(cell, "flow +8 %", quantity, settled.len(), value, required)
    };
    Ok(vec![
        row(Quantity::mm("settled, median"), quantile(&settled, 0.5), median),
        row(Quantity::mm("settled, 95 %"), quantile(&settled, 0.95), most),
    ])
}

/// Path after which the width has settled after a step of the flow \[mm\]: in the median, and in
/// 95 %.
pub const fn step_limits_mm(cell: LoopCell) -> (f64, f64) {
    match (cell.is_gauge_long(), cell.is_fast()) {
        (true, _) => (100.0, 140.0),
        (false, false) => (120.0, 140.0),
        (false, true) => (100.0, 115.0),
    }
}

/// With too little flow the speed is at its limit; the bead is judged once the flow is back.
fn less_flow_row(
    cell: LoopCell,
    plan: Plan,
    seeds: &Range<u64>,
) -> Result<CaseRow, ReproduceError> {
    let at = plan.run.robot.start_length.get() + STEP_AFTER_MM;
    let until = at + LOW_FOR_MM;
    let mut plan = plan.long(until + AFTER_LOW_MM);
    let flow = &mut plan.cell.simulation.flow;
    (flow.step_at_mm, flow.step_until_mm, flow.step_ratio) = (at, until, 0.92);
    let settled = plan.each(seeds, |trial| settled_after(trial, until))?;
    let (case, value) = (plan.execution.case("flow −8 %"), quantile(&settled, 0.95));
    Ok(CaseRow::new(cell, &case, Quantity::mm("settled, 95 %"), settled.len(), value, 150.0))
}

fn settled_after(trial: &LayerTrial, at_mm: f64) -> f64 {
    trial.smooth_settles_within(at_mm, f64::INFINITY, BAND_MM)
}

fn pooled(squares: &[f64]) -> f64 {
    mean(squares.iter().copied()).sqrt()
}
