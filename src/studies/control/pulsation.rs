//! A pump that pulsates.

use std::f64::consts::PI;

use super::plant::{Control, LoopCell, Plan};
use super::table::{CaseRow, Quantity, quantile};
use crate::studies::error::ReproduceError;

/// Length of the bead \[mm\].
const LENGTH_MM: f64 = 3000.0;
/// Path from which the error counts \[mm\].
const JUDGED_FROM_MM: f64 = 1000.0;
/// Amplitudes of the flow.
const AMPLITUDES: [f64; 3] = [0.01, 0.02, 0.03];
/// Periods \[s\].
const PERIODS_S: [f64; 7] = [0.6, 1.0, 1.3, 2.0, 3.5, 6.0, 10.0];
/// Speed at which wavelengths are derived from periods \[mm/s\]: that of 42 mm, Shojaei Barjuei
/// et al. 2022, table 2.
const SPEED_MM_PER_S: f64 = 77.0;
/// Setpoints in a period from which a pulsation can be cancelled.
const MIN_SETPOINTS: f64 = 5.0;
/// Part of a pulsation that a mean over the gauge keeps, from which it is seen.
const MIN_SEEN: f64 = 0.4;

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: u64) -> Result<Vec<CaseRow>, ReproduceError> {
    let row = |case: &str, quantity, ratios: &[f64], fraction, required| {
        CaseRow::new(cell, case, quantity, ratios.len(), quantile(ratios, fraction), required)
    };
    let mut rows = Vec::new();
    for period_s in PERIODS_S {
        let mut ratios = Vec::new();
        for amplitude in AMPLITUDES {
            ratios.extend(ratios_of(cell, seeds, amplitude, period_s, true)?);
            let smooth = ratios_of(cell, seeds, amplitude, period_s, false)?;
            let wave = PI * cell.gauge_mm / (period_s * SPEED_MM_PER_S);
            let seen = (wave.sin() / wave).abs();
            if seen >= MIN_SEEN && period_s * cell.link_hz >= MIN_SETPOINTS {
                let case = format!("pulsation {:.0} %, {period_s} s, smooth", 100.0 * amplitude);
                rows.push(row(
                    &case,
                    Quantity::ratio("RMS over uncontrolled, median"),
                    &smooth,
                    0.5,
                    0.5,
                ));
            }
        }
        let case = format!("pulsation, {period_s} s");
        rows.push(row(&case, Quantity::ratio("RMS over uncontrolled, 99 %"), &ratios, 0.99, 1.05));
        rows.push(row(
            &case,
            Quantity::ratio("RMS over uncontrolled, largest"),
            &ratios,
            1.0,
            1.15,
        ));
    }
    Ok(rows)
}

fn ratios_of(
    cell: LoopCell,
    seeds: u64,
    amplitude: f64,
    period_s: f64,
    rough: bool,
) -> Result<Vec<f64>, ReproduceError> {
    let lay = |control| -> Result<Vec<f64>, ReproduceError> {
        let mut plan = Plan::new(cell, control)?.long(LENGTH_MM);
        if !rough {
            plan = plan.smooth();
        }
        let flow = &mut plan.cell.simulation.flow;
        (flow.pulse_amplitude, flow.pulse_period_s) = (amplitude, period_s);
        plan.each(seeds, |trial| trial.rms_error(JUDGED_FROM_MM))
    };
    let (ours, open) = (lay(Control::Distance)?, lay(Control::None)?);
    Ok(ours.iter().zip(&open).map(|(ours, open)| ours / open).collect())
}
