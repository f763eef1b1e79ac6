//! A pump that pulsates.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use super::plant::{Control, Execution, LoopCell, Plan};
use super::table::{CaseRow, Quantity, quantile, ratio};
use crate::numeric::average::rms;
use crate::numeric::number::{to_count, to_f64};
use crate::studies::error::ReproduceError;
use crate::trials::layer::LayerTrial;
use crate::trials::score::BeadPoint;
use crate::width_control::strategy::distance::DistanceStrategy;

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
/// Distance between places at which speeds are compared \[mm\]. Derived: five reports, 20 ms apart, of
/// a robot at 77 mm/s.
const SPEED_SPACING_MM: f64 = 7.7;
/// Part of a pulsation that a mean over the gauge keeps, from which it is seen.
const MIN_SEEN: f64 = 0.4;

/// The rows of a cell.
pub fn rows(cell: LoopCell, seeds: &Range<u64>) -> Result<Vec<CaseRow>, ReproduceError> {
    let mut rows = Vec::new();
    for execution in Execution::ALL {
        rows.extend(steady_rows(cell, seeds, execution)?);
        rows.extend(pulsating_rows(cell, seeds, execution)?);
    }
    Ok(rows)
}

/// A pump that pulsates. Beads without roughness are simulated only: they say what could be reached.
fn pulsating_rows(
    cell: LoopCell,
    seeds: &Range<u64>,
    execution: Execution,
) -> Result<Vec<CaseRow>, ReproduceError> {
    let row = |case: &str, quantity, ratios: &[f64], fraction, required| {
        let (case, value) = (execution.case(case), quantile(ratios, fraction));
        CaseRow::new(cell, &case, quantity, ratios.len(), value, required)
    };
    let median = Quantity::ratio("RMS over uncontrolled, median");
    let most = Quantity::ratio("RMS over uncontrolled, 99 %");
    let largest = Quantity::ratio("RMS over uncontrolled, largest");
    let mut rows = Vec::new();
    let mut of_all = Vec::new();
    for period_s in PERIODS_S {
        let mut ratios = Vec::new();
        for amplitude in AMPLITUDES {
            let ours = pulsating(cell, Control::Distance, amplitude, period_s)?.laid(execution);
            let open = pulsating(cell, Control::None, amplitude, period_s)?.laid(execution);
            ratios.extend(ratios_of(&ours, &open, seeds)?);
            if execution == Execution::Rehearsed {
                continue;
            }
            let smooth = ratios_of(&ours.smooth(), &open.smooth(), seeds)?;
            let wave = PI * cell.gauge_mm / (period_s * SPEED_MM_PER_S);
            let seen = (wave.sin() / wave).abs();
            if seen >= MIN_SEEN && period_s * cell.link_hz >= MIN_SETPOINTS {
                let case = format!("pulsation {:.0} %, {period_s} s, smooth", 100.0 * amplitude);
                rows.push(row(&case, median, &smooth, 0.5, 0.5));
            }
        }
        let case = format!("pulsation, {period_s} s");
        rows.push(row(&case, most, &ratios, 0.99, 1.05));
        rows.push(row(&case, largest, &ratios, 1.0, 1.15));
        of_all.extend(ratios);
    }
    rows.push(row("pulsation, all periods", most, &of_all, 0.99, 1.05));
    Ok(rows)
}

