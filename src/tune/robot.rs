//! How the robot answers its setpoints: a dead time and a lag, from the setpoint's
//! sending to the report of the speed, and a largest slope where it has one.

use serde::Serialize;

use super::{Estimated, Log};
use crate::core::robot::{RobotMode, RobotState};
use crate::core::time::{Span, Stamp};
use crate::core::units::MmPerS;
use crate::link::robot::motion::{PathMotion, SpeedLoop};
use crate::numeric::number::to_f64;

/// Dead times and lags that are tried \[s\].
const MAX_DEAD_TIME_S: f64 = 0.8;
const MAX_LAG_S: f64 = 1.0;
/// Steps of the first look at the dead time \[s\], and the lags of it.
const DEAD_STEP_S: f64 = 0.02;
const LAGS_S: [f64; 9] = [0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.3, 0.5, 0.9];
/// A lag below which it is none \[s\].
const MIN_LAG_S: f64 = 1e-6;
/// Slopes of the speed that are tried, and one that is no limit \[mm/s²\].
const SLOPES: [f64; 9] = [15.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0, 1900.0, 3800.0];
const NO_SLOPE: f64 = 1e9;
/// Change of a slope's logarithm for a step of the search of a second.
const LN_SLOPE_PER_STEP: f64 = 20.0;
/// Part of the squares that may be left with a limit of the slope for it to count.
const MAX_RESIDUAL_RATIO: f64 = 0.5;
/// Smallest step of the search \[s\].
const MIN_SEARCH_STEP_S: f64 = 1e-5;
/// Change of setpoints that counts as a step, as a fraction.
const MIN_SETPOINT_CHANGE: f64 = 0.01;
/// Steps below which dead time and lag are not told.
const MIN_STEPS: usize = 3;
/// Reports that are needed.
const MIN_REPORTS: usize = 20;
/// Longest time between two reports that the answer is followed over.
const MAX_REPORT_GAP: Span = Span::from_millis(500);
/// Part of a lag within which its end shows in the reports.
const DERIVATIVE_STEP_S: f64 = 1e-3;

/// The robot's answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RobotResponse {
    /// From the setpoint's sending until the reported speed begins to change \[s\].
    pub dead_time_s: Estimated,
    /// Time constant of the change \[s\].
    pub lag_s: Estimated,
    /// Largest slope of the speed, where the robot's own is one \[mm/s²\].
    pub slope_mm_per_s2: Option<f64>,
    /// Residual of the reported speeds \[mm/s\], root mean square.
    pub residual_mm_per_s: f64,
    /// Steps of the setpoint that told it.
    pub steps: usize,
}

/// Why the robot's answer is not told.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RobotResponseError {
    /// The setpoints hardly changed.
    #[error(
        "only {found} setpoints differ by 1 % or more from the one before, and {MIN_STEPS} are \
         needed to see how the robot answers them"
    )]
    TooFewSteps {
        /// Steps that were sent.
        found: usize,
    },
    /// The robot hardly reported while it went by setpoints.
    #[error(
        "only {found} reports are of a robot that prints by setpoints, and {MIN_REPORTS} are \
         needed to see how it answers them"
    )]
    TooFewReports {
        /// Reports that were.
        found: usize,
    },
    /// The reported speed follows something else.
    #[error(
        "the reported speed does not follow the setpoints: {left:.2} mm/s are left of {moved:.2} \
         (root mean square)"
    )]
    DoesNotFollow {
        /// Residual of the reported speeds \[mm/s\].
        left: f64,
        /// How far they are from their mean \[mm/s\].
        moved: f64,
    },
}

