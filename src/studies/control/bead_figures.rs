//! What is required of one bead that begins at the target width and whose flow then steps.

use super::plant::{BAND_MM, Control, LoopCell, Plan, START_MM};
use super::steps::{JUDGED_AFTER_START_MM, START_LIMITS_MM, STEP_AFTER_MM, step_limits_mm};
use super::table::{CaseRow, Quantity, quantile};
use crate::numeric::average::mean;
use crate::numeric::number::to_f64;
use crate::studies::error::ReproduceError;
use crate::trials::layer::LayerTrial;

/// The two cases.
const START: &str = "42 mm from 38.6";
const STEP: &str = "flow +8 %";

/// Figures of one bead.
#[derive(Debug, Clone, Copy)]
pub struct BeadFigures {
    /// Path from the first controlled setpoint until the width stays within the band, up to the
    /// step \[mm\].
    pub start_mm: f64,
    /// Path from the step until it stays there \[mm\].
    pub step_mm: f64,
    /// Mean square error of the mean over the gauge between the two \[mm²\].
    mean_square: f64,
}

impl BeadFigures {
    /// Of a bead in a cell, whose flow steps 600 mm after the start.
    pub fn of(cell: LoopCell, trial: &LayerTrial) -> Self {
        let step_at_mm = START_MM + STEP_AFTER_MM;
        let before = trial.until(step_at_mm);
        let from_mm = trial.control_start_mm;
        Self {
            start_mm: before.smooth_settles_within(from_mm, f64::INFINITY, BAND_MM),
            step_mm: trial.smooth_settles_within(step_at_mm, f64::INFINITY, BAND_MM),
            mean_square: before.mean_square_over(cell.gauge_mm, from_mm + JUDGED_AFTER_START_MM),
        }
    }
}

/// The rows of a cell, from its beads, which were laid under some circumstance.
pub fn rows(
    cell: LoopCell,
    circumstance: &str,
    beads: &[BeadFigures],
) -> Result<Vec<CaseRow>, ReproduceError> {
    let starts: Vec<f64> = beads.iter().map(|bead| bead.start_mm).collect();
    let steps: Vec<f64> = beads.iter().map(|bead| bead.step_mm).collect();
    let pooled = mean(beads.iter().map(|bead| bead.mean_square)).sqrt();
    let alone = Plan::new(cell, Control::Distance)?.roughness_over_gauge_mm();
    let row = |case: &str, quantity, value, required| {
        let case = format!("{circumstance}: {case}");
        CaseRow::new(cell, &case, quantity, beads.len(), value, required)
    };
    let median = step_limits_mm(cell).0;
    Ok(vec![
        row(START, Quantity::mm("settled, median"), quantile(&starts, 0.5), START_LIMITS_MM.0),
        row(START, Quantity::ratio("RMS over roughness alone"), pooled / alone, 1.3),
        row(STEP, Quantity::mm("settled, median"), quantile(&steps, 0.5), median),
    ])
}

/// How many of all beads settled later than they may; `cells` names theirs.
pub fn late_rows(
    cells: &str,
    circumstance: &str,
    beads: &[(LoopCell, BeadFigures)],
) -> [CaseRow; 2] {
    let row = |case: &str, is_late: &dyn Fn(&(LoopCell, BeadFigures)) -> bool| {
        let late = beads.iter().filter(|bead| is_late(bead)).count();
        let quantity = Quantity::ratio("fraction settled late");
        let case = format!("{circumstance}: {case}");
        let fraction = to_f64(late) / to_f64(beads.len());
        CaseRow::new(cells, &case, quantity, beads.len(), fraction, 0.05)
    };
    [
        row(START, &|(_, bead)| bead.start_mm > START_LIMITS_MM.1),
        row(STEP, &|(cell, bead)| bead.step_mm > step_limits_mm(*cell).1),
    ]
}
