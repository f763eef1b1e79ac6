//! A model from logged data: what was found, whether it can be trusted, and the
//! files that tell it.

mod curves;
mod doubts;
mod json;
mod page;
pub mod starts;
mod table;

use crate::core::quantity::Quantity;
use crate::identify::ahead::{Ahead, ahead};
use crate::identify::experiment::Experiment;
use crate::identify::file::{self, ModelFile, Setting, Uncertainty};
use crate::identify::fit::{
    Before, Comparison, Fit, FitError, Note, Quality, Row, Samples, SamplesError, Settings,
    SteadyGain, Structure, compare,
};
use crate::identify::residual::Autocorrelation;
use crate::numeric::lti::Between;

pub use json::to_json;
pub use page::page;
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

/// Data and what they are called.
#[derive(Debug, Clone)]
pub struct Logs {
    /// What goes in.
    pub input: Quantity,
    /// What comes out.
    pub output: Quantity,
    /// Where the data are from.
    pub source: String,
    /// What the model is fitted to.
    pub estimation: Experiment,
    /// What it is validated with, and where that is from.
    pub validation: Option<(Experiment, String)>,
    /// Whether the logs begin at rest.
    pub from_rest: bool,
}

/// A model with all that is known of it.
#[derive(Debug)]
pub struct Study {
    /// The data.
    pub logs: Logs,
    /// All that were fitted.
    pub comparison: Comparison,
    /// The one that was taken.
    pub fit: Fit,
    /// How well it foretells other data.
    pub validation: Option<Quality>,
    /// What it foretells there.
    pub foretold: Option<Vec<f64>>,
    /// Whether what it leaves hangs together.
    pub residuals: Autocorrelation,
    /// What the reader should know before the model is used.
    pub warnings: Vec<String>,
}

/// No model that can be trusted.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// The data.
    #[error(transparent)]
    Data(#[from] SamplesError),
    /// None of the forms.
    #[error("no model can be trusted:{}{}", lines(.forms), beside(.drift.as_ref()))]
    None {
        /// Each form, and why it is none.
        forms: Vec<(String, String)>,
        /// What is said of an output that drifts.
        drift: Option<String>,
    },
    /// It does not foretell other data.
    #[error(
        "the model ({form}, {estimation:.1} % on its own data) does not foretell the data to \
         validate with: {validation:.1} %, no better than their mean. Are both of the same machine \
         and material, and is the input the one that moves the output?{}", further(.drift.as_ref())
    )]
    Foretells {
        /// Its form.
        form: String,
        /// Fit to its own data \[%\].
        estimation: f64,
        /// Fit to the others \[%\].
        validation: f64,
        /// What is said of an output that drifts.
        drift: Option<String>,
    },
    /// It follows a drift of the output.
    #[error(
        "the output drifts: the gain of the model ({form}) is {gain:.4}, but {steady:.4} ± {sigma:.4} \
         once a straight line in time is taken off input and output; what moves the output besides \
         the input is in the model. Hold temperature and feed steady, use a part without the drift \
         (--from-s, --to-s), or take the line out of the log"
    )]
    Drifts {
        /// Its form.
        form: String,
        /// Its gain.
        gain: f64,
        /// The gain without the line.
        steady: f64,
        /// Standard error of that.
        sigma: f64,
    },
    /// The output moves before the input does.
    #[error(
        "the output answers the input some {:.2} s before it comes: a model that may do so fits to \
         {:.1} %, the best that does not to {:.1} %. Are both on one clock, each sample with the \
         moment at which it was taken? A closed loop that moves the input after the output looks the \
         same", .0.ahead_s, .0.fit_percent, .0.answering_percent
    )]
    Ahead(Ahead),
}

