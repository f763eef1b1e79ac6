//! An output that leads its input: two clocks that differ, or a loop that changes the input
//! after the output.
//!
//! The input is advanced, so that a dead time below that advance is a lead of the output. The
//! lead is reported where such a model fits much better than every causal one.

use super::fit::{DeadTime, Fit, FitNote, FitSettings, InitialCondition, Samples, Structure, fit};
use crate::numeric::number::{to_count, to_f64};

/// Largest lead over the length of the record…
const LEAD_FRACTION: f64 = 0.125;
/// …and in seconds \[s\].
const MAX_LEAD_S: f64 = 10.0;
/// Fractions of that lead that are tried, because dead times are searched on a grid that is
/// coarse for a wide range.
const LEAD_FRACTIONS: [f64; 3] = [1.0, 0.25, 0.0625];
/// Largest sum of squared residuals with a lead over that of the best causal model.
const MAX_RESIDUAL_RATIO: f64 = 0.8;
/// Smallest likelihood ratio of a model with a lead to that causal model, over independent samples.
/// A choice: far above the 3.84 of χ² at 95 %.
const MIN_LIKELIHOOD_RATIO: f64 = 20.0;
/// Fit below which nothing is concluded about the clocks \[%\].
const MIN_FIT_PERCENT: f64 = 30.0;
/// Fit below which an output may lead \[%\].
const POOR_FIT_PERCENT: f64 = 50.0;
/// Standard errors of a significant lead or dead time. A choice.
const MIN_SIGMAS: f64 = 3.0;
/// A time constant over the record above which a model may follow a drift.
const SLOW_FRACTION: f64 = 1.0 / 3.0;

/// Structures that are tried with a lead.
const LEADING_FORMS: [Structure; 3] = [
    Structure::FirstOrder { zero: false },
    Structure::SecondOrderOscillating { zero: false },
    Structure::SecondOrderOscillating { zero: true },
];
/// Further causal structures: a zero looks like a lead of the output.
const CAUSAL_FORMS: [Structure; 2] =
    [Structure::FirstOrder { zero: true }, Structure::Transfer { poles: 3, zeros: 2 }];

/// An output that leads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutputLead {
    /// The lead with the best structure \[s\].
    pub lead_s: f64,
    /// Standard error of that \[s\].
    pub sigma_s: f64,
    /// Fit of the model with a lead \[%\].
    pub fit_percent: f64,
    /// Fit of the best causal model \[%\]; 0 without one.
    pub causal_fit_percent: f64,
}

/// Whether the output leads; not checked where the model has a dead time and fits well.
pub fn output_lead(
    samples: &Samples,
    settings: &FitSettings,
    found: Option<&Fit>,
) -> Option<OutputLead> {
    if found.is_some_and(|fit| has_dead_time(fit) && fit.quality.fit_percent >= POOR_FIT_PERCENT) {
        return None;
    }
    let most_s = (LEAD_FRACTION * samples.duration_s()).min(MAX_LEAD_S);
    // First a rough estimate, then again near it: the input before the record is unknown for as
    // long as the dead time.
    let leads = LEAD_FRACTIONS
        .iter()
        .filter_map(|fraction| with_lead(samples, settings, fraction * most_s));
    let (lead_s, first) =
        leads.max_by(|a, b| a.1.quality.fit_percent.total_cmp(&b.1.quality.fit_percent))?;
    let about_s = lead_s - first.parameter("dead_time_s")?.value;
    let near_s = (1.5 * about_s + 2.0 * samples.dt_s()).min(most_s);
    let (lead_s, fit) = with_lead(samples, settings, near_s)?;
    let dead_time = fit.parameter("dead_time_s")?;
    let (lead_s, sigma_s) = (lead_s - dead_time.value, dead_time.sigma);
    let is_ahead = lead_s > MIN_SIGMAS * sigma_s && lead_s > 1.5 * samples.dt_s();
    let slow = fit.model.poles().iter().any(|p| -p.re * SLOW_FRACTION * samples.duration_s() < 1.0);
    if !is_ahead || slow || fit.quality.fit_percent < MIN_FIT_PERCENT {
        return None;
    }
    let usual = causal_fit_percent(&shifted(samples, 0, fit.residuals.len())?, settings);
    let causal_fit_percent = found.map_or(usual, |found| usual.max(found.quality.fit_percent));
    let fit_percent = fit.quality.fit_percent;
    let ratio = residual_fraction(fit_percent) / residual_fraction(causal_fit_percent);
    let is_better = ratio < MAX_RESIDUAL_RATIO
        && -fit.independent_samples * libm::log(ratio) > MIN_LIKELIHOOD_RATIO;
    is_better.then_some(OutputLead { lead_s, sigma_s, fit_percent, causal_fit_percent })
}

fn has_dead_time(fit: &Fit) -> bool {
    let to_a_step = |note: &FitNote| matches!(note, FitNote::DeadTimeToAStep { .. });
    match fit.parameter("dead_time_s") {
        Some(dead_time) => dead_time.value > MIN_SIGMAS * dead_time.sigma,
        None if fit.notes.iter().any(to_a_step) => fit.model.dead_time_s() > 0.0,
        None => fit.model.dead_time_s() > 0.0 && !fit.notes.contains(&FitNote::NoDeadTime),
    }
}

/// Fraction of the output's sum of squares in the residuals.
fn residual_fraction(fit_percent: f64) -> f64 {
    let left = (1.0 - 0.01 * fit_percent).max(1e-9);
    left * left
}

/// The best model for an input that is advanced by whole steps.
fn with_lead(samples: &Samples, settings: &FitSettings, lead_s: f64) -> Option<(f64, Fit)> {
    let dt_s = samples.dt_s();
    let steps = to_count((lead_s / dt_s).floor());
    let lead_s = to_f64(steps) * dt_s;
    let forward = shifted(samples, steps, samples.len().checked_sub(steps)?)?;
    let range = DeadTime::Estimated { min_s: 0.0, max_s: 2.0 * lead_s.max(dt_s) };
    let fits = LEADING_FORMS.iter().filter_map(|form| tried(&forward, settings, *form, range));
    Some((lead_s, fits.min_by(|a, b| a.quality.rmse.total_cmp(&b.quality.rmse))?))
}

/// Fit of the best causal model \[%\].
fn causal_fit_percent(samples: &Samples, settings: &FitSettings) -> f64 {
    let most_s = (LEAD_FRACTION * samples.duration_s()).min(MAX_LEAD_S);
    let range = DeadTime::Estimated { min_s: 0.0, max_s: most_s };
    let forms = LEADING_FORMS.iter().chain(&CAUSAL_FORMS);
    let fits = forms.filter_map(|form| tried(samples, settings, *form, range));
    fits.map(|fit| fit.quality.fit_percent).fold(0.0, f64::max)
}

fn tried(
    samples: &Samples,
    settings: &FitSettings,
    structure: Structure,
    dead_time: DeadTime,
) -> Option<Fit> {
    let (initial_state, accept_undetermined) = (InitialCondition::Unknown, true);
    let settings =
        FitSettings { structure, dead_time, initial_state, accept_undetermined, ..*settings };
    fit(samples, &settings).ok()
}

/// The first samples of the output with those of the input from a later one on.
fn shifted(samples: &Samples, from: usize, count: usize) -> Option<Samples> {
    let input = samples.input().get(from..from + count)?.to_vec();
    Samples::new(input, samples.output().get(..count)?.to_vec(), samples.dt_s()).ok()
}

#[cfg(test)]
mod tests;
