//! Several controllers on the same plant with the same seeds.

use rayon::prelude::*;

use super::layer::LayerTrial;
use super::score::BeadPoint;
use crate::calibration::Calibration;
use crate::cell::file::{Cell, RunPart};
use crate::core::Mm;
use crate::numeric::estimate::Estimate;
use crate::numeric::number::{to_count, to_f64};
use crate::numeric::rank::mean_median;
use crate::sim::cell::SimCellError;
use crate::width_control::target::WidthTarget;

/// Path after control began from which errors count \[mm\]; before it the bead follows the step to
/// the target.
pub const JUDGED_AFTER_MM: f64 = 30.0;
/// Path after control began from which the standard deviation counts \[mm\]. Derived: more than
/// the 455 mm that the paper's loop needs to settle at 42 mm (papers.md).
pub const SIGMA_AFTER_MM: f64 = 700.0;
/// Length of the segments over which errors of all seeds are combined \[mm\].
const PIECE_MM: f64 = 5.0;

/// A controller with its cell; bead, simulation and calibration are those of the common plant.
#[derive(Debug, Clone)]
pub struct Contender {
    /// Its name.
    pub name: String,
    /// Its cell on the common plant.
    pub cell: Cell,
    /// The run part of its cell.
    pub run: RunPart,
    /// Its calibration.
    pub calibration: Calibration,
}

impl Contender {
    /// The run part with another target width.
    fn with_width(&self, width: Mm) -> RunPart {
        let mut run = self.run.clone();
        run.control.target = WidthTarget::constant(width);
        run
    }
}

/// Statistics of a number over the seeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeedStatistics {
    /// Mean; `None` if a seed has no number.
    pub mean: Option<f64>,
    /// Half the interval that holds the mean with 95 % confidence, by Student's t.
    pub confidence: Option<f64>,
    /// Median; `None` if most seeds have no number.
    pub median: Option<f64>,
}

impl SeedStatistics {
    /// Statistics of one number per seed; infinity or NaN stands for no number.
    pub fn of(mut values: Vec<f64>) -> Self {
        let Estimate { mean, confidence } = Estimate::of(&values);
        let median = mean_median(&mut values).unwrap_or(f64::NAN);
        Self {
            mean: mean.is_finite().then_some(mean),
            confidence,
            median: median.is_finite().then_some(median),
        }
    }
}

/// Figures of a controller at one width.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// Mean absolute error of the bead from 30 mm after control began \[mm\].
    pub mean_error_mm: SeedStatistics,
    /// Root mean square error, from there on \[mm\].
    pub rms_error_mm: SeedStatistics,
    /// Integral of the absolute error over the path from where control began \[mm²\].
    pub integral_mm2: SeedStatistics,
    /// Path from where control began until the error stays within half a millimetre \[mm\].
    pub settled_mm: SeedStatistics,
    /// Standard deviation of the width from 700 mm after control began \[mm\].
    pub sigma_mm: SeedStatistics,
    /// Root mean square error over that of the first controller with the same
    /// seed.
    pub ratio: SeedStatistics,
    /// Number of seeds whose bead was not controlled at all, or not laid to its end.
    pub failed_seeds: usize,
    /// Root mean square error over all seeds, by the path \[mm\].
    pub error_profile: Vec<BeadPoint>,
    /// Width by the path of the first seed's bead \[mm\].
    pub example: Vec<BeadPoint>,
    /// Root mean square error of each seed \[mm\].
    rms_by_seed: Vec<f64>,
}

