//! A model from logged data: what was found, whether it can be trusted, and the
//! files that tell it.

mod curves;
mod json;
mod page;
mod table;

use crate::identify::experiment::Experiment;
use crate::identify::file::{self, ModelFile, Setting, Uncertainty};
use crate::identify::fit::{
    Before, Comparison, Fit, FitError, Note, Quality, Row, Samples, SamplesError, Settings,
    Structure, compare,
};
use crate::identify::quantity::Quantity;
use crate::identify::residual::Autocorrelation;
use crate::model::Between;

pub use self::json::to_json;
pub use self::page::page;
pub use self::table::text;

/// A model that is further off other data than off its own by this factor is
/// told. Errors are compared and not fits, which grow with the excitation.
const OVERFIT: f64 = 1.25;
/// A fit below this is told \[%\].
const POOR_PERCENT: f64 = 50.0;
/// Data that validate last at least so many of the slowest time constants.
const TIME_CONSTANTS: f64 = 5.0;
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
    #[error("no model can be trusted:{}", lines(.0))]
    None(Vec<(String, String)>),
    /// It does not foretell other data.
    #[error(
        "the model ({form}, {estimation:.1} % on its own data) does not foretell the data to \
         validate with: {validation:.1} %, no better than their mean. Are both of the same machine \
         and material, and is the input the one that moves the output?"
    )]
    Foretells {
        /// Its form.
        form: String,
        /// Fit to its own data \[%\].
        estimation: f64,
        /// Fit to the others \[%\].
        validation: f64,
    },
}

fn lines(refused: &[(String, String)]) -> String {
    let lines: Vec<String> =
        refused.iter().map(|(form, why)| format!("\n  {form}: {why}")).collect();
    lines.concat()
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
    let Some((Ok(fit), quality)) = chosen.map(|row| (row.fit.clone(), row.validation)) else {
        return Err(Refusal::None(comparison.rows.iter().map(refused).collect()));
    };
    if let Some(quality) = quality.filter(|quality| quality.fit_percent <= 0.0) {
        return Err(Refusal::Foretells {
            form: form(fit.settings.structure),
            estimation: fit.quality.fit_percent,
            validation: quality.fit_percent,
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
    Ok(study)
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

    fn doubts(&self) -> Vec<String> {
        let mut doubts: Vec<String> =
            self.logs.estimation.notes.iter().map(|note| format!("data: {note}")).collect();
        if let Some((data, from)) = &self.logs.validation {
            doubts.extend(data.notes.iter().map(|note| format!("{from}: {note}")));
        }
        doubts.extend(self.fit.notes.iter().map(of_note));
        let own = self.fit.quality.fit_percent;
        if own < POOR_PERCENT {
            doubts.push(format!(
                "the model explains little of the data ({own:.1} % fit): look for what else moves \
                 the output, or filter it with --hampel and --smooth"
            ));
        }
        match self.validation {
            None => doubts.push(
                "nothing was validated with: a fit to its own data says little; give --validate or \
                 --validate-share"
                    .to_owned(),
            ),
            Some(other) if other.rmse > OVERFIT * self.fit.quality.rmse => doubts.push(format!(
                "the model is {:.1} times as far off the data to validate with as off its own: take \
                 fewer poles and zeros, log longer, or look whether the machine has changed",
                other.rmse / self.fit.quality.rmse
            )),
            Some(_) => {}
        }
        doubts.extend(self.short_validation());
        let outside = self.residuals.share_outside();
        if outside > 0.05 {
            doubts.push(format!(
                "what the model leaves hangs together ({:.0} % of the lags outside the 99 % band; the \
                 {} samples say as much as {:.0} independent ones): the noise is coloured, or \
                 something is missing in the model; the standard errors allow for it",
                100.0 * outside,
                self.fit.residuals.len(),
                self.fit.independent_samples
            ));
        }
        doubts
    }

    fn short_validation(&self) -> Option<String> {
        let (data, _) = self.logs.validation.as_ref()?;
        let needed_s = TIME_CONSTANTS * self.slowest_s() + self.fit.model.dead_time_s();
        (data.duration_s() < needed_s).then(|| {
            format!(
                "the {:.1} s to validate with are short for a time constant of {:.2} s: {needed_s:.1} \
                 s or more would tell",
                data.duration_s(),
                self.slowest_s()
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

fn of_note(note: &Note) -> String {
    match note {
        Note::NoDeadTime => "no dead time shows; it was left out".to_owned(),
        Note::PolesAreReal => {
            "the damping is above 1: both poles are real; --model sopdt-real gives \
                               their time constants"
                .to_owned()
        }
        Note::DeadTimeToAStep { dead_time_s } => format!(
            "the dead time of {dead_time_s:.4} s is told to a whole step only: the form passes its \
             input straight through"
        ),
        Note::Undetermined(loose) => loose.to_string(),
    }
}

#[cfg(test)]
mod tests;
