//! What comes after a stop: all stops as one curve of the share of the flow
//! before.

use super::episodes::Episode;
use super::error::StartStopFitError;
use super::estimate::ObservedStop;
use super::least_squares::minimise;
use super::parameters::StartStop;
use crate::numeric::number::to_f64;

/// Parameters of a fall; see [`StartStop`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "times, all in seconds")]
pub(super) struct StopResponse {
    pub stop_s: f64,
    pub fall_s: f64,
    pub drool_s: f64,
    pub drool_time_constant_s: f64,
}

/// What was found of the stops.
#[derive(Debug, Clone)]
pub(super) struct StopFit {
    pub model: StopResponse,
    pub sigma: StopResponse,
    pub stops: Vec<ObservedStop>,
}

/// What may be left of the flow at the end of the longest look \[share\].
const MAX_REMAINING: f64 = 0.1;
/// The end of a look is this part of it.
const TAIL_DIVISOR: usize = 5;
/// Ranges of L', T', a and τd.
const PARAMETER_RANGES: [[f64; 2]; 4] = [[0.0, 3.0], [0.005, 5.0], [0.0, 0.9], [0.02, 30.0]];

impl StopResponse {
    fn of(row: &[f64]) -> Option<Self> {
        let &[stop_s, fall_s, slow, drool_time_constant_s] = row else { return None };
        let drool_s = slow * drool_time_constant_s;
        Some(Self { stop_s, fall_s, drool_s, drool_time_constant_s })
    }

    /// As a model, of which the start is left open.
    pub fn model(&self) -> StartStop {
        StartStop {
            first_flow_s: 0.0,
            rise_s: self.fall_s,
            void_mm3: 0.0,
            idle_time_constant_s: 1.0,
            stop_s: self.stop_s,
            fall_s: self.fall_s,
            drool_s: self.drool_s,
            drool_time_constant_s: self.drool_time_constant_s,
        }
    }

    fn row(&self) -> [f64; 4] {
        [self.stop_s, self.fall_s, self.drool_s, self.drool_time_constant_s]
    }
}

/// Fits all stops together; the standard errors are those of leaving out one
/// after the other.
pub(super) fn fit(stops: &[Episode]) -> Result<StopFit, StartStopFitError> {
    check_ends(stops)?;
    let model = fit_all(stops, None)?;
    let without: Result<Vec<StopResponse>, _> =
        (0..stops.len()).map(|number| fit_all(stops, Some((number, model)))).collect();
    let sigma = jackknife(&without?);
    let seen = |stop: &Episode| ObservedStop {
        at_s: stop.at_s,
        flow_mm3_per_s: stop.flow,
        observed_s: stop.samples.last().map_or(0.0, |(at, _)| *at),
        volume_mm3: stop.flow * stop.step_s * stop.samples.iter().map(|(_, q)| q).sum::<f64>(),
    };
    Ok(StopFit { model, sigma, stops: stops.iter().map(seen).collect() })
}

/// The flow must have ceased where it was looked at longest.
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
    without: Option<(usize, StopResponse)>,
) -> Result<StopResponse, StartStopFitError> {
    let left_out = without.map(|(number, _)| number);
    let samples: Vec<(f64, f64)> = stops
        .iter()
        .enumerate()
        .filter(|(number, _)| Some(*number) != left_out)
        .flat_map(|(_, stop)| stop.samples.iter().copied())
        .collect();
    let residuals = |row: &[f64]| -> Vec<f64> {
        let Some(falling) = StopResponse::of(row) else { return Vec::new() };
        let model = falling.model();
        samples.iter().map(|(at, share)| model.remaining_flow(*at) - share).collect()
    };
    let starts: Vec<[f64; 4]> = match without {
        Some((_, near)) => {
            vec![[
                near.stop_s,
                near.fall_s,
                near.drool_s / near.drool_time_constant_s,
                near.drool_time_constant_s,
            ]]
        }
        None => INITIAL_GUESSES.to_vec(),
    };
    let solved = starts.iter().filter_map(|start| minimise(&residuals, start, &PARAMETER_RANGES));
    let best = solved.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    let found = best.and_then(|best| StopResponse::of(&best.at)).map(ordered);
    found.ok_or(StartStopFitError::NoFit { what: "fall" })
}

/// Starts of L', T', a and τd.
const INITIAL_GUESSES: [[f64; 4]; 4] =
    [[0.1, 0.1, 0.2, 0.6], [0.1, 0.3, 0.1, 2.0], [0.3, 0.8, 0.2, 4.0], [0.05, 0.05, 0.3, 0.2]];

/// The slow part is the drool.
fn ordered(found: StopResponse) -> StopResponse {
    if found.drool_time_constant_s >= found.fall_s {
        return found;
    }
    let slow = 1.0 - found.drool_s / found.drool_time_constant_s;
    StopResponse {
        fall_s: found.drool_time_constant_s,
        drool_s: slow * found.fall_s,
        drool_time_constant_s: found.fall_s,
        ..found
    }
}

/// Standard errors from estimates that each leave out one.
#[expect(clippy::cast_precision_loss, reason = "a recording has few stops")]
fn jackknife(without: &[StopResponse]) -> StopResponse {
    let n = without.len().max(1) as f64;
    let mut sigma = [0.0; 4];
    for (number, sigma) in sigma.iter_mut().enumerate() {
        let values = || without.iter().filter_map(|one| one.row().get(number).copied());
        let mean = values().sum::<f64>() / n;
        *sigma = ((n - 1.0) / n * values().map(|x| (x - mean).powi(2)).sum::<f64>()).sqrt();
    }
    let [stop_s, fall_s, drool_s, drool_time_constant_s] = sigma;
    StopResponse { stop_s, fall_s, drool_s, drool_time_constant_s }
}
