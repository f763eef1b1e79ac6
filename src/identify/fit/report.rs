//! What a fit came to.

use nalgebra::DMatrix;

use super::drift::check_drift;
use super::error::FitError;
use super::levenberg::{Outcome, nearest};
use super::loose::{Loose, loose};
use super::named::Named;
use super::problem::{Problem, dot, free_responses, spread as spread_of};
use super::quality::Quality;
use super::samples::Samples;
use super::settings::{Before, DeadTime, Settings};
use super::spread::{Colour, Spread, spread};
use super::start;
use crate::numeric::lti::{Simulator, TransferFunction, polynomial};

/// A parameter that was estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name, as [`super::Structure`] gives it; further `dead_time_s`,
    /// `output_level`.
    pub name: String,
    /// Estimate, in seconds where the name ends so, else in units of the data and
    /// of 1/s.
    pub value: f64,
    /// Standard error that allows for the colour of the residuals.
    pub sigma: f64,
    /// Standard error if the residuals were white. Where they are, both agree.
    pub sigma_if_white: f64,
}

/// What a user should know of a fit that stands.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// The estimate of the dead time was its lower end of 0: it was taken out.
    /// Where the fit is poor beside, the output may run ahead of the input.
    NoDeadTime,
    /// With as many zeros as poles and a held input the dead time can be told to a
    /// whole step only; it has no standard error.
    DeadTimeToAStep {
        /// That whole number of steps \[s\].
        dead_time_s: f64,
    },
    /// The data do not determine all parameters
    /// ([`Settings::accept_undetermined`]).
    Undetermined(Loose),
    /// The oscillating form came out with a damping above 1: its poles are real.
    PolesAreReal,
}

/// A model with what is known of it.
#[derive(Debug, Clone)]
pub struct Fit {
    /// What was asked for; without dead time where [`Note::NoDeadTime`] says so.
    pub settings: Settings,
    /// Output less output level over input less input level.
    pub model: TransferFunction,
    /// Where the input stood before, in units of the input.
    pub input_level: f64,
    /// The output for an input that stands at the input level.
    pub output_level: f64,
    /// Parameters with their errors.
    pub parameters: Vec<Parameter>,
    /// Covariance of the parameters, in their order, with the residuals' colour.
    pub covariance: DMatrix<f64>,
    /// The same if the residuals were white.
    pub covariance_if_white: DMatrix<f64>,
    /// What the model says that the output was.
    pub predicted: Vec<f64>,
    /// Output less prediction.
    pub residuals: Vec<f64>,
    /// Standard deviation of the residuals, in units of the output.
    pub residual_sigma: f64,
    /// On the data of the estimation.
    pub quality: Quality,
    /// Akaike's criterion for white residuals; less is better.
    pub aic: f64,
    /// Schwarz's criterion for white residuals; less is better.
    pub bic: f64,
    /// Number of samples that would say as much if they were independent.
    pub independent_samples: f64,
    /// What a user should know.
    pub notes: Vec<Note>,
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
        !self.notes.iter().any(|note| matches!(note, Note::Undetermined(_)))
    }

    /// What the model says of other data, with the fit's levels. With
    /// [`Before::Unknown`] the free response, and nothing else, is estimated from
    /// them.
    pub fn predict(&self, samples: &Samples, before: Before) -> Result<Vec<f64>, FitError> {
        let first = samples.input().first().copied().unwrap_or(self.input_level);
        let stood = match before {
            Before::Settled { input } => input,
            Before::SettledAtFirst | Before::Unknown => first,
        };
        let mut model = Simulator::new(&self.model, samples.dt_s(), self.settings.between)?;
        model.settle(stood - self.input_level)?;
        let answer = |u: &f64| self.output_level + model.step(u - self.input_level);
        let mut predicted: Vec<f64> = samples.input().iter().map(answer).collect();
        if before == Before::Unknown {
            self.add_free_response(samples, &mut predicted)?;
        }
        Ok(predicted)
    }

    fn add_free_response(&self, samples: &Samples, predicted: &mut [f64]) -> Result<(), FitError> {
        let columns = free_responses(self.model.den(), samples.dt_s(), samples.len())?;
        let left: Vec<f64> = samples.output().iter().zip(&*predicted).map(|(y, p)| y - p).collect();
        let found = nearest(&columns, &left).ok_or(FitError::NoStart)?;
        for (value, column) in found.iter().zip(&columns) {
            predicted.iter_mut().zip(column).for_each(|(y, c)| *y += value * c);
        }
        Ok(())
    }

    /// How well the model predicts other data.
    pub fn validate(&self, samples: &Samples, before: Before) -> Result<Quality, FitError> {
        let predicted = self.predict(samples, before)?;
        let found = Quality::of(samples.output(), &predicted);
        found.ok_or(FitError::Data(super::SamplesError::TooFew { found: 0, needed: 1 }))
    }
}

