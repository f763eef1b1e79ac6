//! How the robot answers its setpoints: a dead time and a lag, from the setpoint's
//! sending to the report of the speed.

use serde::Serialize;

use super::{Known, Log};
use crate::control::{RobotMode, RobotState};
use crate::time::{Span, Stamp};

/// Dead times and lags that are tried \[s\].
const MOST_DEAD_S: f64 = 0.8;
const MOST_LAG_S: f64 = 1.0;
/// Steps of the first look at the dead time \[s\], and the lags of it.
const DEAD_STEP_S: f64 = 0.01;
const LAGS_S: [f64; 14] =
    [0.0, 0.005, 0.01, 0.016, 0.025, 0.04, 0.06, 0.09, 0.13, 0.19, 0.28, 0.4, 0.6, 0.9];
/// Smallest step of the search \[s\].
const FINEST_S: f64 = 1e-5;
/// Change of setpoints that counts as a step, as a share.
const LEAST_STEP: f64 = 0.01;
/// Steps below which dead time and lag are not told.
const FEWEST_STEPS: usize = 3;
/// Longest time between two reports that the answer is followed over.
const LONGEST_GAP: Span = Span::from_millis(500);
/// Part of a lag within which its end shows in the reports.
const STEP_OF_SIGMA: f64 = 1e-3;

/// The robot's answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RobotAnswer {
    /// From the setpoint's sending until the reported speed begins to change \[s\].
    pub dead_time_s: Known,
    /// Time constant of the change \[s\].
    pub lag_s: Known,
    /// What is left of the reported speeds \[mm/s\], root mean square.
    pub left_mm_per_s: f64,
    /// Steps of the setpoint that told it.
    pub steps: usize,
}

/// Why the robot's answer is not told.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// The setpoints hardly changed.
    #[error(
        "only {found} setpoints differ by 1 % or more from the one before, and {FEWEST_STEPS} are \
         needed to see how the robot answers them"
    )]
    TooFewSteps {
        /// Steps that were sent.
        found: usize,
    },
    /// The reported speed follows something else.
    #[error(
        "the reported speed does not follow the setpoints: {left:.2} mm/s are left of {moved:.2} \
         (root mean square)"
    )]
    DoesNotFollow {
        /// What is left of the reported speeds \[mm/s\].
        left: f64,
        /// How far they are from their mean \[mm/s\].
        moved: f64,
    },
}

/// A report that the answer is held against.
#[derive(Debug, Clone, Copy)]
struct Report {
    at_s: f64,
    speed: f64,
    /// Whether the answer is begun anew with it.
    is_first: bool,
}

/// Finds dead time and lag by least squares.
pub fn answer(log: &Log) -> Result<RobotAnswer, RobotError> {
    let told: Vec<(f64, f64)> =
        log.setpoints.iter().map(|(at, speed)| (at.secs(), speed.get())).collect();
    let steps = changes(&told);
    if steps < FEWEST_STEPS {
        return Err(RobotError::TooFewSteps { found: steps });
    }
    let reports = printing(&log.states, told[0].0);
    let count = number(reports.len());
    let squares = |at: [f64; 2]| squares(&told, &reports, at);
    let best = search(&squares);
    let left = squares(best) / count.max(1.0);
    let mean = reports.iter().map(|report| report.speed).sum::<f64>() / count.max(1.0);
    let moved =
        reports.iter().map(|report| (report.speed - mean).powi(2)).sum::<f64>() / count.max(1.0);
    if left > 0.25 * moved {
        return Err(RobotError::DoesNotFollow { left: left.sqrt(), moved: moved.sqrt() });
    }
    let [dead, lag] = sigmas(&told, &reports, best, left);
    Ok(RobotAnswer {
        dead_time_s: Known { value: best[0], sigma: dead },
        lag_s: Known { value: best[1], sigma: lag },
        left_mm_per_s: left.sqrt(),
        steps,
    })
}

fn changes(told: &[(f64, f64)]) -> usize {
    let pairs = told.iter().zip(told.iter().skip(1));
    pairs.filter(|((_, a), (_, b))| (b - a).abs() > LEAST_STEP * a.abs()).count()
}