/// A pump that does not pulsate: what the part that cancels costs.
fn steady_rows(
    cell: LoopCell,
    seeds: &Range<u64>,
    execution: Execution,
) -> Result<[CaseRow; 2], ReproduceError> {
    let plan = Plan::new(cell, Control::Distance)?.long(LENGTH_MM).laid(execution);
    let mut off = plan.clone();
    if let Some(strategy) = off.run.control.strategy.as_kind::<DistanceStrategy>().copied() {
        let strategy = DistanceStrategy { cancels_pulsation: false, ..strategy };
        off.run.control.strategy = Arc::new(strategy);
    }
    let of = |trial: &LayerTrial| (trial.rms_error(JUDGED_FROM_MM), trial.score.speeds.clone());
    let (with, without) = (plan.each(seeds, of)?, off.each(seeds, of)?);
    let pairs = || with.iter().zip(&without);
    let ratios: Vec<f64> = pairs().map(|(with, without)| ratio(with.0, without.0)).collect();
    // A bead that was stopped has an infinite error, and no speed from there on.
    let added: Vec<f64> = pairs()
        .map(
            |(with, without)| {
                if with.0.is_finite() { speed_change(&with.1, &without.1) } else { with.0 }
            },
        )
        .collect();
    let row = |quantity, value, required| {
        CaseRow::new(cell, &execution.case("no pulsation"), quantity, with.len(), value, required)
    };
    Ok([
        row(Quantity::percent("speed added, RMS, 99 %"), 100.0 * quantile(&added, 0.99), 0.3),
        row(Quantity::ratio("RMS over that without it, largest"), quantile(&ratios, 1.0), 1.02),
    ])
}

/// Root mean square difference of two speeds over the path, as a fraction of the second.
fn speed_change(with: &[BeadPoint], without: &[BeadPoint]) -> f64 {
    let after = |speeds: &[BeadPoint], mm: f64| {
        speeds.get(speeds.partition_point(|(path, _)| *path < mm)).map(|(_, speed)| *speed)
    };
    let points = to_count((LENGTH_MM - JUDGED_FROM_MM) / SPEED_SPACING_MM);
    let places = (0..points).map(|point| JUDGED_FROM_MM + to_f64(point) * SPEED_SPACING_MM);
    let changes = places.filter_map(|mm| Some(after(with, mm)? / after(without, mm)? - 1.0));
    rms(changes)
}

fn ratios_of(ours: &Plan, open: &Plan, seeds: &Range<u64>) -> Result<Vec<f64>, ReproduceError> {
    let lay = |plan: &Plan| plan.each(seeds, |trial| trial.rms_error(JUDGED_FROM_MM));
    let (ours, open) = (lay(ours)?, lay(open)?);
    Ok(ours.iter().zip(&open).map(|(ours, open)| ratio(*ours, *open)).collect())
}

fn pulsating(
    cell: LoopCell,
    control: Control,
    amplitude: f64,
    period_s: f64,
) -> Result<Plan, ReproduceError> {
    let mut plan = Plan::new(cell, control)?.long(LENGTH_MM);
    let flow = &mut plan.cell.simulation.flow;
    (flow.pulse_amplitude, flow.pulse_period_s) = (amplitude, period_s);
    Ok(plan)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    /// Beads on which a level and a pulsation that were estimated apart drove each other away, and
    /// some on which a slow wave was taken for an error of the offset.
    #[test]
    fn no_bead_is_worse_than_without_control() {
        let [short, _, slow_and_long, long] = LoopCell::ALL;
        for (cell, amplitude, period_s, seed) in [
            (short, 0.01, 3.5, 73),
            (short, 0.02, 3.5, 62),
            (short, 0.02, 6.0, 76),
            (slow_and_long, 0.03, 3.5, 116),
            (slow_and_long, 0.03, 3.5, 220),
            (slow_and_long, 0.03, 3.5, 246),
            (long, 0.03, 2.0, 52),
            (long, 0.03, 3.5, 50),
            (long, 0.02, 2.0, 75),
            (long, 0.02, 10.0, 68),
            (long, 0.02, 10.0, 19),
            (long, 0.02, 10.0, 5),
            (long, 0.03, 10.0, 33),
            (short, 0.02, 10.0, 35),
            (short, 0.03, 10.0, 32),
        ] {
            let rms = |control| {
                let plan = pulsating(cell, control, amplitude, period_s).unwrap();
                plan.lay(seed).unwrap().rms_error(JUDGED_FROM_MM)
            };
            let ratio = rms(Control::Distance) / rms(Control::None);
            assert!(ratio < 0.5, "{cell:?}, {amplitude}, {period_s} s, seed {seed}: {ratio}");
        }
    }
}
