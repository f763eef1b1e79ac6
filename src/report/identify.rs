//! A model from logged data: what was found, whether it can be trusted, and the
//! files that tell it.

mod curves;
mod doubts;
mod json;
mod model;
mod page;
mod refusal;
pub mod starts;
mod table;

use crate::identify::ahead::ahead;
use crate::identify::experiment::Experiment;
use crate::identify::fit::{
    Before, Comparison, Fit, FitError, Note, Row, Samples, SamplesError, Settings, SteadyGain,
    compare,
};
use crate::identify::residual::Autocorrelation;
use crate::numeric::lti::Between;

pub use json::to_json;
pub use model::{Logs, Study, form};
pub use page::page;
pub use refusal::Refusal;
pub use table::text;

/// A gain that differs by so many standard errors and by this share of itself
/// once a line in time is taken off is that of a drift…
const CERTAIN_SIGMAS: f64 = 5.0;
const CERTAIN_SHARE: f64 = 0.2;
/// …and one that differs by so much may be.
const LIKELY_SIGMAS: f64 = 4.0;
const LIKELY_SHARE: f64 = 0.03;

/// Lags of the residuals that are looked at, at most.
const LAGS: usize = 300;

/// Fits all forms and takes one, or says why none can be trusted.
pub fn study(logs: Logs, forms: &[Settings]) -> Result<Study, Refusal> {
    let estimation = samples(&logs.estimation)?;
    let validation = logs.validation.as_ref().map(|(data, _)| samples(data)).transpose()?;
    let before = if logs.from_rest { Before::SettledAtFirst } else { Before::Unknown };
    // What is left of one log does not begin at rest.
    let is_rest_of_it = logs.validation.as_ref().is_some_and(|(_, from)| *from == logs.source);
    let before_validation = if is_rest_of_it { Before::Unknown } else { before };
    let held = logs.estimation.input_is_held;
    let between = if held { Between::Held } else { Between::Linear };
    let forms: Vec<Settings> =
        forms.iter().map(|form| Settings { between, before, ..*form }).collect();
    let others = validation.as_ref().map(|samples| (samples, before_validation));
    let comparison = compare(&estimation, others, &forms);
    let chosen = comparison.chosen.and_then(|at| comparison.rows.get(at));
    let fits = chosen.and_then(|row| row.fit.as_ref().ok());
    if let Some(ahead) = forms.first().and_then(|form| ahead(&estimation, form, fits)) {
        return Err(Refusal::Ahead(ahead));
    }
    let Some((Ok(fit), quality)) = chosen.map(|row| (row.fit.clone(), row.validation)) else {
        return Err(none(&comparison, &logs));
    };
    if let Some(quality) = quality.filter(|quality| quality.fit_percent <= 0.0) {
        return Err(Refusal::Foretells {
            form: form(fit.settings.structure),
            estimation: fit.quality.fit_percent,
            validation: quality.fit_percent,
            drift: doubts::of_output(&logs),
        });
    }
    let steady = SteadyGain::of(&estimation, &fit.settings);
    if let Some(found) = steady.filter(|steady| is_another(steady, &fit)) {
        return Err(Refusal::Drifts {
            form: form(fit.settings.structure),
            gain: fit.model.dc_gain(),
            steady: found.gain,
            sigma: found.sigma,
        });
    }
    let foretold = others.and_then(|(samples, before)| fit.predict(samples, before).ok());
    let residuals = Autocorrelation::of(&fit.residuals, LAGS.min(fit.residuals.len() / 4));
    let mut study = Study {
        logs,
        comparison,
        fit,
        validation: quality,
        foretold,
        residuals,
        warnings: Vec::new(),
    };
    study.warnings = study.doubts();
    study.warnings.extend(steady.and_then(|steady| other_gain(&study, &steady)));
    Ok(study)
}

/// Whether a model's gain is that of a drift.
fn is_another(steady: &SteadyGain, fit: &Fit) -> bool {
    let (sigmas, share) = steady.apart(fit.model.dc_gain());
    sigmas > CERTAIN_SIGMAS && share > CERTAIN_SHARE
}

fn samples(data: &Experiment) -> Result<Samples, SamplesError> {
    let samples = Samples::new(data.input.clone(), data.output.clone(), data.step_s)?;
    samples.check_clipped()?;
    Ok(samples)
}

fn refused(row: &Row) -> (String, String) {
    let why = match &row.fit {
        Err(error) => error.to_string(),
        Ok(fit) => fit.notes.iter().find_map(undetermined).unwrap_or_default(),
    };
    (form(row.settings.structure), why)
}

fn undetermined(note: &Note) -> Option<String> {
    let Note::Undetermined(loose) = note else { return None };
    Some(FitError::Undetermined(loose.clone()).to_string())
}

fn none(comparison: &Comparison, logs: &Logs) -> Refusal {
    let is_told = |row: &Row| matches!(row.fit, Err(FitError::Drift { .. }));
    let drift = doubts::of_output(logs).filter(|_| !comparison.rows.iter().any(is_told));
    Refusal::None { forms: comparison.rows.iter().map(refused).collect(), drift }
}

/// What is said of a gain that a drift may have moved.
fn other_gain(study: &Study, steady: &SteadyGain) -> Option<String> {
    let gain = study.fit.model.dc_gain();
    let (sigmas, share) = steady.apart(gain);
    (sigmas > LIKELY_SIGMAS && share > LIKELY_SHARE).then(|| {
        format!(
            "the gain is {gain:.4}, but {:.4} ± {:.4} once a straight line in time is taken off \
             input and output: the output drifts, and the model follows it in part",
            steady.gain, steady.sigma
        )
    })
}

#[cfg(test)]
mod tests;
