//! Delay of the first flow over the pause before it: a void that opens and must be filled.

use super::error::StartStopFitError;
use super::estimate::ObservedStart;
use super::least_squares::minimise;
use crate::numeric::number::to_f64;

/// Fitted delays.
#[derive(Debug, Clone, Copy)]
pub(super) struct DelayFit {
    /// L \[s\], V∞ \[mm³\] and τ \[s\].
    pub value: [f64; 3],
    /// Their standard errors.
    pub sigma: [f64; 3],
    /// Standard deviation about the curve \[s\].
    pub residual_sigma_s: f64,
}

/// Growth in standard deviations of a delay below which there is none…
const MIN_SIGMAS: f64 = 4.0;
/// …or in seconds, below which it is irrelevant for a robot \[s\].
const MIN_GROWTH_S: f64 = 0.01;
/// Relative standard error above which a time constant is undetermined.
const MAX_RELATIVE_SIGMA: f64 = 0.5;

/// Least squares of L + V∞·(1 − e^(−idle/τ))/Q.
pub(super) fn fit(starts: &[ObservedStart]) -> Result<DelayFit, StartStopFitError> {
    let nothing = StartStopFitError::NoFit { what: "delay" };
    let idle = || starts.iter().map(|start| start.idle_s);
    let (shortest_s, longest_s) = (idle().fold(f64::MAX, f64::min), idle().fold(0.0, f64::max));
    let flow = starts.iter().map(|start| start.flow_mm3_per_s).fold(0.0, f64::max);
    let latest_s = starts.iter().map(|start| start.delay_s).fold(0.0, f64::max);
    let residuals = |row: &[f64]| -> Vec<f64> {
        let &[first_s, void, tau] = row else { return Vec::new() };
        let of = |start: &ObservedStart| {
            let opened = -void * libm::expm1(-start.idle_s / tau);
            first_s + opened / start.flow_mm3_per_s - start.delay_s
        };
        starts.iter().map(of).collect()
    };
    let slowest_s = 10.0 * longest_s;
    let ranges = [[0.0, latest_s + 1e-3], [0.0, 10.0 * latest_s * flow], [1e-2, slowest_s]];
    let ladder = (0..8).map(|k| shortest_s.max(0.1) * libm::exp2(f64::from(k)));
    let solved = ladder.filter_map(|tau| {
        minimise(&residuals, &[0.0, latest_s * flow, tau.min(longest_s)], &ranges)
    });
    let best = solved.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    let best = best.ok_or(nothing.clone())?;
    let row = |row: Vec<f64>| <[f64; 3]>::try_from(row).ok();
    let (value, sigma) = row(best.at).zip(row(best.sigma)).ok_or(nothing)?;
    let residual_sigma_s = (best.sum_of_squares / (to_f64(starts.len()) - 3.0).max(1.0)).sqrt();
    let found = DelayFit { value, sigma, residual_sigma_s };
    check(&found, [shortest_s, longest_s], flow)?;
    Ok(found)
}

fn check(found: &DelayFit, pauses_s: [f64; 2], flow: f64) -> Result<(), StartStopFitError> {
    let [shortest_s, longest_s] = pauses_s;
    let [_, void_mm3, found_s] = found.value;
    let left = |idle_s: f64| void_mm3 * libm::exp(-idle_s / found_s);
    let grows_s = (left(shortest_s) - left(longest_s)) / flow;
    let sigma_s = found.residual_sigma_s;
    if grows_s < MIN_GROWTH_S.max(MIN_SIGMAS * sigma_s) {
        let grown = StartStopFitError::DelayDoesNotGrow { grows_s, sigma_s, shortest_s, longest_s };
        return Err(grown);
    }
    let [_, _, sigma_s] = found.sigma;
    let bracketed = found_s < longest_s && found_s > 0.5 * shortest_s;
    if bracketed && sigma_s < MAX_RELATIVE_SIGMA * found_s {
        return Ok(());
    }
    Err(StartStopFitError::TimeConstantUndetermined { found_s, sigma_s, shortest_s, longest_s })
}
