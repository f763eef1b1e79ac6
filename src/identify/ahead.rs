//! An output that answers before its input: two clocks that differ, or a loop that
//! moves the input after the output.
//!
//! The input is brought forward, so that a dead time below that lead is an output
//! which is ahead. It counts where such a model fits much better than every one
//! that only answers.

use super::fit::{Before, DeadTime, Fit, Note, Samples, Settings, Structure, fit};
use crate::numeric::number::float;

/// The output is looked for ahead by up to this share of the record…
const LEAD_SHARE: f64 = 0.125;
/// …and up to this \[s\].
const LEAD_S: f64 = 10.0;
/// Shares of that which are tried: dead times are looked for on a grid that is
/// coarse where their range is wide.
const SHARES: [f64; 3] = [1.0, 0.25, 0.0625];
/// What a model that runs ahead may leave at the most, of the squares of the best
/// that does not.
const BETTER: f64 = 0.8;
/// The same as a likelihood ratio over independent samples.
const SURE: f64 = 20.0;
/// A fit below this tells nothing of clocks \[%\].
const LEAST_PERCENT: f64 = 30.0;
/// A model that fits less well than this may be of an output that is ahead \[%\].
const POOR_PERCENT: f64 = 50.0;
/// By how many standard errors the output must be ahead, and a dead time be seen.
const SIGMAS: f64 = 3.0;
/// A model slower than this share of the record may follow a drift.
const SLOW_SHARE: f64 = 1.0 / 3.0;

/// Forms that are tried ahead.
const AHEAD: [Structure; 3] = [
    Structure::FirstOrder { zero: false },
    Structure::SecondOrderOscillating { zero: false },
    Structure::SecondOrderOscillating { zero: true },
];
/// Further forms that only answer: a lead looks like an output that is ahead.
const ANSWERING: [Structure; 2] =
    [Structure::FirstOrder { zero: true }, Structure::Transfer { poles: 3, zeros: 2 }];

/// An output that is ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ahead {
    /// By how much about, with the form that fits best \[s\].
    pub ahead_s: f64,
    /// Standard error of that \[s\].
    pub sigma_s: f64,
    /// Fit of a model that runs ahead \[%\].
    pub fit_percent: f64,
    /// Fit of the best that only answers \[%\]; 0 where none stands.
    pub answering_percent: f64,
}

/// Whether the output is ahead; not looked for where the model that was found has
/// a dead time and fits.
pub fn ahead(samples: &Samples, settings: &Settings, found: Option<&Fit>) -> Option<Ahead> {
    if found.is_some_and(|fit| is_late(fit) && fit.quality.fit_percent >= POOR_PERCENT) {
        return None;
    }
    let most_s = (LEAD_SHARE * samples.duration_s()).min(LEAD_S);
    // Once to see about where, and again from near there: what the input did
    // before the record is not known for as long as the dead time.
    let leads =
        SHARES.iter().filter_map(|share| brought_forward(samples, settings, share * most_s));
    let (lead_s, first) =
        leads.max_by(|a, b| a.1.quality.fit_percent.total_cmp(&b.1.quality.fit_percent))?;
    let about_s = lead_s - first.parameter("dead_time_s")?.value;
    let near_s = (1.5 * about_s + 2.0 * samples.dt_s()).min(most_s);
    let (lead_s, fit) = brought_forward(samples, settings, near_s)?;
    let dead_time = fit.parameter("dead_time_s")?;
    let (ahead_s, sigma_s) = (lead_s - dead_time.value, dead_time.sigma);
    let is_ahead = ahead_s > SIGMAS * sigma_s && ahead_s > 1.5 * samples.dt_s();
    let slow = fit.model.poles().iter().any(|p| -p.re * SLOW_SHARE * samples.duration_s() < 1.0);
    if !is_ahead || slow || fit.quality.fit_percent < LEAST_PERCENT {
        return None;
    }
    let usual = answering(&cut(samples, 0, fit.residuals.len())?, settings);
    let answering_percent = found.map_or(usual, |found| usual.max(found.quality.fit_percent));
    let ratio = share_left(fit.quality.fit_percent) / share_left(answering_percent);
    let is_better = ratio < BETTER && -fit.independent_samples * libm::log(ratio) > SURE;
    is_better.then_some(Ahead {
        ahead_s,
        sigma_s,
        fit_percent: fit.quality.fit_percent,
        answering_percent,
    })
}

fn is_late(fit: &Fit) -> bool {
    let to_a_step = |note: &Note| matches!(note, Note::DeadTimeToAStep { .. });
    match fit.parameter("dead_time_s") {
        Some(dead_time) => dead_time.value > SIGMAS * dead_time.sigma,
        None if fit.notes.iter().any(to_a_step) => fit.model.dead_time_s() > 0.0,
        None => fit.model.dead_time_s() > 0.0 && !fit.notes.contains(&Note::NoDeadTime),
    }
}

/// Share of the output's squares that a fit leaves.
fn share_left(fit_percent: f64) -> f64 {
    let left = (1.0 - 0.01 * fit_percent).max(1e-9);
    left * left
}

/// The best model of the output by an input that comes so much earlier, in whole
/// steps.
fn brought_forward(samples: &Samples, settings: &Settings, lead_s: f64) -> Option<(f64, Fit)> {
    let dt_s = samples.dt_s();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative")]
    let steps = (lead_s / dt_s).floor().max(0.0) as usize;
    let lead_s = float(steps) * dt_s;
    let forward = cut(samples, steps, samples.len().checked_sub(steps)?)?;
    let range = DeadTime::Estimated { least_s: 0.0, most_s: 2.0 * lead_s.max(dt_s) };
    let fits = AHEAD.iter().filter_map(|form| tried(&forward, settings, *form, range));
    Some((lead_s, fits.min_by(|a, b| a.quality.rmse.total_cmp(&b.quality.rmse))?))
}

/// Fit of the best model that only answers \[%\].
fn answering(samples: &Samples, settings: &Settings) -> f64 {
    let most_s = (LEAD_SHARE * samples.duration_s()).min(LEAD_S);
    let range = DeadTime::Estimated { least_s: 0.0, most_s };
    let forms = AHEAD.iter().chain(&ANSWERING);
    let fits = forms.filter_map(|form| tried(samples, settings, *form, range));
    fits.map(|fit| fit.quality.fit_percent).fold(0.0, f64::max)
}

fn tried(
    samples: &Samples,
    settings: &Settings,
    structure: Structure,
    dead_time: DeadTime,
) -> Option<Fit> {
    let before = Before::Unknown;
    let settings =
        Settings { structure, dead_time, before, accept_undetermined: true, ..*settings };
    fit(samples, &settings).ok()
}

/// The first samples of the output, with those of the input from a later one on.
fn cut(samples: &Samples, from: usize, count: usize) -> Option<Samples> {
    let input = samples.input().get(from..from + count)?.to_vec();
    Samples::new(input, samples.output().get(..count)?.to_vec(), samples.dt_s()).ok()
}

#[cfg(test)]
mod tests;
