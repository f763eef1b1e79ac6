//! Disturbances of the flow, and a controller with a model mismatch.

use rayon::prelude::*;

use super::{ControlSetup, scale};
use crate::cell::file::{Cell, RunPart};
use crate::core::{Mm, MmPerS2};
use crate::numeric::average::mean;
use crate::numeric::rank::mean_median;
use crate::scenario::bead::EdgeRoughness;
use crate::sim::cell::SimCellError;
use crate::trials::layer::LayerTrial;

/// Width of the disturbed layers \[mm\]: the nozzle's, Shojaei Barjuei et al. 2022, section 3.2.
const TARGET_MM: f64 = 42.0;
/// Distance from camera to nozzle for disturbances along the path: less than the paper's 88.4 mm,
/// because this distance limits the wavelengths that feedback can attenuate.
pub const NEAR_OFFSET: Mm = Mm::constant(60.0);
/// Amplitude of waves and pulsations, as a fraction of the flow.
const AMPLITUDE: f64 = 0.03;
/// Speed from which lengths of path are derived \[mm/s\]: that of a width of 42 mm, Shojaei
/// Barjuei et al. 2022, table 2, rounded.
const SPEED_MM_PER_S: f64 = 80.0;
/// Path before errors count \[mm\]. Derived: 200 mm to where control begins (Shojaei Barjuei et
/// al. 2022) and 20 mm for the first setpoints.
const CONTROL_START_MM: f64 = 220.0;
/// Standard deviation of a width. Derived: that of the cell of `lab control`, as are the next two.
const WIDTH_SIGMA: Mm = Mm::constant(0.003);
/// Roughness of a bead. Derived: as above.
const ROUGHNESS: EdgeRoughness = EdgeRoughness { sigma_mm: 0.1, length_mm: 5.0 };
/// Largest acceleration of a robot. Derived: as above.
const ACCELERATION: MmPerS2 = MmPerS2::constant(2000.0);

/// The cell with the noise of rendered frames, a bead that is rough, and a robot with limited
/// acceleration.
pub fn realistic(cell: &Cell, run: &RunPart) -> (Cell, RunPart) {
    let (mut cell, mut run) = (cell.clone(), run.clone());
    cell.simulation.width_noise = WIDTH_SIGMA;
    cell.simulation.roughness = ROUGHNESS;
    run.limits.max_accel = ACCELERATION;
    (cell, run)
}

/// A periodic disturbance of the flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FlowDisturbance {
    /// A sine along the path with this wavelength \[mm\].
    Wave(f64),
    /// A pulsation of the pump with this period \[s\].
    Pulsation(f64),
}

impl FlowDisturbance {
    /// Applies the disturbance to a cell and makes its path long enough. Returns the path from
    /// which the error counts \[mm\].
    fn enter(self, cell: &mut Cell, run: &mut RunPart) -> f64 {
        let flow = &mut cell.simulation.flow;
        let (from, length) = match self {
            Self::Wave(wavelength_mm) => {
                (flow.wave_amplitude, flow.wavelength_mm) = (AMPLITUDE, wavelength_mm);
                cell.simulation.random_phase = false;
                look_near(run);
                let from = (CONTROL_START_MM + 2.0 * wavelength_mm).max(700.0);
                (from, (12.0 * wavelength_mm).max(3000.0) + CONTROL_START_MM)
            }
            Self::Pulsation(period_s) => {
                (flow.pulse_amplitude, flow.pulse_period_s) = (AMPLITUDE, period_s);
                let seen_s = 5.0 * period_s + 1.0;
                (CONTROL_START_MM + SPEED_MM_PER_S * seen_s, SPEED_MM_PER_S * (seen_s + 20.0))
            }
        };
        cell.simulation.path = Mm::new(length).unwrap_or(cell.simulation.path);
        from
    }
}

/// Moves the camera near the nozzle; the relative uncertainty of its distance stays the same.
fn look_near(run: &mut RunPart) {
    let relative_sigma = run.camera.offset_sigma / run.camera.offset;
    run.camera.offset = NEAR_OFFSET;
    run.camera.offset_sigma = NEAR_OFFSET * relative_sigma;
}

/// Root mean square error of the bead over that of an uncontrolled bead; mean over the seeds.
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
    let lay = |seed| LayerTrial::lay(&cell, &run, &scale(), seed);
    let ratios = each(seeds, |seed| Ok(lay(seed)?.rms_error(from) / open))?;
    Ok(mean(ratios.into_iter()))
}

/// Path from a flow step of 8 % until the bead stays within 0.5 mm of its target \[mm\]; median
/// over the seeds, infinite if it never does.
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
        (cell.simulation.flow.step_at_mm, cell.simulation.flow.step_ratio) = (at, 1.08);
        Ok(LayerTrial::lay(&cell, &run, &scale(), seed)?.settles_within(at, 0.5))
    })?;
    Ok(mean_median(&mut found).unwrap_or(f64::NAN))
}

/// A model mismatch of the controller, and faults of its camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mismatch {
    /// Distance from camera to nozzle that the controller assumes, over the true one.
    pub offset: f64,
    /// Fraction of widths that are outliers.
    pub outliers: f64,
    /// Fraction of frames without a width.
    pub missing: f64,
}

impl Mismatch {
    /// No mismatch and no fault.
    pub const NONE: Self = Self { offset: 1.0, outliers: 0.0, missing: 0.0 };
}

/// Root mean square errors of many beads \[mm\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeadErrors {
    /// Median over the seeds.
    pub median_mm: f64,
    /// Mean over the seeds; a single diverging bead shows in it.
    pub mean_mm: f64,
}

/// Root mean square error of the bead from 500 mm after control began, over the seeds.
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
    let mut found = each(seeds, |seed| {
        let trial = LayerTrial::lay_mismatched(&cell, &run, &scale(), what.offset, seed)?;
        Ok(trial.rms_error(trial.control_start_mm + 500.0))
    })?;
    let mean_mm = mean(found.iter().copied());
    Ok(BeadErrors { median_mm: mean_median(&mut found).unwrap_or(f64::NAN), mean_mm })
}

/// A value for each seed, computed in parallel.
pub(super) fn each<T: Send>(
    seeds: u64,
    of: impl Fn(u64) -> Result<T, SimCellError> + Send + Sync,
) -> Result<Vec<T>, SimCellError> {
    (0..seeds).into_par_iter().map(of).collect()
}
