//! An estimated model and its prediction of other data.

use nalgebra::DMatrix;

use super::error::FitError;
use super::problem::free_responses;
use super::quality::FitQuality;
use super::samples::{Samples, SamplesError};
use super::settings::{FitSettings, InitialCondition};
use super::undetermined::Undetermined;
use crate::numeric::linear::least_squares;
use crate::numeric::lti::{Simulator, TransferFunction};

/// An estimated parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name, as `Structure` gives it; further `dead_time_s`,
    /// `output_level`.
    pub name: String,
    /// Estimate, in seconds where the name ends so, else in units of the data and
    /// of 1/s.
    pub value: f64,
    /// Standard error with the autocorrelation of the residuals.
    pub sigma: f64,
    /// Standard error for white residuals. Where they are white, both agree.
    pub sigma_if_white: f64,
}

/// A remark on a valid fit.
#[derive(Debug, Clone, PartialEq)]
pub enum FitNote {
    /// The estimate of the dead time was 0, and it was removed. If the fit is poor, the output
    /// may lead the input.
    NoDeadTime,
    /// With as many zeros as poles and a held input the dead time is determined to a whole step
    /// only; it has no standard error.
    DeadTimeToAStep {
        /// That whole number of steps \[s\].
        dead_time_s: f64,
    },
    /// The data do not determine all parameters ([`FitSettings::accept_undetermined`]).
    Undetermined(Undetermined),
    /// The oscillating form has a damping above 1: its poles are real.
    PolesAreReal,
}

/// An estimated model.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The settings; without dead time where [`FitNote::NoDeadTime`] says so.
    pub settings: FitSettings,
    /// Output less output level over input less input level.
    pub model: TransferFunction,
    /// Input before the first sample.
    pub input_level: f64,
    /// Output for a constant input at the input level.
    pub output_level: f64,
    /// Parameters with their errors.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters, in their order, with the autocorrelation of the residuals.
    pub covariance: DMatrix<f64>,
    /// Predicted output.
    pub predicted: Vec<f64>,
    /// Output less prediction.
    pub residuals: Vec<f64>,
    /// Standard deviation of the residuals, in units of the output.
    pub residual_sigma: f64,
    /// On the data of the estimation.
    pub quality: FitQuality,
    /// Effective number of independent samples.
    pub independent_samples: f64,
    /// Remarks.
    pub notes: Vec<FitNote>,
    /// Number of estimated parameters, those of the free response included.
    pub estimated: usize,
}

impl Fit {
    /// A parameter of this name.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Whether all parameters are determined.
    pub fn is_determined(&self) -> bool {
        !self.notes.iter().any(|note| matches!(note, FitNote::Undetermined(_)))
    }

    /// Prediction of other data with the fit's levels. With [`InitialCondition::Unknown`] the
    /// free response, and nothing else, is estimated from them.
    pub fn predict(
        &self,
        samples: &Samples,
        before: InitialCondition,
    ) -> Result<Vec<f64>, FitError> {
        let first = samples.input().first().copied().unwrap_or(self.input_level);
        let stood = match before {
            InitialCondition::Settled { input } => input,
            InitialCondition::SettledAtFirst | InitialCondition::Unknown => first,
        };
        let mut model = Simulator::new(&self.model, samples.dt_s(), self.settings.between)?;
        model.settle(stood - self.input_level)?;
        let answer = |u: &f64| self.output_level + model.step(u - self.input_level);
        let mut predicted: Vec<f64> = samples.input().iter().map(answer).collect();
        if before == InitialCondition::Unknown {
            self.add_free_response(samples, &mut predicted)?;
        }
        Ok(predicted)
    }

    fn add_free_response(&self, samples: &Samples, predicted: &mut [f64]) -> Result<(), FitError> {
        let columns = free_responses(self.model.den(), samples.dt_s(), samples.len())?;
        let left: Vec<f64> = samples.output().iter().zip(&*predicted).map(|(y, p)| y - p).collect();
        let found = least_squares(&columns, &left).ok_or(FitError::NoStart)?;
        for (value, column) in found.iter().zip(&columns) {
            predicted.iter_mut().zip(column).for_each(|(y, c)| *y += value * c);
        }
        Ok(())
    }

    /// How well the model predicts other data.
    pub fn validate(
        &self,
        samples: &Samples,
        before: InitialCondition,
    ) -> Result<FitQuality, FitError> {
        let predicted = self.predict(samples, before)?;
        let found = FitQuality::of(samples.output(), &predicted);
        found.ok_or(FitError::Data(SamplesError::TooFew { found: 0, needed: 1 }))
    }
}
