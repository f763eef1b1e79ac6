//! From the least squares to a fit, or why it is none.

use nalgebra::DMatrix;

use super::autoregression::Colour;
use super::drift::check_drift;
use super::error::FitError;
use super::estimate::{Fit, Note, Parameter};
use super::identifiability::loose;
use super::levenberg::Outcome;
use super::named::Named;
use super::problem::Problem;
use super::quality::Quality;
use super::row::{dot, standard_deviation};
use super::settings::{DeadTime, Settings};
use super::spread::{Spread, spread};
use super::start;
use crate::numeric::lti::polynomial;
use crate::numeric::number::float;

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
    let whole = standard_deviation(&problem.output);
    let squares = dot(&fit.residuals, &fit.residuals) / float(fit.residuals.len());
    let explained = 1.0 - squares / (whole * whole);
    let chance = (BEYOND_CHANCE * float(fit.estimated) / fit.independent_samples).min(1.0);
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
    let (n, k) = (float(residuals.len()), float(theta.len()));
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
