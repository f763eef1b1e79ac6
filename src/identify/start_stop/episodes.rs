//! Starts and stops in a recording, by the command, with the flow about each.

use super::error::StartStopFitError;
use crate::identify::grid::usual_step;
use crate::identify::series::TimeSeries;
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Command over its largest value above which the pump runs.
const RUN_FRACTION: f64 = 0.05;
/// Longest observation of a start \[s\].
const MAX_START_S: f64 = 30.0;
/// Longest observation of a stop \[s\].
const MAX_STOP_S: f64 = 6.0;
/// Shortest observation of a stop that shows the drool \[s\].
const MIN_STOP_S: f64 = 0.5;
/// Smallest fraction of the samples that must be present.
const MIN_COVERAGE: f64 = 0.8;
/// Fraction at the end of a run from which its flow is taken.
const STEADY_FRACTION: f64 = 0.4;
/// Relative change of a flow, or of a command, that is still steady.
const STEADY_TOLERANCE: f64 = 0.05;
/// Derived: 3·1.2533·2/(0.6745·√2), three standard deviations of the difference of the medians
/// of two halves, over the median change from sample to sample and √n.
const NOISE_FACTOR: f64 = 7.88;
/// Flow over the largest one below which a run has none…
const NO_FLOW_FRACTION: f64 = 0.1;
/// …unless it is shorter than this fraction of the median run.
const SHORT_FRACTION: f64 = 0.5;
/// Smallest number of samples of the flow.
const MIN_SAMPLES: usize = 50;
/// Smallest number of samples of a steady flow.
const MIN_STEADY_SAMPLES: usize = 10;

/// Flow after a change of the command.
#[derive(Debug, Clone)]
pub(super) struct Episode {
    /// When the command changed \[s\].
    pub at_s: f64,
    /// For a start: the pause before it. For a stop: the pause after it, as far as it was
    /// recorded \[s\].
    pub idle_s: f64,
    /// Steady flow of the run that begins or ends \[mm³/s\].
    pub flow: f64,
    /// Steady flow of the run before the pause \[mm³/s\].
    pub before: f64,
    /// Time since the change \[s\] and flow over the steady one.
    pub samples: Vec<(f64, f64)>,
    /// From one sample to the next \[s\].
    pub step_s: f64,
}

/// Starts and stops of a recording.
#[derive(Debug, Clone)]
pub(super) struct Episodes {
    pub runs: usize,
    pub starts: Vec<Episode>,
    pub stops: Vec<Episode>,
}

/// A time in which the pump runs by the command, and its steady flow.
#[derive(Debug, Clone, Copy)]
struct Run {
    from_s: f64,
    to_s: f64,
    /// Whether it ends with a stop; otherwise with the record.
    is_stop_commanded: bool,
    flow: f64,
    /// Whether the command was constant and the flow steady at its end.
    is_steady: bool,
}

/// Finds starts after a known pause, and stops of a steady flow.
pub(super) fn find(command: &TimeSeries, flow: &TimeSeries) -> Result<Episodes, StartStopFitError> {
    for (what, series, needed) in [("the command", command, 2), ("the flow", flow, MIN_SAMPLES)] {
        if series.len() < needed {
            return Err(StartStopFitError::TooFewSamples { what, found: series.len(), needed });
        }
    }
    let mut runs = runs(command, flow)?;
    let most = runs.iter().map(|run| run.flow).fold(0.0, f64::max);
    check_flow(&runs, most)?;
    for run in &mut runs {
        run.is_steady &= run.flow > NO_FLOW_FRACTION * most;
    }
    let pairs = runs.windows(2);
    let starts: Vec<Episode> = pairs.filter_map(|pair| start(flow, &pair[0], &pair[1])).collect();
    let ends_s = flow.time_s.last().copied().unwrap_or(0.0);
    let nexts = runs.iter().skip(1).map(|next| next.from_s).chain([ends_s]);
    let stops: Vec<Episode> =
        runs.iter().zip(nexts).filter_map(|(run, next_s)| stop(flow, run, next_s)).collect();
    check_count(&starts, &stops, &runs)?;
    Ok(Episodes { runs: runs.len(), starts, stops })
}

fn start(flow: &TimeSeries, last: &Run, run: &Run) -> Option<Episode> {
    let to_s = run.to_s.min(run.from_s + MAX_START_S);
    let (idle_s, before) = (run.from_s - last.to_s, last.flow);
    run.is_steady.then(|| episode(flow, [run.from_s, to_s], idle_s, [run.flow, before]))?
}

fn stop(flow: &TimeSeries, run: &Run, next_s: f64) -> Option<Episode> {
    let idle_s = next_s - run.to_s;
    let to_s = run.to_s + idle_s.min(MAX_STOP_S);
    let is_usable = run.is_stop_commanded && run.is_steady && idle_s >= MIN_STOP_S;
    is_usable.then(|| episode(flow, [run.to_s, to_s], idle_s, [run.flow, run.flow]))?
}