impl Figures {
    /// Lays a bead of a width with each seed from 0 on, in parallel.
    pub fn lay(
        who: &Contender,
        width: Mm,
        seeds: u64,
        first: Option<&Self>,
    ) -> Result<Self, SimCellError> {
        let run = who.with_width(width);
        let lay = |seed| LayerTrial::lay(&who.cell, &run, &who.calibration, seed);
        let trials: Vec<LayerTrial> =
            (0..seeds).into_par_iter().map(lay).collect::<Result<_, _>>()?;
        let values =
            |value: &dyn Fn(&LayerTrial) -> f64| trials.iter().map(value).collect::<Vec<f64>>();
        let of = |value: &dyn Fn(&LayerTrial) -> f64| SeedStatistics::of(values(value));
        let failed = |trial: &LayerTrial| !trial.complete || trial.control_start_mm.is_infinite();
        let judged = |trial: &LayerTrial| trial.control_start_mm + JUDGED_AFTER_MM;
        let rms_by_seed = values(&|trial| trial.rms_error(judged(trial)));
        let firsts = first.map_or(&rms_by_seed, |first| &first.rms_by_seed);
        let ratio = |(ours, first): (&f64, &f64)| {
            if first.is_finite() { ours / first } else { f64::NAN }
        };
        let ratios = rms_by_seed.iter().zip(firsts).map(ratio).collect();
        Ok(Self {
            mean_error_mm: of(&|trial| trial.mean_error(judged(trial))),
            rms_error_mm: SeedStatistics::of(rms_by_seed.clone()),
            integral_mm2: of(&|trial| trial.error_integral(trial.control_start_mm)),
            settled_mm: of(&|trial| trial.settles_within(trial.control_start_mm, 0.5)),
            sigma_mm: of(&|trial| {
                trial.standard_deviation(trial.control_start_mm + SIGMA_AFTER_MM)
            }),
            ratio: SeedStatistics::of(ratios),
            failed_seeds: trials.iter().filter(|trial| failed(trial)).count(),
            error_profile: error_profile(&trials, width.get()),
            example: trials.into_iter().next().map(|trial| trial.bead).unwrap_or_default(),
            rms_by_seed,
        })
    }
}

/// Root mean square error over all seeds, for each segment of the path.
fn error_profile(trials: &[LayerTrial], target_mm: f64) -> Vec<BeadPoint> {
    let mut pieces: Vec<(f64, f64)> = Vec::new();
    for (at, width) in trials.iter().flat_map(|trial| &trial.bead) {
        let piece = to_count(at / PIECE_MM);
        if pieces.len() <= piece {
            pieces.resize(piece + 1, (0.0, 0.0));
        }
        pieces[piece].0 += (width - target_mm).powi(2);
        pieces[piece].1 += 1.0;
    }
    let middle = |number: usize| (to_f64(number) + 0.5) * PIECE_MM;
    let known = pieces.iter().enumerate().filter(|(_, (_, count))| *count > 0.0);
    known.map(|(number, (sum, count))| (middle(number), (sum / count).sqrt())).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cell::file::Purpose;

    fn contender(name: &str, text: &str) -> Contender {
        let cell = Cell::parse(Path::new(name), text, Purpose::Run).unwrap();
        let run = cell.run.clone().unwrap();
        let calibration = crate::studies::barjuei2022::scale();
        Contender { name: name.into(), cell, run, calibration }
    }

    #[test]
    fn statistics_are_mean_and_median_of_what_was_reached() {
        let estimate = SeedStatistics::of(vec![1.0, 2.0, 3.0, 6.0]);
        assert_eq!((estimate.mean, estimate.median), (Some(3.0), Some(2.5)));
        let never = SeedStatistics::of(vec![1.0, f64::INFINITY, 2.0]);
        assert_eq!((never.mean, never.median), (None, Some(2.0)));
        assert_eq!(SeedStatistics::of(vec![f64::INFINITY; 3]).median, None);
    }

    #[test]
    fn a_controller_that_never_controls_or_stops_has_no_figures() {
        let ours = contender("ours", include_str!("../../cells/distance.toml"));
        let width = Mm::constant(42.0);
        let mut late = ours.clone();
        late.run.robot.start_length = Mm::constant(1e5);
        let late = Figures::lay(&late, width, 2, None).unwrap();
        assert_eq!(
            (late.failed_seeds, late.rms_error_mm.mean, late.settled_mm.median),
            (2, None, None)
        );
        assert_eq!((late.integral_mm2.mean, late.sigma_mm.mean), (None, None));
        let mut blind = ours;
        blind.cell.simulation.path = Mm::constant(500.0);
        let blind = Figures::lay(&blind, width, 2, None).unwrap();
        assert_eq!((blind.failed_seeds, blind.sigma_mm.mean), (0, None));
        assert!(blind.rms_error_mm.mean.is_some());
    }

    #[test]
    fn the_controller_by_distance_is_better_than_the_papers() {
        let paper = contender("paper", include_str!("../../cells/barjuei2022.toml"));
        let ours = contender("ours", include_str!("../../cells/distance.toml"));
        let width = Mm::constant(42.0);
        let first = Figures::lay(&paper, width, 4, None).unwrap();
        let second = Figures::lay(&ours, width, 4, Some(&first)).unwrap();
        assert_eq!(first.ratio.mean, Some(1.0));
        assert!(second.ratio.mean.unwrap() + second.ratio.confidence.unwrap() < 0.3);
        assert!(second.settled_mm.median.unwrap() < first.settled_mm.median.unwrap_or(1e9));
        assert_eq!(first, Figures::lay(&paper, width, 4, None).unwrap());
    }
}