/// Reports while the robot goes by setpoints. A bead's run-up, before its speed is
/// once that of a setpoint, is no answer to one.
fn printing(states: &[(Stamp, RobotState)], from_s: f64) -> Vec<Report> {
    let mut reports: Vec<Report> = Vec::new();
    let mut before: Option<(Stamp, f64)> = None;
    for (at, state) in states {
        let path = state.path_mm.get();
        if state.mode != RobotMode::Print || state.seq == 0 || at.secs() < from_s {
            before = None;
            continue;
        }
        let follows =
            before.is_some_and(|(last, at_path)| *at - last <= LONGEST_GAP && path >= at_path);
        reports.push(Report {
            at_s: at.secs(),
            speed: state.speed_mm_per_s.get(),
            is_first: !follows,
        });
        before = Some((*at, path));
    }
    reports
}

/// What each reported speed differs from the model's.
fn left(told: &[(f64, f64)], reports: &[Report], [dead_s, lag_s]: [f64; 2]) -> Vec<f64> {
    let mut speed = 0.0;
    let mut last_s = f64::NEG_INFINITY;
    let mut next = 0;
    let mut input = told.first().map_or(0.0, |first| first.1);
    let mut differences = Vec::with_capacity(reports.len());
    for report in reports {
        if report.is_first {
            (speed, last_s) = (report.speed, report.at_s);
        }
        while let Some((at_s, value)) = told.get(next).filter(|(at, _)| at + dead_s <= report.at_s)
        {
            let at_s = at_s + dead_s;
            speed = lagged(speed, input, at_s - last_s, lag_s);
            last_s = last_s.max(at_s);
            input = *value;
            next += 1;
        }
        speed = lagged(speed, input, report.at_s - last_s, lag_s);
        last_s = report.at_s;
        differences.push(report.speed - speed);
    }
    differences
}

fn lagged(speed: f64, input: f64, dt_s: f64, lag_s: f64) -> f64 {
    if dt_s <= 0.0 {
        return speed;
    }
    if lag_s <= 0.0 {
        return input;
    }
    input + (speed - input) * libm::exp(-dt_s / lag_s)
}

fn squares(told: &[(f64, f64)], reports: &[Report], at: [f64; 2]) -> f64 {
    left(told, reports, at).iter().map(|left| left * left).sum()
}

/// On a grid, then by shorter and shorter steps in all directions.
fn search(squares: &impl Fn([f64; 2]) -> f64) -> [f64; 2] {
    let mut best = ([0.0, 0.0], f64::INFINITY);
    let mut dead_s = 0.0;
    while dead_s <= MOST_DEAD_S {
        for lag_s in LAGS_S {
            let found = squares([dead_s, lag_s]);
            if found < best.1 {
                best = ([dead_s, lag_s], found);
            }
        }
        dead_s += DEAD_STEP_S;
    }
    let mut step = DEAD_STEP_S;
    // Along the valley of a dead time that stands for a lag as well as beside it.
    let ways = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];
    while step > FINEST_S {
        let tried = ways.map(|[dead, lag]| {
            let at = [
                (best.0[0] + dead * step).clamp(0.0, MOST_DEAD_S),
                (best.0[1] + lag * step).clamp(0.0, MOST_LAG_S),
            ];
            (at, squares(at))
        });
        let next = tried.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        match next.filter(|next| next.1 < best.1) {
            Some(next) => best = next,
            None => step *= 0.5,
        }
    }
    best.0
}

/// Standard deviations by the slopes of the model at the best, for what is left as
/// independent noise.
fn sigmas(told: &[(f64, f64)], reports: &[Report], best: [f64; 2], variance: f64) -> [f64; 2] {
    let slope = |which: usize| {
        let mut ends = [best, best];
        ends[0][which] = (best[which] - STEP_OF_SIGMA).max(0.0);
        ends[1][which] = best[which] + STEP_OF_SIGMA;
        let way = ends[1][which] - ends[0][which];
        let [low, high] = ends.map(|at| left(told, reports, at));
        low.into_iter().zip(high).map(move |(low, high)| (high - low) / way).collect::<Vec<_>>()
    };
    let [dead, lag] = [slope(0), slope(1)];
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (dd, ll, dl) = (product(&dead, &dead), product(&lag, &lag), product(&dead, &lag));
    let det = (dd * ll - dl * dl).max(f64::MIN_POSITIVE);
    [(variance * ll / det).sqrt(), (variance * dd / det).sqrt()].map(|sigma| sigma.min(MOST_LAG_S))
}

#[expect(clippy::cast_precision_loss, reason = "a count of reports")]
fn number(count: usize) -> f64 {
    count as f64
}
