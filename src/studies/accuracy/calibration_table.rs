//! Whether the predicted uncertainty of calibrations is right: figures of cases with a known
//! truth.

use serde::Serialize;

use super::INTERVAL_SIGMAS;
use super::calibrations::{CalibratedWidth, CalibrationCase, CornerSource};
use super::figures::fraction;
use super::table::{FigureRow, number, verdict};
use crate::numeric::number::to_f64;

/// Largest deviation from 1 of the RMS error over the predicted standard deviation.
const MAX_RATIO_DEVIATION: f64 = 0.10;
/// Fraction of the true widths that the 95 % interval must hold.
const COVERAGE_RANGE: (f64, f64) = (0.93, 0.97);
/// Standard errors by which a figure may miss its limit. Derived: three miss one figure in 370 by
/// chance.
const ALLOWANCE_SIGMAS: f64 = 3.0;

/// The figures of one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrationFigures {
    /// The case's name.
    pub case: &'static str,
    /// Where the corners came from.
    pub source: &'static str,
    /// Images of each calibration.
    pub views: u64,
    /// Standard deviation of a corner's position \[px\]; none for rendered images.
    pub noise_px: Option<f64>,
    /// Calibrations.
    pub trials: usize,
    /// Trials that gave a calibration.
    pub found: usize,
    /// Root mean square error of a width over the trials, relative to the width: the smallest and
    /// the largest value over the beads.
    pub rms_error_fraction: [f64; 2],
    /// Root mean square of the error over the standard deviation that its own calibration
    /// predicts: the smallest and the largest value over the beads.
    pub ratio: [f64; 2],
    /// Root mean square of [`Self::ratio`] over all beads.
    pub ratio_of_all: f64,
    /// Fraction of the true widths that lie in the 95 % interval.
    pub within_interval: f64,
    /// Largest magnitude over the beads of the mean error over the standard deviation.
    pub bias_over_sigma: f64,
    /// The limits that are missed.
    pub missed: Vec<String>,
}

struct BeadFigures {
    rms_error_fraction: f64,
    ratio: f64,
    bias_over_sigma: f64,
}

impl CalibrationFigures {
    /// Figures of one case from the widths of each trial; `None` is a trial without a calibration.
    pub fn of(
        case: &CalibrationCase,
        source: CornerSource,
        trials: &[Option<Vec<CalibratedWidth>>],
    ) -> Self {
        let found: Vec<&Vec<CalibratedWidth>> = trials.iter().flatten().collect();
        let beads = found.first().map_or(0, |first| first.len());
        let each: Vec<BeadFigures> = (0..beads).map(|bead| of_bead(&found, bead)).collect();
        let all = || found.iter().flat_map(|outcomes| outcomes.iter());
        let held = all().filter(|o| o.error_mm.abs() <= INTERVAL_SIGMAS * o.sigma_mm).count();
        let within_interval = fraction(held, all().count());
        let ends = |value: fn(&BeadFigures) -> f64| {
            let values = || each.iter().map(value);
            [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
        };
        let squares: f64 = each.iter().map(|bead| bead.ratio.powi(2)).sum();
        let mut figures = Self {
            case: case.name,
            source: match source {
                CornerSource::Corners => "corners",
                CornerSource::Images => "images",
            },
            views: case.views,
            noise_px: (source == CornerSource::Corners).then_some(case.noise_px),
            trials: trials.len(),
            found: found.len(),
            rms_error_fraction: ends(|bead| bead.rms_error_fraction),
            ratio: ends(|bead| bead.ratio),
            ratio_of_all: (squares / to_f64(each.len().max(1))).sqrt(),
            within_interval,
            bias_over_sigma: ends(|bead| bead.bias_over_sigma.abs())[1],
            missed: Vec::new(),
        };
        figures.missed = figures.misses();
        figures
    }

    /// Compares with the limits, widened by the standard error that few trials leave.
    fn misses(&self) -> Vec<String> {
        let trials = to_f64(self.found.max(1));
        let open = MAX_RATIO_DEVIATION.max(ALLOWANCE_SIGMAS / (2.0 * trials).sqrt());
        let open_share = ALLOWANCE_SIGMAS * (0.95 * 0.05 / trials).sqrt();
        let mut missed = Vec::new();
        if self.found < self.trials {
            missed.push(format!("{} trials without a calibration", self.trials - self.found));
        }
        if self.ratio[0] < 1.0 - open || self.ratio[1] > 1.0 + open {
            missed.push(format!(
                "RMS error/predicted sigma beyond {:.2} to {:.2}",
                1.0 - open,
                1.0 + open
            ));
        }
        let (low, high) =
            (COVERAGE_RANGE.0.min(0.95 - open_share), COVERAGE_RANGE.1.max(0.95 + open_share));
        if !(low..=high).contains(&self.within_interval) {
            missed.push(format!("in 95 % beyond {:.1} to {:.1}", 100.0 * low, 100.0 * high));
        }
        missed
    }
}

fn of_bead(found: &[&Vec<CalibratedWidth>], bead: usize) -> BeadFigures {
    let outcomes = || found.iter().filter_map(|outcomes| outcomes.get(bead));
    let count = to_f64(outcomes().count().max(1));
    let mean = |value: fn(&CalibratedWidth) -> f64| outcomes().map(value).sum::<f64>() / count;
    BeadFigures {
        rms_error_fraction: mean(|o| (o.error_mm / o.width_mm).powi(2)).sqrt(),
        ratio: mean(|o| (o.error_mm / o.sigma_mm).powi(2)).sqrt(),
        bias_over_sigma: mean(|o| o.error_mm / o.sigma_mm),
    }
}

impl FigureRow for CalibrationFigures {
    const HEADS: &str = "camera|from|views|noise px|trials|RMS error % of width|\
                         RMS error/predicted sigma|in 95 %|bias/σ|limits";

    fn cells(&self) -> Vec<String> {
        let percent = self.rms_error_fraction.map(|fraction| 100.0 * fraction);
        vec![
            self.case.to_owned(),
            self.source.to_owned(),
            self.views.to_string(),
            self.noise_px.map_or_else(|| "–".to_owned(), |px| px.to_string()),
            self.found.to_string(),
            format!("{:.4}–{:.4}", percent[0], percent[1]),
            format!("{:.2}–{:.2}", self.ratio[0], self.ratio[1]),
            number(100.0 * self.within_interval, 1),
            number(self.bias_over_sigma, 2),
            verdict(&self.missed),
        ]
    }
}
