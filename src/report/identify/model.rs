//! A model with its data, its quality and its warnings.

use crate::core::Quantity;
use crate::identify::autocorrelation::Autocorrelation;
use crate::identify::experiment::Experiment;
use crate::identify::fit::{Fit, FitQuality, ModelComparison, Structure};
use crate::identify::model_file::{self, Conditions, ModelFile, ParameterUncertainty};

/// Logged data with their names.
#[derive(Debug, Clone)]
pub struct Logs {
    /// The input.
    pub input: Quantity,
    /// The output.
    pub output: Quantity,
    /// The data's source.
    pub source: String,
    /// The data to which the model is fitted.
    pub estimation: Experiment,
    /// Validation data and their source; `None` without validation.
    pub validation: Option<(Experiment, String)>,
    /// Whether the logs begin at rest.
    pub from_rest: bool,
}

/// A model with its data, its quality and its warnings.
#[derive(Debug)]
pub struct ModelStudy {
    /// The data.
    pub logs: Logs,
    /// All fitted models.
    pub comparison: ModelComparison,
    /// The chosen model.
    pub fit: Fit,
    /// Its fit to the validation data; `None` without validation.
    pub validation: Option<FitQuality>,
    /// Its prediction of the validation data; `None` without validation.
    pub predicted: Option<Vec<f64>>,
    /// Autocorrelation of the residuals.
    pub residuals: Autocorrelation,
    /// Warnings for the user of the model.
    pub warnings: Vec<String>,
}

/// The name of a form, as on the command line.
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

    /// The model in the form for a file.
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
                // The matrix is symmetric: its columns are its rows.
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
