//! The four layers.

use super::disturbed::each;
use super::{ControlSetup, scale};
use crate::cell::file::{Cell, RunPart};
use crate::core::Mm;
use crate::numeric::rank::mean_median;
use crate::scenario::table::WidthSource;
use crate::sim::cell::SimCellError;
use crate::trials::compare::{JUDGED_AFTER_MM, SIGMA_AFTER_MM};
use crate::trials::layer::LayerTrial;
use crate::trials::score::LayerScore;
use crate::vision::MeasureMethod;

/// Medians over the seeds of a layer.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerResult {
    /// Mean magnitude of the measured error over all of the bead that the camera saw \[mm\].
    pub mean_error_mm: f64,
    /// Root mean square of the measured error \[mm\].
    pub rms_error_mm: f64,
    /// Mean speed, including the start \[mm/s\].
    pub mean_speed_mm_per_s: f64,
    /// Mean magnitude of the bead's true error, from 30 mm after control began \[mm\].
    pub bead_mean_error_mm: f64,
    /// Root mean square of the bead's true error, from there on \[mm\].
    pub bead_rms_error_mm: f64,
    /// Integral of the true error's magnitude from where control began \[mm²\].
    pub error_integral_mm2: f64,
    /// Standard deviation of the bead's true width, from 700 mm after control began \[mm\].
    pub bead_sigma_mm: f64,
    /// Path from where control began until the error stays within 0.5 mm \[mm\]; `None` if for
    /// most seeds it does not.
    pub settled_mm: Option<f64>,
    /// Rejected frames, over all seeds.
    pub refused: u64,
    /// Widths and speeds over path of the first seed.
    pub example: LayerScore,
}

/// Lays a layer with each seed, in parallel.
pub fn lay(cell: &Cell, run: &RunPart, seeds: u64) -> Result<LayerResult, SimCellError> {
    let trials = each(seeds, |seed| LayerTrial::lay(cell, run, &scale(), seed))?;
    let of = |value: &dyn Fn(&LayerTrial) -> f64| {
        mean_median(&mut trials.iter().map(value).collect::<Vec<f64>>()).unwrap_or(f64::NAN)
    };
    let after = |trial: &LayerTrial, mm: f64| trial.control_start_mm + mm;
    let settled = of(&|trial| trial.settles_within(trial.control_start_mm, 0.5));
    Ok(LayerResult {
        mean_error_mm: of(&|trial| trial.score.mean_error()),
        rms_error_mm: of(&|trial| trial.score.rms_error()),
        mean_speed_mm_per_s: of(&|trial| trial.score.mean_speed()),
        bead_mean_error_mm: of(&|trial| trial.mean_error(after(trial, JUDGED_AFTER_MM))),
        bead_rms_error_mm: of(&|trial| trial.rms_error(after(trial, JUDGED_AFTER_MM))),
        error_integral_mm2: of(&|trial| trial.error_integral(trial.control_start_mm)),
        bead_sigma_mm: of(&|trial| trial.standard_deviation(after(trial, SIGMA_AFTER_MM))),
        settled_mm: settled.is_finite().then_some(settled),
        refused: trials.iter().map(|trial| trial.score.refused()).sum(),
        example: trials.into_iter().next().map(|trial| trial.score).unwrap_or_default(),
    })
}

/// Path from the start of the bead until the error stays within 0.5 mm \[mm\], with control from
/// the start and without an earlier measurement; median over the seeds, infinite if it never does.
pub fn settles_unseen(
    cell: &Cell,
    run: &RunPart,
    who: ControlSetup,
    target_mm: f64,
    seeds: u64,
) -> Result<f64, SimCellError> {
    let (cell, mut run) = who.enter(cell, run, target_mm);
    run.robot.start_length = Mm::ZERO;
    let lay = |seed| LayerTrial::lay(&cell, &run, &scale(), seed);
    let mut found = each(seeds, |seed| Ok(lay(seed)?.settles_within(0.0, 0.5)))?;
    Ok(mean_median(&mut found).unwrap_or(f64::NAN))
}

/// The paper's cell, with every frame rendered and measured by `method`.
pub fn with_frames(cell: &Cell, method: MeasureMethod) -> Cell {
    let mut cell = cell.clone();
    cell.simulation.width_source = WidthSource::Frames;
    cell.simulation.roughness.sigma_mm = 0.1;
    cell.gauge.method = method;
    cell
}
