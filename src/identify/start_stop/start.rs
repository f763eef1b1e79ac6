//! Flow after a start: its delay, and the time constant that all starts have in common.

use super::episodes::Episode;
use super::error::StartStopFitError;
use super::estimate::ObservedStart;
use super::least_squares::minimise;
use super::parameters::StartStop;
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Fitted starts.
#[derive(Debug, Clone)]
pub(super) struct StartFit {
    /// T \[s\].
    pub time_constant_s: f64,
    /// Its standard error \[s\].
    pub sigma_s: f64,
    pub starts: Vec<ObservedStart>,
}

/// Range of T \[s\].
const TIME_CONSTANT_RANGE_S: [f64; 2] = [0.005, 10.0];
/// Consecutive samples above half the flow that are no noise.
const CONSECUTIVE_SAMPLES: usize = 3;
/// Smallest number of starts that determine T, for a standard error.
const MIN_RISES: usize = 3;

/// The median of the time constants of all starts, and the delay of each with it.
pub(super) fn fit(starts: &[Episode], fall: &StartStop) -> Result<StartFit, StartStopFitError> {
    let rises: Vec<f64> = starts.iter().filter_map(|start| time_constant_of(start, fall)).collect();
    let typical = median_and_sigma(&rises).filter(|_| rises.len() >= MIN_RISES);
    let (rise_s, sigma_s) = typical.ok_or(StartStopFitError::NoFit { what: "rise" })?;
    if let Some(start) = starts.first().filter(|start| rise_s < start.step_s) {
        return Err(StartStopFitError::TooSparse { step_s: start.step_s, rise_s });
    }
    let seen = |start: &Episode| {
        let delay_s = delay_of(start, fall, rise_s)?;
        let (at_s, idle_s, flow_mm3_per_s) = (start.at_s, start.idle_s, start.flow);
        Some(ObservedStart { at_s, idle_s, flow_mm3_per_s, delay_s, modelled_s: delay_s })
    };
    let seen: Option<Vec<ObservedStart>> = starts.iter().map(seen).collect();
    let starts = seen.ok_or(StartStopFitError::NoFit { what: "rise" })?;
    Ok(StartFit { time_constant_s: rise_s, sigma_s, starts })
}

/// Median and its standard error from the median deviation.
fn median_and_sigma(values: &[f64]) -> Option<(f64, f64)> {
    let median = rank::median(&mut values.to_vec())?;
    let deviations = values.iter().map(|value| (value - median).abs());
    // For a normal distribution the median deviation is 0.6745 σ, and the standard error of a
    // median is √(π/2)·σ/√n = 1.2533 σ/√n.
    let sigma = rank::median_of(deviations)? / 0.6745 * 1.2533 / to_f64(values.len()).sqrt();
    Some((median, sigma))
}

/// The relative flow after a start with this delay and time constant, with the rest of the run
/// before.
fn modelled(start: &Episode, fall: &StartStop, since_s: f64, [delay_s, rise_s]: [f64; 2]) -> f64 {
    let left =
        |since_s: f64| start.before / start.flow * fall.remaining_flow(start.idle_s + since_s);
    if since_s < delay_s {
        return left(since_s);
    }
    1.0 - (1.0 - left(delay_s)) * libm::exp(-(since_s - delay_s) / rise_s)
}

fn solve(start: &Episode, fall: &StartStop, first: [f64; 2], rise: [f64; 2]) -> Option<[f64; 2]> {
    let residuals = |row: &[f64]| -> Vec<f64> {
        let &[delay_s, rise_s] = row else { return Vec::new() };
        let of =
            |(at, fraction): &(f64, f64)| modelled(start, fall, *at, [delay_s, rise_s]) - fraction;
        start.samples.iter().map(of).collect()
    };
    let longest_s = start.samples.last()?.0;
    let solved = minimise(&residuals, &first, &[[0.0, longest_s], rise])?;
    let &[delay_s, rise_s] = solved.at.as_slice() else { return None };
    Some([delay_s, rise_s])
}

/// T of one start; `None` where the flow had not ceased before it.
fn time_constant_of(start: &Episode, fall: &StartStop) -> Option<f64> {
    /// Largest flow from the run before, over the new one.
    const MAX_REMAINING: f64 = 0.1;
    if start.before / start.flow * fall.remaining_flow(start.idle_s) > MAX_REMAINING {
        return None;
    }
    let half_s = half_rise_s(start)?;
    let first = [(half_s - 0.7 * fall.fall_s).max(0.0), fall.fall_s];
    solve(start, fall, first, TIME_CONSTANT_RANGE_S).map(|[_, rise_s]| rise_s)
}

fn delay_of(start: &Episode, fall: &StartStop, rise_s: f64) -> Option<f64> {
    let half_s = half_rise_s(start)?;
    let first = [(half_s - 0.7 * rise_s).max(0.0), rise_s];
    let almost = [rise_s * (1.0 - 1e-6), rise_s * (1.0 + 1e-6)];
    solve(start, fall, first, almost).map(|[delay_s, _]| delay_s)
}

/// When the flow reaches half of its final value permanently \[s\].
fn half_rise_s(start: &Episode) -> Option<f64> {
    let above = |window: &[(f64, f64)]| window.iter().all(|(_, fraction)| *fraction > 0.5);
    let windows = || start.samples.windows(CONSECUTIVE_SAMPLES);
    // Flow from the run before is no first flow.
    let from = windows().position(|window| !above(window)).unwrap_or(0);
    let at = from + windows().skip(from).position(above)?;
    start.samples.get(at).map(|(at, _)| *at)
}