/// Turns the least squares into a fit, or says why it is none.
pub(super) fn report(
    problem: &Problem,
    settings: &Settings,
    best: &Outcome,
) -> Result<Fit, FitError> {
    if let DeadTime::Estimated { least_s, most_s } = settings.dead_time {
        let found = problem.dead_time_s(&best.theta);
        if found <= least_s && least_s == 0.0 {
            return without_dead_time(problem, settings);
        }
        if found <= least_s || found >= most_s {
            let end = if found <= least_s { "lower" } else { "upper" };
            return Err(FitError::DeadTimeAtBound { end, bound_s: found });
        }
    }
    check_stable(problem, best)?;
    let fit = assemble(problem, settings, best)?;
    check_drift(problem, &fit)?;
    check_dependence(problem, &fit)?;
    if settings.accept_undetermined {
        return Ok(fit);
    }
    let loose = fit.notes.iter().find_map(|note| match note {
        Note::Undetermined(loose) => Some(loose.clone()),
        _ => None,
    });
    match loose {
        Some(loose) => Err(FitError::Undetermined(loose)),
        None => Ok(fit),
    }
}

fn without_dead_time(problem: &Problem, settings: &Settings) -> Result<Fit, FitError> {
    let settings = Settings { dead_time: DeadTime::Given(0.0), ..*settings };
    let problem = Problem { dead_time: settings.dead_time, ..problem.clone() };
    let best = start::best(&problem)?;
    let mut fit = report(&problem, &settings, &best)?;
    fit.notes.push(Note::NoDeadTime);
    Ok(fit)
}

/// A time constant beyond this many records was not seen.
const LONGEST_RECORDS: f64 = 10.0;

fn check_stable(problem: &Problem, best: &Outcome) -> Result<(), FitError> {
    let record_s = problem.duration_s();
    let poles = polynomial::roots(&problem.den(&best.theta));
    let slowest = poles.iter().map(|pole| pole.re).fold(f64::MIN, f64::max);
    if slowest > -1.0 / (LONGEST_RECORDS * record_s) {
        return Err(FitError::UnstableFit { re: slowest, record_s });
    }
    Ok(())
}

/// What a model explains of the output must be more than chance: five times
/// what as many parameters explain of noise of the residuals' colour on average.
const BEYOND_CHANCE: f64 = 5.0;

fn check_dependence(problem: &Problem, fit: &Fit) -> Result<(), FitError> {
    let whole = spread_of(&problem.output);
    #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
    let squares = dot(&fit.residuals, &fit.residuals) / fit.residuals.len() as f64;
    let explained = 1.0 - squares / (whole * whole);
    #[expect(clippy::cast_precision_loss, reason = "few parameters")]
    let chance = (BEYOND_CHANCE * fit.estimated as f64 / fit.independent_samples).min(1.0);
    // As a share of what is left: an F ratio.
    if explained < chance * (1.0 - explained) {
        let explained_percent = 100.0 * explained.max(0.0);
        let chance_percent = 100.0 * chance / (1.0 + chance);
        return Err(FitError::NoDependence { explained_percent, chance_percent });
    }
    Ok(())
}

fn assemble(problem: &Problem, settings: &Settings, best: &Outcome) -> Result<Fit, FitError> {
    let theta = &best.theta;
    let model = problem.transfer(theta).ok_or(FitError::NoStart)?;
    let predicted = problem.predict(theta).ok_or(FitError::NoStart)?;
    let scales = problem.scales(theta);
    let columns = problem.jacobian(theta, &scales).ok_or(FitError::NoStart)?;
    let residuals: Vec<f64> = problem.output.iter().zip(&predicted).map(|(y, p)| y - p).collect();
    let colour = Colour::of(&residuals);
    let spread = spread(&columns, &colour, residuals.len());
    let named = Named::of(problem, settings.structure, theta)?;
    let predicted_quality = Quality::of(&problem.output, &predicted).ok_or(FitError::NoStart)?;
    let turn = named.slopes(problem, settings.structure, theta, &scales);
    let covariance = &turn * &spread.coloured * turn.transpose();
    let covariance_if_white = &turn * &spread.white * turn.transpose();
    // Nothing holds a parameter whose variance is lost in rounding.
    let sigma = |of: &DMatrix<f64>, i: usize| {
        if of[(i, i)] > 0.0 { of[(i, i)].sqrt() } else { f64::INFINITY }
    };
    let parameters: Vec<Parameter> = (0..named.names.len())
        .map(|i| Parameter {
            name: named.names[i].clone(),
            value: named.values[i],
            sigma: sigma(&covariance, i),
            sigma_if_white: sigma(&covariance_if_white, i),
        })
        .collect();
    let notes = notes(problem, theta, &spread, &named, &turn);
    let (n, k) = (count(residuals.len()), count(theta.len()));
    let squares = dot(&residuals, &residuals);
    let misfit = n * libm::log((squares / n).max(f64::MIN_POSITIVE));
    Ok(Fit {
        settings: *settings,
        model,
        input_level: problem.input_level,
        output_level: problem.output_level(theta),
        parameters,
        covariance,
        covariance_if_white,
        residual_sigma: (squares / (n - k).max(1.0)).sqrt(),
        quality: predicted_quality,
        aic: misfit + 2.0 * k,
        bic: misfit + k * libm::log(n),
        independent_samples: colour.independent(residuals.len()),
        predicted,
        residuals,
        notes,
        estimated: theta.len(),
    })
}

#[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
fn count(n: usize) -> f64 {
    n as f64
}

fn notes(
    problem: &Problem,
    theta: &[f64],
    spread: &Spread,
    named: &Named,
    turn: &DMatrix<f64>,
) -> Vec<Note> {
    let mut notes: Vec<Note> =
        loose(problem, theta, spread, named, turn).map(Note::Undetermined).into_iter().collect();
    if named.poles_are_real {
        notes.push(Note::PolesAreReal);
    }
    notes
}