/// A line for each reason, before it the forms that it holds for.
fn lines(refused: &[(String, String)]) -> String {
    let mut lines: Vec<(String, &str)> = Vec::new();
    for (form, why) in refused {
        match lines.iter_mut().find(|(_, said)| said == why) {
            Some((forms, _)) => *forms = format!("{forms}, {form}"),
            None => lines.push((form.clone(), why)),
        }
    }
    let lines: Vec<String> =
        lines.iter().map(|(forms, why)| format!("\n  {forms}: {why}")).collect();
    lines.concat()
}

fn none(comparison: &Comparison, logs: &Logs) -> Refusal {
    let is_told = |row: &Row| matches!(row.fit, Err(FitError::Drift { .. }));
    let drift = doubts::of_output(logs).filter(|_| !comparison.rows.iter().any(is_told));
    Refusal::None { forms: comparison.rows.iter().map(refused).collect(), drift }
}

fn beside(sentence: Option<&String>) -> String {
    sentence.map_or_else(String::new, |sentence| format!("\n  beside: {sentence}"))
}

fn further(sentence: Option<&String>) -> String {
    sentence.map_or_else(String::new, |sentence| format!(" Further, {sentence}"))
}

/// A form by the word that the command takes for it.
pub fn form(structure: Structure) -> String {
    let zero = |zero| if zero { "-zero" } else { "" };
    match structure {
        Structure::FirstOrder { zero: with } => format!("fopdt{}", zero(with)),
        Structure::SecondOrderReal { zero: with } => format!("sopdt-real{}", zero(with)),
        Structure::SecondOrderOscillating { zero: with } => format!("sopdt{}", zero(with)),
        Structure::Transfer { poles, zeros } => format!("{poles},{zeros}"),
    }
}

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
    study.warnings.extend(steady.and_then(|steady| study.other_gain(&steady)));
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

impl Study {
    /// The slowest time constant of the model \[s\].
    pub fn slowest_s(&self) -> f64 {
        let poles = self.fit.model.poles();
        let slowest = poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
        1.0 / slowest
    }

    /// What is said of a gain that a drift may have moved.
    fn other_gain(&self, steady: &SteadyGain) -> Option<String> {
        let gain = self.fit.model.dc_gain();
        let (sigmas, share) = steady.apart(gain);
        (sigmas > LIKELY_SIGMAS && share > LIKELY_SHARE).then(|| {
            format!(
                "the gain is {gain:.4}, but {:.4} ± {:.4} once a straight line in time is taken off \
                 input and output: the output drifts, and the model follows it in part",
                steady.gain, steady.sigma
            )
        })
    }

    /// The model as a file keeps it.
    pub fn model(&self, setting: Setting) -> ModelFile {
        let fit = &self.fit;
        let input = &self.logs.estimation.input;
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let input_range = input.iter().fold(start, |(low, high), v| (low.min(*v), high.max(*v)));
        let parameters = fit.parameters.iter().map(|one| file::Parameter {
            name: one.name.clone(),
            value: one.value,
            standard_error: one.sigma,
        });
        ModelFile {
            setting,
            kind: form(fit.settings.structure),
            input: self.logs.input.clone(),
            output: self.logs.output.clone(),
            input_range,
            operating_point: (fit.input_level, fit.output_level),
            transfer: fit.model.clone(),
            uncertainty: Some(Uncertainty {
                parameters: parameters.collect(),
                // Symmetric, so that rows are columns.
                covariance: fit.covariance.iter().copied().collect(),
            }),
            fit: Some(file::Fit {
                step_s: self.logs.estimation.step_s,
                estimation_percent: fit.quality.fit_percent,
                validation_percent: self.validation.map(|quality| quality.fit_percent),
            }),
        }
    }

    /// The unit of a parameter.
    pub fn unit_of(&self, name: &str) -> String {
        let (input, output) = (self.logs.input.unit, self.logs.output.unit);
        match name {
            "gain" => format!("{output} per {input}"),
            "output_level" => output.to_string(),
            _ if name.ends_with("_s") => "s".to_owned(),
            _ => String::new(),
        }
    }
}

#[cfg(test)]
mod tests;
