//! Flow after a stop: all stops as one curve, relative to the flow before.

use super::episodes::Episode;
use super::error::StartStopFitError;
use super::estimate::ObservedStop;
use super::least_squares::minimise;
use super::parameters::StartStop;
use crate::numeric::number::to_f64;

/// Fitted stops.
#[derive(Debug, Clone)]
pub(super) struct StopFit {
    /// L', T', D and τd \[s\].
    pub value: [f64; 4],
    /// Their standard errors \[s\].
    pub sigma: [f64; 4],
    pub stops: Vec<ObservedStop>,
}

/// Largest remaining flow at the end of the longest observation, over the flow before.
const MAX_REMAINING: f64 = 0.1;
/// The last samples of an observation, one in this many, count as its end.
const TAIL_DIVISOR: usize = 5;
/// Ranges of L', T', a and τd. A choice around all known extruders.
const PARAMETER_RANGES: [[f64; 2]; 4] = [[0.0, 3.0], [0.005, 5.0], [0.0, 0.9], [0.02, 30.0]];

/// A model with this response to a stop; its start is a placeholder.
pub(super) fn model(stop: [f64; 4]) -> StartStop {
    StartStop::from_parts([0.0, stop[1], 0.0, 1.0], stop)
}

/// L', T', D and τd from the parameters of the fit, L', T', a and τd.
fn stop_of(row: &[f64]) -> Option<[f64; 4]> {
    let &[stop_s, fall_s, slow, drool_time_constant_s] = row else { return None };
    Some([stop_s, fall_s, slow * drool_time_constant_s, drool_time_constant_s])
}

/// Fits all stops together; the standard errors are those of the jackknife.
pub(super) fn fit(stops: &[Episode]) -> Result<StopFit, StartStopFitError> {
    check_ends(stops)?;
    let value = fit_all(stops, None)?;
    let without: Result<Vec<[f64; 4]>, _> =
        (0..stops.len()).map(|number| fit_all(stops, Some((number, value)))).collect();
    let sigma = jackknife(&without?);
    let seen = |stop: &Episode| ObservedStop {
        at_s: stop.at_s,
        flow_mm3_per_s: stop.flow,
        observed_s: stop.samples.last().map_or(0.0, |(at, _)| *at),
        volume_mm3: stop.flow * stop.step_s * stop.samples.iter().map(|(_, q)| q).sum::<f64>(),
    };
    Ok(StopFit { value, sigma, stops: stops.iter().map(seen).collect() })
}

/// The flow must have ceased at the end of the longest observation.
fn check_ends(stops: &[Episode]) -> Result<(), StartStopFitError> {
    let seen_s = |stop: &Episode| stop.samples.last().map_or(0.0, |(at, _)| *at);
    let longest = stops.iter().max_by(|a, b| seen_s(a).total_cmp(&seen_s(b)));
    let Some(longest) = longest else { return Err(StartStopFitError::NoFit { what: "fall" }) };
    let tail = longest.samples.len().div_ceil(TAIL_DIVISOR);
    let last = || longest.samples.iter().rev().take(tail).map(|(_, fraction)| fraction);
    let n = to_f64(tail.max(1));
    let left = last().sum::<f64>() / n;
    let chance = last().map(|fraction| (fraction - left).powi(2)).sum::<f64>().sqrt() / n;
    if left - 3.0 * chance <= MAX_REMAINING {
        return Ok(());
    }
    Err(StartStopFitError::FlowContinues {
        at_s: longest.at_s,
        observed_s: seen_s(longest),
        percent: 100.0 * left,
        max_percent: 100.0 * MAX_REMAINING,
    })
}

fn fit_all(
    stops: &[Episode],
    without: Option<(usize, [f64; 4])>,
) -> Result<[f64; 4], StartStopFitError> {
    let left_out = without.map(|(number, _)| number);
    let used = stops.iter().enumerate().filter(|(number, _)| Some(*number) != left_out);
    let samples: Vec<_> = used.flat_map(|(_, stop)| stop.samples.iter().copied()).collect();
    let residuals = |row: &[f64]| -> Vec<f64> {
        let Some(model) = stop_of(row).map(model) else { return Vec::new() };
        samples.iter().map(|(at, share)| model.remaining_flow(*at) - share).collect()
    };
    let starts: Vec<[f64; 4]> = match without {
        Some((_, [stop_s, fall_s, drool_s, tau_s])) => {
            vec![[stop_s, fall_s, drool_s / tau_s, tau_s]]
        }
        None => INITIAL_GUESSES.to_vec(),
    };
    let solved = starts.iter().filter_map(|start| minimise(&residuals, start, &PARAMETER_RANGES));
    let best = solved.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    let found = best.and_then(|best| stop_of(&best.at)).map(ordered);
    found.ok_or(StartStopFitError::NoFit { what: "fall" })
}

/// Initial values of L', T', a and τd.
const INITIAL_GUESSES: [[f64; 4]; 4] =
    [[0.1, 0.1, 0.2, 0.6], [0.1, 0.3, 0.1, 2.0], [0.3, 0.8, 0.2, 4.0], [0.05, 0.05, 0.3, 0.2]];

/// With the slower part as the drool.
fn ordered([stop_s, fall_s, drool_s, tau_s]: [f64; 4]) -> [f64; 4] {
    if tau_s >= fall_s {
        return [stop_s, fall_s, drool_s, tau_s];
    }
    let slow = 1.0 - drool_s / tau_s;
    [stop_s, tau_s, slow * fall_s, fall_s]
}

/// Standard errors from estimates that each leave out one (jackknife, Tukey 1958).
fn jackknife(without: &[[f64; 4]]) -> [f64; 4] {
    let n = to_f64(without.len().max(1));
    std::array::from_fn(|number| {
        let values = || without.iter().map(|one| one[number]);
        let mean = values().sum::<f64>() / n;
        ((n - 1.0) / n * values().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt()
    })
}