/// A speed that was sent.
#[derive(Debug, Clone, Copy)]
struct Setpoint {
    at_s: f64,
    speed: f64,
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
pub fn fit_response(log: &Log) -> Result<RobotResponse, RobotResponseError> {
    let setpoint = |(at, speed): &(Stamp, MmPerS)| Setpoint { at_s: at.secs(), speed: speed.get() };
    let setpoints: Vec<Setpoint> = log.setpoints.iter().map(setpoint).collect();
    let steps = count_steps(&setpoints);
    if steps < MIN_STEPS {
        return Err(RobotResponseError::TooFewSteps { found: steps });
    }
    let reports = reports_under_setpoints(&log.states, setpoints[0].at_s);
    if reports.len() < MIN_REPORTS {
        return Err(RobotResponseError::TooFewReports { found: reports.len() });
    }
    let count = to_f64(reports.len());
    let squares = |at: ResponseParameters| sum_of_squares(&setpoints, &reports, at);
    let best = search(&squares);
    let mean_square = squares(best) / count;
    let mean = reports.iter().map(|report| report.speed).sum::<f64>() / count;
    let moved = reports.iter().map(|report| (report.speed - mean).powi(2)).sum::<f64>() / count;
    if mean_square > 0.25 * moved {
        return Err(RobotResponseError::DoesNotFollow {
            left: mean_square.sqrt(),
            moved: moved.sqrt(),
        });
    }
    let [dead, lag] = sigmas(&setpoints, &reports, best, mean_square);
    Ok(RobotResponse {
        dead_time_s: Estimated { value: best[0], sigma: dead },
        lag_s: Estimated { value: best[1], sigma: lag },
        slope_mm_per_s2: (best[2] < NO_SLOPE.ln()).then(|| libm::exp(best[2])),
        residual_mm_per_s: mean_square.sqrt(),
        steps,
    })
}

fn count_steps(setpoints: &[Setpoint]) -> usize {
    let pairs = setpoints.iter().zip(setpoints.iter().skip(1));
    pairs.filter(|(a, b)| (b.speed - a.speed).abs() > MIN_SETPOINT_CHANGE * a.speed.abs()).count()
}

/// Reports while the robot goes by setpoints. A bead's run-up, before its speed is
/// once that of a setpoint, is no answer to one.
fn reports_under_setpoints(states: &[(Stamp, RobotState)], from_s: f64) -> Vec<Report> {
    let mut reports: Vec<Report> = Vec::new();
    let mut before: Option<(Stamp, f64)> = None;
    for (at, state) in states {
        let path = state.path_mm.get();
        if state.mode != RobotMode::Print || state.seq == 0 || at.secs() < from_s {
            before = None;
            continue;
        }
        let follows =
            before.is_some_and(|(last, at_path)| *at - last <= MAX_REPORT_GAP && path >= at_path);
        reports.push(Report {
            at_s: at.secs(),
            speed: state.speed_mm_per_s.get(),
            is_first: !follows,
        });
        before = Some((*at, path));
    }
    reports
}

/// Dead time \[s\], lag \[s\] and logarithm of the largest slope of the speed in mm/s².
type ResponseParameters = [f64; 3];

/// What each reported speed differs from the model's.
fn residuals(setpoints: &[Setpoint], reports: &[Report], answer: ResponseParameters) -> Vec<f64> {
    let [dead_s, lag_s, ln_slope] = answer;
    let accel = libm::exp(ln_slope);
    let lag_s = lag_s.max(MIN_LAG_S);
    let mut motion = PathMotion::default();
    let mut last_s = f64::NEG_INFINITY;
    let mut next = 0;
    let mut target = setpoints.first().map_or(0.0, |first| first.speed);
    let mut differences = Vec::with_capacity(reports.len());
    for report in reports {
        if report.is_first {
            (motion.speed, last_s) = (report.speed, report.at_s);
        }
        let mut go = |target: f64, at_s: f64| {
            motion = motion.after(SpeedLoop { target, lag_s, accel }, (at_s - last_s).max(0.0));
            last_s = last_s.max(at_s);
        };
        while let Some(due) = setpoints.get(next).filter(|due| due.at_s + dead_s <= report.at_s) {
            go(target, due.at_s + dead_s);
            target = due.speed;
            next += 1;
        }
        go(target, report.at_s);
        differences.push(report.speed - motion.speed);
    }
    differences
}

fn sum_of_squares(setpoints: &[Setpoint], reports: &[Report], at: ResponseParameters) -> f64 {
    residuals(setpoints, reports, at).iter().map(|left| left * left).sum()
}

/// The best without a limit of the slope; the best with one where that leaves much less.
fn search(squares: &impl Fn(ResponseParameters) -> f64) -> ResponseParameters {
    let free = pattern_search(squares, grid_search(squares, &[NO_SLOPE.ln()]), false);
    let slopes: Vec<f64> = SLOPES.iter().map(|slope| slope.ln()).collect();
    let bound = pattern_search(squares, grid_search(squares, &slopes), true);
    if squares(bound) < MAX_RESIDUAL_RATIO * squares(free) { bound } else { free }
}

/// On a grid.
fn grid_search(
    squares: &impl Fn(ResponseParameters) -> f64,
    ln_slopes: &[f64],
) -> ResponseParameters {
    let mut best = ([0.0; 3], f64::INFINITY);
    let mut dead_s = 0.0;
    while dead_s <= MAX_DEAD_TIME_S {
        for lag_s in LAGS_S {
            for ln_slope in ln_slopes {
                let at = [dead_s, lag_s, *ln_slope];
                let found = squares(at);
                if found < best.1 {
                    best = (at, found);
                }
            }
        }
        dead_s += DEAD_STEP_S;
    }
    best.0
}

/// By shorter and shorter steps in all directions, and along the valleys in which one
/// of them stands for another.
fn pattern_search(
    squares: &impl Fn(ResponseParameters) -> f64,
    from: ResponseParameters,
    moves_slope: bool,
) -> ResponseParameters {
    let ways =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]];
    let ways = &ways[..if moves_slope { 5 } else { 3 }];
    let mut best = (from, squares(from));
    let mut step = DEAD_STEP_S;
    while step > MIN_SEARCH_STEP_S {
        let tried = ways.iter().flat_map(|way| [1.0, -1.0].map(|side| (way, side * step)));
        let tried = tried.map(|([dead, lag, slope], by)| {
            let at = [
                (best.0[0] + dead * by).clamp(0.0, MAX_DEAD_TIME_S),
                (best.0[1] + lag * by).clamp(0.0, MAX_LAG_S),
                best.0[2] + slope * by * LN_SLOPE_PER_STEP,
            ];
            (at, squares(at))
        });
        match tried.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|next| next.1 < best.1) {
            Some(next) => best = next,
            None => step *= 0.5,
        }
    }
    best.0
}

/// Standard deviations by the slopes of the model at the best, for what is left as
/// independent noise.
fn sigmas(
    setpoints: &[Setpoint],
    reports: &[Report],
    best: ResponseParameters,
    variance: f64,
) -> [f64; 2] {
    let slope = |which: usize| {
        let mut ends = [best, best];
        ends[0][which] = (best[which] - DERIVATIVE_STEP_S).max(0.0);
        ends[1][which] = best[which] + DERIVATIVE_STEP_S;
        let way = ends[1][which] - ends[0][which];
        let [low, high] = ends.map(|at| residuals(setpoints, reports, at));
        low.into_iter().zip(high).map(move |(low, high)| (high - low) / way).collect::<Vec<_>>()
    };
    let [dead, lag] = [slope(0), slope(1)];
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (dd, ll, dl) = (product(&dead, &dead), product(&lag, &lag), product(&dead, &lag));
    let det = (dd * ll - dl * dl).max(f64::MIN_POSITIVE);
    [(variance * ll / det).sqrt(), (variance * dd / det).sqrt()].map(|sigma| sigma.min(MAX_LAG_S))
}
