//! Identification of a model from logged data: fit, validation, and the result files.

mod curves;
mod json;
mod model;
mod page;
mod refusal;
pub mod starts;
mod table;

use crate::identify::autocorrelation::Autocorrelation;
use crate::identify::experiment::Experiment;
use crate::identify::fit::{
    ComparedModel, DetrendedGain, Fit, FitError, FitNote, FitSettings, InitialCondition,
    ModelComparison, Samples, SamplesError, compare,
};
use crate::identify::output_lead::output_lead;
use crate::numeric::lti::Between;

pub use json::to_json;
pub use model::{Logs, ModelStudy, form};
pub use page::page;
pub use refusal::NoModel;
pub use table::text;

/// A gain is attributed to a drift if it changes by more standard errors and by a larger fraction
/// than this when a linear drift is removed.
const CERTAIN_SIGMAS: f64 = 5.0;
const CERTAIN_FRACTION: f64 = 0.2;
/// A change of the gain above which a drift is possible, in standard errors and as a fraction.
const LIKELY_SIGMAS: f64 = 4.0;
const LIKELY_FRACTION: f64 = 0.03;

/// Largest number of lags of the residuals' autocorrelation.
const LAGS: usize = 300;

/// Fits all forms and chooses the best model. Fails with the reasons if no form is accepted.
pub fn study(logs: Logs, forms: &[FitSettings]) -> Result<ModelStudy, NoModel> {
    let estimation = samples(&logs.estimation)?;
    let validation = logs.validation.as_ref().map(|(data, _)| samples(data)).transpose()?;
    let before =
        if logs.from_rest { InitialCondition::SettledAtFirst } else { InitialCondition::Unknown };
    // The last part of a log does not begin at rest.
    let is_rest_of_it = logs.validation.as_ref().is_some_and(|(_, from)| *from == logs.source);
    let before_validation = if is_rest_of_it { InitialCondition::Unknown } else { before };
    let held = logs.estimation.input_is_held;
    let between = if held { Between::Held } else { Between::Linear };
    let forms: Vec<FitSettings> =
        forms.iter().map(|form| FitSettings { between, initial_state: before, ..*form }).collect();
    let others = validation.as_ref().map(|samples| (samples, before_validation));
    let comparison = compare(&estimation, others, &forms);
    let chosen = comparison.chosen.and_then(|at| comparison.rows.get(at));
    let fits = chosen.and_then(|row| row.fit.as_ref().ok());
    if let Some(ahead) = forms.first().and_then(|form| output_lead(&estimation, form, fits)) {
        return Err(NoModel::Ahead(ahead));
    }
    let Some((Ok(fit), quality)) = chosen.map(|row| (row.fit.clone(), row.validation)) else {
        return Err(none(&comparison, &logs));
    };
    if let Some(quality) = quality.filter(|quality| quality.fit_percent <= 0.0) {
        return Err(NoModel::PoorPrediction {
            form: form(fit.settings.structure),
            estimation: fit.quality.fit_percent,
            validation: quality.fit_percent,
            drift: warnings::output_drift(&logs),
        });
    }
    let steady = DetrendedGain::of(&estimation, &fit.settings);
    if let Some(found) = steady.filter(|steady| is_drift_gain(steady, &fit)) {
        return Err(NoModel::Drifts {
            form: form(fit.settings.structure),
            gain: fit.model.dc_gain(),
            steady: found.gain,
            sigma: found.sigma,
        });
    }
    let predicted = others.and_then(|(samples, before)| fit.predict(samples, before).ok());
    let residuals = Autocorrelation::of(&fit.residuals, LAGS.min(fit.residuals.len() / 4));
    let mut study = ModelStudy {
        logs,
        comparison,
        fit,
        validation: quality,
        predicted,
        residuals,
        warnings: Vec::new(),
    };
    study.warnings = study.all_warnings();
    study.warnings.extend(steady.and_then(|steady| other_gain(&study, &steady)));
    Ok(study)
}

/// Whether a model's gain must be attributed to a drift.
fn is_drift_gain(steady: &DetrendedGain, fit: &Fit) -> bool {
    let (sigmas, fraction) = steady.difference(fit.model.dc_gain());
    sigmas > CERTAIN_SIGMAS && fraction > CERTAIN_FRACTION
}

fn samples(data: &Experiment) -> Result<Samples, SamplesError> {
    let samples = Samples::new(data.input.clone(), data.output.clone(), data.step_s)?;
    samples.check_clipped()?;
    Ok(samples)
}

fn refused(row: &ComparedModel) -> (String, String) {
    let why = match &row.fit {
        Err(error) => error.to_string(),
        Ok(fit) => fit.notes.iter().find_map(undetermined).unwrap_or_default(),
    };
    (form(row.settings.structure), why)
}

fn undetermined(note: &FitNote) -> Option<String> {
    let FitNote::Undetermined(loose) = note else { return None };
    Some(FitError::Undetermined(loose.clone()).to_string())
}

fn none(comparison: &ModelComparison, logs: &Logs) -> NoModel {
    let is_given = |row: &ComparedModel| matches!(row.fit, Err(FitError::Drift { .. }));
    let drift = warnings::output_drift(logs).filter(|_| !comparison.rows.iter().any(is_given));
    NoModel::None { forms: comparison.rows.iter().map(refused).collect(), drift }
}

/// Warning about a gain that a drift may have changed; `None` without such a change.
fn other_gain(study: &ModelStudy, steady: &DetrendedGain) -> Option<String> {
    let gain = study.fit.model.dc_gain();
    let (sigmas, fraction) = steady.difference(gain);
    (sigmas > LIKELY_SIGMAS && fraction > LIKELY_FRACTION).then(|| {
        format!(
            "the gain is {gain:.4}, but {:.4} ± {:.4} once a straight line in time is taken off \
             input and output: the output drifts, and the model follows it in part",
            steady.gain, steady.sigma
        )
    })
}

#[cfg(test)]
mod tests;
pub mod warnings;
