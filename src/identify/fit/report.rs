//! From the minimum to a fit, or the reason why it is invalid.

use nalgebra::DMatrix;

use super::autoregression::ArModel;
use super::drift::check_drift;
use super::error::FitError;
use super::estimate::{Fit, FitNote, Parameter};
use super::identifiability::undetermined;
use super::named::NamedParameters;
use super::problem::FitProblem;
use super::quality::FitQuality;
use super::settings::{DeadTime, FitSettings};
use super::spread::covariances;
use super::start;
use crate::numeric::average::standard_deviation;
use crate::numeric::levenberg_marquardt::{LeastSquares, Minimum};
use crate::numeric::lti::polynomial;
use crate::numeric::number::to_f64;
use crate::numeric::row::dot;

/// Turns the minimum into a fit, or gives the reason why it is invalid.
pub(super) fn report(
    problem: &FitProblem,
    settings: &FitSettings,
    best: &Minimum,
) -> Result<Fit, FitError> {
    if let DeadTime::Estimated { min_s, max_s } = settings.dead_time {
        let found = problem.dead_time_s(&best.theta);
        if found <= min_s && min_s == 0.0 {
            return without_dead_time(problem, settings);
        }
        if found <= min_s || found >= max_s {
            let end = if found <= min_s { "lower" } else { "upper" };
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
    for note in &fit.notes {
        if let FitNote::Undetermined(what) = note {
            return Err(FitError::Undetermined(what.clone()));
        }
    }
    Ok(fit)
}

fn without_dead_time(problem: &FitProblem, settings: &FitSettings) -> Result<Fit, FitError> {
    let settings = FitSettings { dead_time: DeadTime::Known(0.0), ..*settings };
    let problem = FitProblem { dead_time: settings.dead_time, ..problem.clone() };
    let best = start::best(&problem)?;
    let mut fit = report(&problem, &settings, &best)?;
    fit.notes.push(FitNote::NoDeadTime);
    Ok(fit)
}

/// A time constant beyond this many records is not observable. A choice.
const MAX_TIME_CONSTANT_RECORDS: f64 = 10.0;

fn check_stable(problem: &FitProblem, best: &Minimum) -> Result<(), FitError> {
    let record_s = problem.duration_s();
    let poles = polynomial::roots(&problem.den(&best.theta));
    let slowest = poles.iter().map(|pole| pole.re).fold(f64::MIN, f64::max);
    if slowest > -1.0 / (MAX_TIME_CONSTANT_RECORDS * record_s) {
        return Err(FitError::UnstableFit { re: slowest, record_s });
    }
    Ok(())
}

/// Explained variance over that by chance, above which the output depends on the input. A choice:
/// chance is what as many parameters explain, in the mean, of noise with the residuals'
/// autocorrelation.
const CHANCE_FACTOR: f64 = 5.0;

fn check_dependence(problem: &FitProblem, fit: &Fit) -> Result<(), FitError> {
    let whole = standard_deviation(&problem.output);
    let squares = dot(&fit.residuals, &fit.residuals) / to_f64(fit.residuals.len());
    let explained = 1.0 - squares / (whole * whole);
    let chance = (CHANCE_FACTOR * to_f64(fit.estimated) / fit.independent_samples).min(1.0);
    // An F ratio: both over the residual variance.
    if explained < chance * (1.0 - explained) {
        let explained_percent = 100.0 * explained.max(0.0);
        let chance_percent = 100.0 * chance / (1.0 + chance);
        return Err(FitError::NoDependence { explained_percent, chance_percent });
    }
    Ok(())
}

fn assemble(problem: &FitProblem, settings: &FitSettings, best: &Minimum) -> Result<Fit, FitError> {
    let theta = &best.theta;
    let model = problem.transfer(theta).ok_or(FitError::NoStart)?;
    let predicted = problem.predict(theta).ok_or(FitError::NoStart)?;
    let scales = problem.scales(theta);
    let columns = problem.jacobian(theta).ok_or(FitError::NoStart)?;
    let residuals: Vec<f64> = problem.output.iter().zip(&predicted).map(|(y, p)| y - p).collect();
    let noise = ArModel::of(&residuals);
    let spread = covariances(&columns, &noise, residuals.len());
    let named = NamedParameters::of(problem, settings.structure, theta)?;
    let quality = FitQuality::of(&problem.output, &predicted).ok_or(FitError::NoStart)?;
    let turn = named.jacobian(problem, settings.structure, theta, &scales);
    let covariance = &turn * &spread.correlated * turn.transpose();
    let covariance_if_white = &turn * &spread.white * turn.transpose();
    // A variance below zero by rounding is undetermined.
    let sigma = |of: &DMatrix<f64>, i: usize| {
        if of[(i, i)] > 0.0 { of[(i, i)].sqrt() } else { f64::INFINITY }
    };
    let parameter = |i: usize| Parameter {
        name: named.names[i].clone(),
        value: named.values[i],
        sigma: sigma(&covariance, i),
        sigma_if_white: sigma(&covariance_if_white, i),
    };
    let parameters: Vec<Parameter> = (0..named.names.len()).map(parameter).collect();
    let undetermined = undetermined(problem, theta, &spread, &named, &turn);
    let real_poles = named.poles_are_real.then_some(FitNote::PolesAreReal);
    let notes = undetermined.map(FitNote::Undetermined).into_iter().chain(real_poles).collect();
    let (n, k) = (to_f64(residuals.len()), to_f64(theta.len()));
    let squares = dot(&residuals, &residuals);
    Ok(Fit {
        settings: *settings,
        model,
        input_level: problem.input_level,
        output_level: problem.output_level(theta),
        parameters,
        covariance,
        residual_sigma: (squares / (n - k).max(1.0)).sqrt(),
        quality,
        independent_samples: noise.effective_samples(residuals.len()),
        predicted,
        residuals,
        notes,
        estimated: theta.len(),
    })
}
