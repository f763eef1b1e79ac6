//! The controller on and off over several seeds.

use rayon::prelude::*;

use super::WheelControl;
use super::extruder_run::ExtruderRun;
use super::wheel::WheelRun;
use crate::extruder::feedforward::FeedforwardError;
use crate::numeric::average::mean;

/// Means over the seeds.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    /// Root mean square error of the section, off over on.
    pub ratio: f64,
    /// The smallest of that ratio over the seeds.
    pub min_ratio: f64,
    /// Root mean square deviation of the section from its own mean, off and on \[mm²\].
    pub area_rmse_mm2: [f64; 2],
    /// Mean absolute deviation of the section, off and on \[mm²\].
    pub area_mae_mm2: [f64; 2],
    /// Root mean square deviation of the width from its own mean, off and on \[mm\].
    pub width_rmse_mm: [f64; 2],
    /// Mean absolute deviation of the width, off and on \[mm\].
    pub width_mae_mm: [f64; 2],
    /// Runs of the first seed, off and on.
    pub example: [WheelRun; 2],
}

/// Runs each seed without control and with a controller; at least one seed.
pub fn compare(
    seeds: u64,
    unmodelled_fraction: f64,
    control: WheelControl,
) -> Result<Compared, FeedforwardError> {
    let runs: Result<Vec<[WheelRun; 2]>, FeedforwardError> = (1..=seeds.max(1))
        .into_par_iter()
        .map(|seed| {
            let extruder = ExtruderRun::new(seed, unmodelled_fraction)?;
            Ok([extruder.run(WheelControl::Off)?, extruder.run(control)?])
        })
        .collect();
    let runs = runs?;
    let ratio = |[off, on]: &[WheelRun; 2]| off.area_rmse_mm2 / on.area_rmse_mm2;
    let both = |of: fn(&WheelRun) -> f64| [0, 1].map(|i| mean(runs.iter().map(|run| of(&run[i]))));
    Ok(Compared {
        ratio: mean(runs.iter().map(ratio)),
        min_ratio: runs.iter().map(ratio).fold(f64::INFINITY, f64::min),
        area_rmse_mm2: both(|run| run.area_rmse_mm2),
        area_mae_mm2: both(|run| run.area_mae_mm2),
        width_rmse_mm: both(|run| run.width_rmse_mm),
        width_mae_mm: both(|run| run.width_mae_mm),
        example: [0, 1].map(|i| runs[0][i].clone()),
    })
}
