//! Comparison of several models of the same data.

use super::autoregression::ArModel;
use super::error::FitError;
use super::estimate::Fit;
use super::quality::FitQuality;
use super::samples::Samples;
use super::settings::{FitSettings, InitialCondition};
use crate::numeric::number::to_f64;
use crate::numeric::row::dot;

/// A compared model.
#[derive(Debug, Clone)]
pub struct ComparedModel {
    /// Its settings.
    pub settings: FitSettings,
    /// The fit, or why there is none.
    pub fit: Result<Fit, FitError>,
    /// Its quality on validation data, if there are any.
    pub validation: Option<FitQuality>,
    /// Schwarz's criterion (BIC) with the number of independent samples of the best model's
    /// residuals; less is better. `None` without a fit.
    pub bic: Option<f64>,
}

/// All models and the selected one.
#[derive(Debug, Clone)]
pub struct ModelComparison {
    /// In the given order.
    pub rows: Vec<ComparedModel>,
    /// Index of the selected model; `None` without a valid fit.
    pub chosen: Option<usize>,
    /// Why it was selected.
    pub reason: String,
}

/// Fits a list of models and selects one. With validation data: the one with the fewest
/// parameters whose mean squared error exceeds the least one by no more than the standard error
/// of the difference. Without: the one of least BIC, in independent samples. Models with
/// undetermined parameters are listed and not selected.
pub fn compare(
    estimation: &Samples,
    validation: Option<(&Samples, InitialCondition)>,
    candidates: &[FitSettings],
) -> ModelComparison {
    let mut rows = Vec::new();
    let mut errors: Vec<Option<Vec<f64>>> = Vec::new();
    for settings in candidates {
        let fit = super::fit(estimation, &FitSettings { accept_undetermined: true, ..*settings });
        let (quality, squares) = match (&fit, validation) {
            (Ok(fit), Some((samples, before))) => validate_on(fit, samples, before),
            _ => (None, None),
        };
        rows.push(ComparedModel { settings: *settings, fit, validation: quality, bic: None });
        errors.push(squares);
    }
    fill_bic(&mut rows);
    let (chosen, reason) = match validation {
        Some(_) => by_validation(&rows, &errors),
        None => by_bic(&rows),
    };
    ModelComparison { rows, chosen, reason }
}

/// Quality and squared errors on other data.
fn validate_on(
    fit: &Fit,
    samples: &Samples,
    before: InitialCondition,
) -> (Option<FitQuality>, Option<Vec<f64>>) {
    let Ok(predicted) = fit.predict(samples, before) else { return (None, None) };
    let squares = samples.output().iter().zip(&predicted).map(|(y, p)| (y - p) * (y - p));
    (FitQuality::of(samples.output(), &predicted), Some(squares.collect()))
}

fn fill_bic(rows: &mut [ComparedModel]) {
    let fits = || rows.iter().filter_map(|row| row.fit.as_ref().ok());
    let best = fits().min_by(|a, b| a.residual_sigma.total_cmp(&b.residual_sigma));
    let Some(independent) = best.map(|fit| fit.independent_samples) else { return };
    for row in rows {
        row.bic = row.fit.as_ref().ok().map(|fit| {
            let variance = (fit.quality.rmse * fit.quality.rmse).max(f64::MIN_POSITIVE);
            let k = to_f64(fit.estimated);
            independent * libm::log(variance) + k * libm::log(independent.max(2.0))
        });
    }
}

fn stands(row: &ComparedModel) -> bool {
    row.fit.as_ref().is_ok_and(Fit::is_determined)
}

fn describe(row: &ComparedModel) -> String {
    let structure = row.settings.structure;
    format!("{} poles and {} zeros", structure.poles(), structure.zeros())
}

const NO_MODEL: &str = "no model stands; see why beside each";

fn by_bic(rows: &[ComparedModel]) -> (Option<usize>, String) {
    let standing = (0..rows.len()).filter(|&i| stands(&rows[i]));
    let of = |i: usize| rows[i].bic.unwrap_or(f64::MAX);
    let Some(chosen) = standing.min_by(|a, b| of(*a).total_cmp(&of(*b))) else {
        return (None, NO_MODEL.to_owned());
    };
    let reason = format!(
        "{}: the least BIC, {:.1}, over independent samples; there are no validation data",
        describe(&rows[chosen]),
        of(chosen)
    );
    (Some(chosen), reason)
}

fn by_validation(rows: &[ComparedModel], errors: &[Option<Vec<f64>>]) -> (Option<usize>, String) {
    let fit = |i: usize| rows[i].validation.map_or(f64::MIN, |quality| quality.fit_percent);
    let standing: Vec<usize> =
        (0..rows.len()).filter(|&i| stands(&rows[i]) && errors[i].is_some()).collect();
    let Some(&best) = standing.iter().max_by(|a, b| fit(**a).total_cmp(&fit(**b))) else {
        return (None, NO_MODEL.to_owned());
    };
    let size = |i: usize| rows[i].fit.as_ref().map_or(usize::MAX, |fit| fit.estimated);
    let as_good = |i: usize| match (&errors[i], &errors[best]) {
        (Some(a), Some(b)) => i == best || no_worse(a, b),
        _ => false,
    };
    let chosen = standing
        .iter()
        .copied()
        .filter(|&i| as_good(i))
        .min_by(|a, b| size(*a).cmp(&size(*b)).then(fit(*b).total_cmp(&fit(*a))))
        .unwrap_or(best);
    let reason = if chosen == best {
        format!(
            "{}: the best fit on the validation data, {:.1} %",
            describe(&rows[best]),
            fit(best)
        )
    } else {
        format!(
            "{}: {:.1} % on the validation data, with fewer parameters than {} of {:.1} %, which \
             is better by less than the standard error of the difference",
            describe(&rows[chosen]),
            fit(chosen),
            describe(&rows[best]),
            fit(best)
        )
    };
    (Some(chosen), reason)
}

/// Whether a mean of squared errors exceeds another one by no more than the standard error of
/// the difference.
fn no_worse(a: &[f64], b: &[f64]) -> bool {
    let samples = a.len().min(b.len());
    let n = to_f64(samples.max(1));
    let mean = a.iter().zip(b).map(|(a, b)| a - b).sum::<f64>() / n;
    let about: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b - mean).collect();
    let variance = dot(&about, &about) / n;
    mean <= (variance / ArModel::of(&about).effective_samples(samples)).sqrt()
}
