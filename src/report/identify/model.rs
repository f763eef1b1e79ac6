//! A model with its data and all that is known of it.

use crate::core::quantity::Quantity;
use crate::identify::autocorrelation::Autocorrelation;
use crate::identify::experiment::Experiment;
use crate::identify::fit::{Fit, FitQuality, ModelComparison, Structure};
use crate::identify::model_file;
use crate::identify::model_file::{Conditions, ModelFile, ParameterUncertainty};

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
pub struct ModelStudy {
    /// The data.
    pub logs: Logs,
    /// All that were fitted.
    pub comparison: ModelComparison,
    /// The one that was taken.
    pub fit: Fit,
    /// How well it foretells other data.
    pub validation: Option<FitQuality>,
    /// What it foretells there.
    pub predicted: Option<Vec<f64>>,
    /// Whether what it leaves hangs together.
    pub residuals: Autocorrelation,
    /// What the reader should know before the model is used.
    pub warnings: Vec<String>,
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

impl ModelStudy {
    /// The slowest time constant of the model \[s\].
    pub fn slowest_s(&self) -> f64 {
        let poles = self.fit.model.poles();
        let slowest = poles.iter().map(|pole| -pole.re).fold(f64::INFINITY, f64::min);
        1.0 / slowest
    }

    /// The model as a file keeps it.
    pub fn model(&self, setting: Conditions) -> ModelFile {
        let fit = &self.fit;
        let input = &self.logs.estimation.input;
        let start = (f64::INFINITY, f64::NEG_INFINITY);
        let input_range = input.iter().fold(start, |(low, high), v| (low.min(*v), high.max(*v)));
        let parameters = fit.parameters.iter().map(|one| model_file::SavedParameter {
            name: one.name.clone(),
            value: one.value,
            standard_error: one.sigma,
        });
        ModelFile {
            conditions: setting,
            kind: form(fit.settings.structure),
            input: self.logs.input.clone(),
            output: self.logs.output.clone(),
            input_range,
            operating_point: (fit.input_level, fit.output_level),
            transfer: fit.model.clone(),
            uncertainty: Some(ParameterUncertainty {
                parameters: parameters.collect(),
                // Symmetric, so that rows are columns.
                covariance: fit.covariance.iter().copied().collect(),
            }),
            fit: Some(model_file::FitSummary {
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
