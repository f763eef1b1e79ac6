//! How well widths are measured: figures of sets of images with their truth.

pub mod calibration_table;
pub mod calibrations;
pub mod drawn;
pub mod drawn_table;
mod figures;
pub mod roughness_table;
pub mod sets;
pub mod studio;
pub mod table;
mod verdict;

use crate::numeric::statistics::Moments;
use figures::fraction;
use sets::{Set, SetLimits};

pub use figures::{Miss, SetFigures, WidthError};

/// Error from which a reported width is silently wrong \[px\]. By definition of the column
/// "silent %", half a pixel.
const SILENT_PX: f64 = 0.5;
/// Half the 95 % interval in standard deviations. Derived: Φ⁻¹(0.975) = 1.96.
const INTERVAL_SIGMAS: f64 = 1.96;

impl SetFigures {
    /// Figures of a set whose pixels have a size of `mm_per_px` \[mm/px\]; `None` is a rejected
    /// frame.
    pub fn of(set: &Set, mm_per_px: f64, outcomes: &[Option<WidthError>]) -> Self {
        let mut figures = Self::without_verdict(set, mm_per_px, outcomes);
        figures.missed = verdict::misses(&set.limits, &figures);
        figures.kept = (set.limits != SetLimits::default()).then_some(figures.missed.is_empty());
        figures
    }

    fn without_verdict(set: &Set, mm_per_px: f64, outcomes: &[Option<WidthError>]) -> Self {
        let (mut errors, mut ratios) = (Moments::default(), Moments::default());
        let (mut silent, mut within) = (0_usize, 0_usize);
        for outcome in outcomes.iter().flatten() {
            let ratio = outcome.error_mm / outcome.sigma_mm;
            errors.add(outcome.error_mm);
            ratios.add(ratio);
            silent += usize::from(outcome.error_mm.abs() > SILENT_PX * mm_per_px);
            within += usize::from(ratio.abs() <= INTERVAL_SIGMAS);
        }
        let (bias_mm, rmse_mm) = (errors.mean(), errors.rms());
        let rmse_px = rmse_mm.map(|rmse| rmse / mm_per_px);
        let (bound_px, free_bound_px) = (set.cramer_rao_px(), set.free_cramer_rao_px());
        let measured = outcomes.iter().flatten().count();
        Self {
            set: set.name,
            frames: outcomes.len(),
            bias_px: bias_mm.map(|bias| bias / mm_per_px),
            rmse_px,
            bound_px,
            rmse_over_bound: rmse_px.map(|rmse| rmse / bound_px),
            free_bound_px,
            rmse_over_free_bound: rmse_px.map(|rmse| rmse / free_bound_px),
            bias_mm,
            rmse_mm,
            measured_fraction: fraction(measured, outcomes.len()),
            silent_fraction: fraction(silent, outcomes.len()),
            rms_over_sigma: ratios.rms(),
            within_interval: (measured > 0).then(|| fraction(within, measured)),
            kept: None,
            missed: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::sets;
    use super::*;

    #[test]
    fn figures_are_counted_over_the_frames_they_are_of() {
        let set = sets::all().into_iter().find(|set| set.name == "tilted").unwrap();
        let outcome = |error_mm| Some(WidthError { error_mm, sigma_mm: 0.01 });
        let outcomes = [outcome(0.003), outcome(-0.005), outcome(0.062), None];
        let figures = SetFigures::of(&set, 0.1, &outcomes);
        assert!((figures.bias_px.unwrap() - 0.2).abs() < 1e-12);
        let mean_square = (0.003_f64.powi(2) + 0.005_f64.powi(2) + 0.062_f64.powi(2)) / 3.0;
        assert!((figures.rmse_mm.unwrap() - mean_square.sqrt()).abs() < 1e-12);
        assert_eq!((figures.measured_fraction, figures.silent_fraction), (0.75, 0.25));
        assert!((figures.within_interval.unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(figures.kept, Some(false));
        let free = sets::Set { limits: SetLimits::default(), ..set };
        assert_eq!(SetFigures::of(&free, 0.1, &outcomes).kept, None);
    }
}
