//! Figures compared with the limits of their set.

use super::figures::{Miss, SetFigures};
use super::sets::SetLimits;

/// A figure and its limits.
#[derive(Clone, Copy)]
struct Check {
    figure: &'static str,
    /// 100 for fractions that are shown in percent.
    scale: f64,
    value: Option<f64>,
    min: Option<f64>,
    max: Option<f64>,
}

impl Check {
    fn miss(self) -> Option<Miss> {
        let below = self.min.filter(|least| self.value.is_none_or(|value| value < *least));
        let above = self.max.filter(|most| self.value.is_none_or(|value| value > *most));
        below.or(above).map(|limit| Miss {
            figure: self.figure,
            value: self.value.map(|value| self.scale * value),
            limit: self.scale * limit,
        })
    }
}

fn at_most(figure: &'static str, value: Option<f64>, max: Option<f64>) -> Check {
    Check { figure, scale: 1.0, value: value.map(f64::abs), min: None, max }
}

fn within(figure: &'static str, value: Option<f64>, range: Option<[f64; 2]>) -> Check {
    let (min, max) = (range.map(|range| range[0]), range.map(|range| range[1]));
    Check { figure, scale: 1.0, value, min, max }
}

fn percent(check: Check) -> Check {
    Check { scale: 100.0, ..check }
}

/// The figures that miss their limit; a figure without a value misses every limit that it has.
pub fn misses(limits: &SetLimits, figures: &SetFigures) -> Vec<Miss> {
    let (measured, silent) = (Some(figures.measured_fraction), Some(figures.silent_fraction));
    let enough = limits.measured_fraction.map(|least| [least, 1.0]);
    let checks = [
        at_most("bias px", figures.bias_px, limits.bias_px),
        at_most("bias mm", figures.bias_mm, limits.bias_mm),
        at_most("RMSE px", figures.rmse_px, limits.rmse_px),
        at_most("RMSE mm", figures.rmse_mm, limits.rmse_mm),
        at_most("RMSE/free bound", figures.rmse_over_free_bound, limits.rmse_over_free_bound),
        percent(within("measured %", measured, enough)),
        percent(at_most("silent %", silent, limits.silent_fraction)),
        within("RMS e/σ", figures.rms_over_sigma, limits.rms_over_sigma),
        percent(within("in 95 %", figures.within_interval, limits.within_interval)),
    ];
    checks.into_iter().filter_map(Check::miss).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures() -> SetFigures {
        SetFigures {
            set: "a set",
            frames: 1000,
            bias_px: Some(-0.04),
            rmse_px: Some(0.05),
            bound_px: 0.04,
            rmse_over_bound: Some(1.25),
            free_bound_px: 0.05,
            rmse_over_free_bound: Some(1.0),
            bias_mm: Some(-0.004),
            rmse_mm: Some(0.005),
            measured_fraction: 0.99,
            silent_fraction: 1e-4,
            rms_over_sigma: Some(0.9),
            within_interval: Some(0.97),
            kept: None,
            missed: Vec::new(),
        }
    }

    #[test]
    fn a_figure_at_its_limit_keeps_it() {
        assert_eq!(misses(&SetLimits::DISTURBED, &figures()), []);
        assert_eq!(misses(&SetLimits::TRUST, &figures()), []);
        assert_eq!(misses(&SetLimits::default(), &figures()), []);
    }

    #[test]
    fn a_miss_names_the_figure_and_what_it_was_to_be() {
        let said = |limits, figures: SetFigures| -> Vec<String> {
            misses(&limits, &figures).iter().map(Miss::to_string).collect()
        };
        let expected = ["bias px 0.04 > 0.005", "measured % 99 < 100"];
        assert_eq!(said(SetLimits::CLEAN, figures()), expected);
        let silent = SetFigures { silent_fraction: 2e-4, ..figures() };
        assert_eq!(said(SetLimits::CORNER, silent), ["silent % 0.02 > 0.01"]);
        let wary = SetFigures { rms_over_sigma: Some(0.5), ..figures() };
        assert_eq!(said(SetLimits::TRUST, wary), ["RMS e/σ 0.5 < 0.9"]);
        let nothing = SetFigures { bias_px: None, ..figures() };
        assert_eq!(said(SetLimits::CURVE, nothing), ["bias px none"]);
    }
}
