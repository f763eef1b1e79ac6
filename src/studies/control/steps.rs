//! From the width of the start speed to the target, and steps of the flow.

use super::plant::{BAND_MM, Control, LoopCell, Plan};
use super::table::{CaseRow, reached_by};
use crate::numeric::average::mean;
use crate::studies::error::ReproduceError;
use crate::trials::layer::LayerTrial;

/// Path from the first controlled setpoint to a step of the flow \[mm\].
const STEP_AFTER_MM: f64 = 600.0;
/// Path over which the flow is too small \[mm\].
const LOW_FOR_MM: f64 = 600.0;
/// Path from the first controlled setpoint from which the error counts \[mm\].
const JUDGED_AFTER_MM: f64 = 500.0;

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: u64) -> Result<Vec<CaseRow>, ReproduceError> {
    let plan = Plan::new(cell, Control::Distance)?;
    let row = |case: &str, quantity: &str, unit, beads, value: f64, required| CaseRow {
        case: case.to_owned(),
        cell: cell.name(),
        quantity: quantity.to_owned(),
        unit,
        beads,
        value: value.is_finite().then_some(value),
        required,
    };
    let mut rows = Vec::new();
    let figures = plan.each(seeds, |trial| {
        let start = trial.control_start_mm;
        (
            trial.smooth_settles_within(start, f64::INFINITY, BAND_MM),
            trial.mean_square_over(cell.gauge_mm, start + JUDGED_AFTER_MM),
        )
    })?;
    let (settled, squares): (Vec<f64>, Vec<f64>) = figures.into_iter().unzip();
    let beads = settled.len();
    let start = "42 mm from 38.6";
    rows.push(row(start, "settled, median", "mm", beads, reached_by(&settled, 0.5), 10.0));
    rows.push(row(start, "settled, 95 %", "mm", beads, reached_by(&settled, 0.95), 20.0));
    let alone = if cell.gauge_mm > 30.0 { 0.038 } else { 0.071 };
    let rms = pooled(&squares) / alone;
    rows.push(row(start, "RMS over roughness alone", "", beads, rms, 1.3));
    let smooth = plan.clone().smooth();
    let squares = smooth.each(seeds, |trial| {
        trial.mean_square_over(cell.gauge_mm, trial.control_start_mm + JUDGED_AFTER_MM)
    })?;
    rows.push(row(start, "RMS without roughness", "mm", beads, pooled(&squares), 0.02));

    let start_length = plan.run.robot.start_length.get();
    let at = start_length + STEP_AFTER_MM;
    let mut step = plan.clone();
    step.cell.simulation.flow.step_at_mm = at;
    step.cell.simulation.flow.step_ratio = 1.08;
    let settled = step.each(seeds, |trial| settled_after(trial, at))?;
    let (median, most) = match (cell.gauge_mm > 30.0, cell.vision_hz > 30.0) {
        (true, _) => (100.0, 140.0),
        (false, false) => (120.0, 140.0),
        (false, true) => (100.0, 115.0),
    };
    let name = "flow +8 %";
    rows.push(row(name, "settled, median", "mm", beads, reached_by(&settled, 0.5), median));
    rows.push(row(name, "settled, 95 %", "mm", beads, reached_by(&settled, 0.95), most));

    let mut low = plan.clone().long(at + LOW_FOR_MM + 1400.0);
    low.cell.simulation.flow.step_at_mm = at;
    low.cell.simulation.flow.step_until_mm = at + LOW_FOR_MM;
    low.cell.simulation.flow.step_ratio = 0.92;
    let settled = low.each(seeds, |trial| settled_after(trial, at + LOW_FOR_MM))?;
    rows.push(row("flow −8 %", "settled, 95 %", "mm", beads, reached_by(&settled, 0.95), 150.0));
    Ok(rows)
}

fn settled_after(trial: &LayerTrial, at_mm: f64) -> f64 {
    trial.smooth_settles_within(at_mm, f64::INFINITY, BAND_MM)
}

fn pooled(squares: &[f64]) -> f64 {
    mean(squares.iter().copied()).sqrt()
}
