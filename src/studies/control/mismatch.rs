//! A controller whose offset and exponent are wrong, with drift and waves of the flow.

use std::ops::Range;

use rayon::prelude::*;

use super::plant::{Control, Draw, Execution, LoopCell, Plan, TARGET_MM};
use super::table::{CaseRow, Quantity, quantile, ratio};
use crate::studies::error::ReproduceError;
use crate::trials::layer::LayerTrial;

/// Length of a bead \[mm\].
const LENGTH_MM: f64 = 3000.0;
/// Path from the first controlled setpoint from which the error counts \[mm\].
const JUDGED_AFTER_MM: f64 = 100.0;
/// Wavelengths of single waves \[mm\]. Derived: twelve from 60 to 2400, equidistant in the
/// logarithm.
const WAVELENGTHS_MM: [f64; 12] =
    [60.0, 84.0, 117.0, 164.0, 229.0, 320.0, 448.0, 627.0, 877.0, 1226.0, 1715.0, 2400.0];
/// Amplitude of single waves.
const AMPLITUDE: f64 = 0.01;

/// The rows of a cell.
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
) -> Result<Vec<CaseRow>, ReproduceError> {
    let drawn = |control| {
        seeds
            .clone()
            .into_par_iter()
            .map(|seed| Ok(errors(&drawn_plan(cell, control, seed)?.laid(execution).lay(seed)?)))
            .collect::<Result<Vec<f64>, ReproduceError>>()
    };
    let (ours, pi) = (drawn(Control::Distance)?, drawn(Control::Pi)?);
    let (ours_mm, pi_mm) = (quantile(&ours, 0.5), quantile(&pi, 0.5));
    // A PI controller that does not lay the bead is no measure.
    let required = if pi_mm.is_finite() { pi_mm } else { 0.0 };
    let all = execution.case("offset, exponent, drift and wave drawn");
    let mut rows =
        vec![CaseRow::new(cell, &all, Quantity::mm("RMS, median"), ours.len(), ours_mm, required)];
    for wavelength_mm in WAVELENGTHS_MM {
        let lay = |control| -> Result<f64, ReproduceError> {
            let mut plan = Plan::new(cell, control)?.long(LENGTH_MM).laid(execution);
            let flow = &mut plan.cell.simulation.flow;
            (flow.wave_amplitude, flow.wavelength_mm) = (AMPLITUDE, wavelength_mm);
            Ok(quantile(&plan.each(seeds, errors)?, 0.5))
        };
        let open = TARGET_MM * AMPLITUDE / std::f64::consts::SQRT_2;
        let ratio = ratio(lay(Control::Distance)?, lay(Control::Pi)?.max(open));
        let case = execution.case(&format!("wave of {wavelength_mm} mm"));
        rows.push(CaseRow::new(
            cell,
            &case,
            Quantity::ratio("RMS over the larger of PI's and uncontrolled"),
            ours.len(),
            ratio,
            1.15,
        ));
    }
    Ok(rows)
}

fn errors(trial: &LayerTrial) -> f64 {
    trial.smooth_rms_error(trial.control_start_mm + JUDGED_AFTER_MM)
}

/// A cell whose mismatch and disturbances are drawn by a seed.
fn drawn_plan(cell: LoopCell, control: Control, seed: u64) -> Result<Plan, ReproduceError> {
    let mut plan = Plan::new(cell, control)?.long(LENGTH_MM);
    let draw = Draw { stream: MISMATCH_STREAM, seed };
    plan.assumed_offset = draw.between(0, 0.8, 1.2);
    let bead = &mut plan.cell.simulation.bead;
    let factor = draw.ratio_between(1, 0.5, 2.0);
    // The cell's exponent stays; the bead's is the drawn fraction of it.
    (bead.exponent, bead.slow_exponent) = (0.25 / factor, 0.25 / factor);
    let flow = &mut plan.cell.simulation.flow;
    flow.drift_per_root_m = draw.between(2, 0.0, 0.02);
    flow.wave_amplitude = draw.between(3, 0.0, 0.02);
    flow.wavelength_mm = draw.ratio_between(4, 60.0, 2400.0);
    Ok(plan)
}

/// Random stream of what is drawn. Derived: the bytes of "mismatch".
const MISMATCH_STREAM: u64 = 0x6d69_736d_6174_6368;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// Half the exponent of the bead, and a camera that looks a fifth farther back or less far than
    /// is known: the speed changes too much, and its effect comes late or early. Taken for one of
    /// the exponent it drove the speed from limit to limit.
    #[test]
    fn too_small_an_exponent_with_a_wrong_offset_is_no_limit_cycle() {
        for cell in LoopCell::ALL.into_iter().filter(|cell| !cell.is_gauge_long()) {
            for offset in [0.8, 1.2] {
                let mut plan = Plan::new(cell, Control::Distance).unwrap();
                let bead = &mut plan.cell.simulation.bead;
                (bead.exponent, bead.slow_exponent) = (0.45, 0.5);
                plan.assumed_offset = offset;
                let found = plan.each(&(0..10), errors).unwrap();
                assert!(found.iter().all(|rms_mm| *rms_mm < 0.5), "{cell:?}, {offset}: {found:?}");
            }
        }
    }
}
