//! Disturbances of the flow, and a controller that was told wrong.

use rayon::prelude::*;

use super::{ControlSetup, scale};
use crate::cell::file::{Cell, RunPart};
use crate::core::units::Mm;
use crate::numeric::average::mean;
use crate::numeric::rank::mean_median;
use crate::sim::cell::SimCellError;
use crate::trials::layer::LayerTrial;

/// Width of the disturbed layers \[mm\].
const TARGET_MM: f64 = 42.0;
/// Camera to nozzle where a disturbance is to be answered.
const NEAR_OFFSET: Mm = Mm::constant(60.0);
/// Amplitude of waves and pulsations, as a share of the flow.
const AMPLITUDE: f64 = 0.03;
/// Speed to reckon with \[mm/s\].
const SPEED_MM_PER_S: f64 = 80.0;
/// Where control begins, and some way to settle \[mm\].
const CONTROL_START_MM: f64 = 220.0;

/// A disturbance of the flow that goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FlowDisturbance {
    /// A sine along the path, of this wavelength \[mm\].
    Wave(f64),
    /// A pulsation of pump or screw, of this period \[s\].
    Pulsation(f64),
}

impl FlowDisturbance {
    /// A cell with this disturbance, long enough to judge it, and where to
    /// begin with that \[mm\].
    fn enter(self, cell: &mut Cell, run: &mut RunPart) -> f64 {
        let flow = &mut cell.simulation.flow;
        let (from, length) = match self {
            Self::Wave(wavelength_mm) => {
                flow.wave_amplitude = AMPLITUDE;
                flow.wavelength_mm = wavelength_mm;
                cell.simulation.random_phase = false;
                look_near(run);
                let from = (CONTROL_START_MM + 2.0 * wavelength_mm).max(700.0);
                (from, (12.0 * wavelength_mm).max(3000.0) + CONTROL_START_MM)
            }
            Self::Pulsation(period_s) => {
                flow.pulse_amplitude = AMPLITUDE;
                flow.pulse_period_s = period_s;
                let seen_s = 5.0 * period_s + 1.0;
                (CONTROL_START_MM + SPEED_MM_PER_S * seen_s, SPEED_MM_PER_S * (seen_s + 20.0))
            }
        };
        cell.simulation.path = Mm::new(length).unwrap_or(cell.simulation.path);
        from
    }
}

/// Puts the camera near the nozzle.
fn look_near(run: &mut RunPart) {
    let share = run.camera.offset_sigma / run.camera.offset;
    run.camera.offset = NEAR_OFFSET;
    run.camera.offset_sigma = NEAR_OFFSET * share;
}

/// Root mean square error of the bead over that of one which nobody corrects,
/// as the mean over seeds.
pub fn error_ratio(
    cell: &Cell,
    run: &RunPart,
    who: ControlSetup,
    what: FlowDisturbance,
    seeds: u64,
) -> Result<f64, SimCellError> {
    let (mut cell, mut run) = who.enter(cell, run, TARGET_MM);
    let from = what.enter(&mut cell, &mut run);
    let open = TARGET_MM * AMPLITUDE / std::f64::consts::SQRT_2;
    let found = each(seeds, |seed| {
        Ok(LayerTrial::lay(&cell, &run, &scale(), seed)?.rms_error(from) / open)
    })?;
    Ok(mean(found.into_iter()))
}

/// Way after a step of the flow by 8 % within which the bead is back within
/// 0.5 mm for good \[mm\], as the median over seeds; infinite where it never is.
pub fn step_settles(
    cell: &Cell,
    run: &RunPart,
    who: ControlSetup,
    seeds: u64,
) -> Result<f64, SimCellError> {
    let (mut cell, mut run) = who.enter(cell, run, TARGET_MM);
    look_near(&mut run);
    cell.simulation.path = Mm::constant(3000.0);
    let mut found = each(seeds, |seed| {
        let mut cell = cell.clone();
        #[expect(clippy::cast_precision_loss, reason = "a small number")]
        let at = 1000.0 + (3 * seed) as f64;
        cell.simulation.flow.step_at_mm = at;
        cell.simulation.flow.step_ratio = 1.08;
        Ok(LayerTrial::lay(&cell, &run, &scale(), seed)?.settles_within(at, 0.5))
    })?;
    Ok(mean_median(&mut found).unwrap_or(f64::NAN))
}

/// What the controller is told wrong, and what its camera does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mismatch {
    /// Camera's distance as it is told, over the true one.
    pub offset: f64,
    /// Share of widths that are outliers.
    pub outliers: f64,
    /// Share of frames without a width.
    pub missing: f64,
}

impl Mismatch {
    /// Nothing is wrong.
    pub const NONE: Self = Self { offset: 1.0, outliers: 0.0, missing: 0.0 };
}

/// Root mean square errors of many beads \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadErrors {
    /// Their median.
    pub median_mm: f64,
    /// Their mean, in which one bead that goes astray shows.
    pub mean_mm: f64,
}

/// Root mean square error of the bead from 500 mm after control began, over seeds.
pub fn mismatched(
    cell: &Cell,
    run: &RunPart,
    who: ControlSetup,
    what: Mismatch,
    seeds: u64,
) -> Result<BeadErrors, SimCellError> {
    let (mut cell, run) = who.enter(cell, run, TARGET_MM);
    cell.simulation.outlier_fraction = what.outliers;
    cell.simulation.missing_fraction = what.missing;
    let offset_factor = what.offset;
    let mut found = each(seeds, |seed| {
        let trial = LayerTrial::lay_mismatched(&cell, &run, &scale(), offset_factor, seed)?;
        Ok(trial.rms_error(trial.control_start_mm + 500.0))
    })?;
    let mean_mm = mean(found.iter().copied());
    Ok(BeadErrors { median_mm: mean_median(&mut found).unwrap_or(f64::NAN), mean_mm })
}

/// A number of every seed, in parallel.
pub(super) fn each<T: Send>(
    seeds: u64,
    of: impl Fn(u64) -> Result<T, SimCellError> + Send + Sync,
) -> Result<Vec<T>, SimCellError> {
    (0..seeds).into_par_iter().map(of).collect()
}