/// The flow between two moments; `None` where many samples are lost.
fn episode(
    flow: &TimeSeries,
    [from_s, to_s]: [f64; 2],
    idle_s: f64,
    [even, before]: [f64; 2],
) -> Option<Episode> {
    let step_s = usual_step(&flow.time_s)?;
    let part = flow.within(from_s, to_s);
    let pairs = part.time_s.iter().zip(&part.values);
    let samples: Vec<(f64, f64)> = pairs.map(|(t, q)| (t - from_s, q / even)).collect();
    let seen_s = to_f64(samples.len()) * step_s;
    let is_whole = seen_s >= MIN_COVERAGE * (to_s - from_s);
    is_whole.then_some(Episode { at_s: from_s, idle_s, flow: even, before, samples, step_s })
}

fn check_count(
    starts: &[Episode],
    stops: &[Episode],
    runs: &[Run],
) -> Result<(), StartStopFitError> {
    /// Smallest number of starts: the delay has three parameters.
    const MIN_STARTS: usize = 5;
    /// Smallest number of stops for a standard error.
    const MIN_STOPS: usize = 3;
    /// Smallest ratio of the longest to the shortest pause that shows a time constant.
    const MIN_PAUSE_RATIO: f64 = 5.0;
    if starts.len() < MIN_STARTS {
        let (found, left_out) = (starts.len(), runs.len() - starts.len());
        return Err(StartStopFitError::TooFewStarts { found, needed: MIN_STARTS, left_out });
    }
    if stops.len() < MIN_STOPS {
        return Err(StartStopFitError::TooFewStops { found: stops.len(), needed: MIN_STOPS });
    }
    let idle = || starts.iter().map(|start| start.idle_s);
    let (shortest_s, longest_s) = (idle().fold(f64::MAX, f64::min), idle().fold(0.0, f64::max));
    if longest_s < MIN_PAUSE_RATIO * shortest_s {
        let factor = MIN_PAUSE_RATIO;
        return Err(StartStopFitError::PausesTooSimilar { shortest_s, longest_s, factor });
    }
    Ok(())
}

/// Times in which the command runs the pump.
fn runs(command: &TimeSeries, flow: &TimeSeries) -> Result<Vec<Run>, StartStopFitError> {
    let most = command.values.iter().copied().fold(0.0, f64::max);
    if most <= 0.0 {
        return Err(StartStopFitError::NeverCommanded { max: most });
    }
    let (mut found, mut open) = (Vec::new(), None::<CommandedRun>);
    for (time_s, value) in command.time_s.iter().zip(&command.values) {
        match (&mut open, *value > RUN_FRACTION * most) {
            (None, true) => {
                open = Some(CommandedRun { from_s: *time_s, low: *value, high: *value });
            }
            (Some(command), true) => {
                (command.low, command.high) = (command.low.min(*value), command.high.max(*value));
            }
            (Some(command), false) => {
                found.push(run(flow, command, *time_s, true));
                open = None;
            }
            (None, false) => {}
        }
    }
    if let (Some(command), Some(to_s)) = (open, flow.time_s.last()) {
        found.push(run(flow, &command, *to_s, false));
    }
    Ok(found)
}

/// The command of a run.
#[derive(Debug, Clone, Copy)]
struct CommandedRun {
    from_s: f64,
    low: f64,
    high: f64,
}

fn run(flow: &TimeSeries, command: &CommandedRun, to_s: f64, is_stop_commanded: bool) -> Run {
    let from_s = command.from_s;
    let half_s = 0.5 * STEADY_FRACTION * (to_s - from_s);
    let end = flow.within(to_s - 2.0 * half_s, to_s).values;
    let part = |from_s: f64, to_s: f64| rank::median(&mut flow.within(from_s, to_s).values);
    let [early, late] = [part(to_s - 2.0 * half_s, to_s - half_s), part(to_s - half_s, to_s)];
    let even = rank::median(&mut end.clone()).unwrap_or(0.0);
    let changes = rank::median_of(end.windows(2).map(|pair| (pair[1] - pair[0]).abs()));
    let chance = NOISE_FACTOR * changes.unwrap_or(0.0) / to_f64(end.len()).sqrt();
    // A flow that is still rising grows from one half to the other.
    let grows = late.zip(early).map_or(f64::INFINITY, |(late, early)| (late - early).abs());
    let is_level = command.high - command.low <= STEADY_TOLERANCE * command.high;
    let is_even = is_level
        && end.len() >= MIN_STEADY_SAMPLES
        && chance < even.abs()
        && grows < STEADY_TOLERANCE * even.abs() + chance;
    Run { from_s, to_s, is_stop_commanded, flow: even, is_steady: is_even }
}

fn check_flow(runs: &[Run], most: f64) -> Result<(), StartStopFitError> {
    let usual_s = rank::median_of(runs.iter().map(|run| run.to_s - run.from_s)).unwrap_or(0.0);
    let dry = runs.iter().find(|run| {
        run.flow <= NO_FLOW_FRACTION * most && run.to_s - run.from_s >= SHORT_FRACTION * usual_s
    });
    match dry {
        None => Ok(()),
        Some(run) => Err(StartStopFitError::NoFlow {
            at_s: run.from_s,
            lasted_s: run.to_s - run.from_s,
            flow_mm3_per_s: run.flow,
            max_mm3_per_s: most,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_factor_is_its_formula() {
        assert!((NOISE_FACTOR - 3.0 * 1.2533 * 2.0 / (0.6745 * 2.0_f64.sqrt())).abs() < 0.005);
    }
}
