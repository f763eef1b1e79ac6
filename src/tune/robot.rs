//! Response of the robot to setpoints, from sending a setpoint to the report of the speed: a dead
//! time, a time constant, and a largest acceleration if there is one.

use serde::Serialize;

use super::{Estimated, Log};
use crate::core::{MmPerS, RobotMode, RobotState, Stamp};
use crate::identify::camera_offset::laid_speeds::MAX_GAP;
use crate::link::robot::motion::{PathMotion, SpeedLoop};
use crate::numeric::number::to_f64;
use crate::numeric::row::dot;

/// Largest dead time and time constant \[s\]. A choice: a slower robot cannot be controlled.
const MAX_DEAD_TIME_S: f64 = 0.8;
const MAX_LAG_S: f64 = 1.0;
/// Grid of the dead time and of the time constant \[s\].
const DEAD_STEP_S: f64 = 0.02;
const LAGS_S: [f64; 9] = [0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.3, 0.5, 0.9];
/// Time constant below which it is zero \[s\].
const MIN_LAG_S: f64 = 1e-6;
/// Tried accelerations, and a value that stands for no limit \[mm/s²\].
const SLOPES: [f64; 9] = [15.0, 30.0, 60.0, 120.0, 240.0, 480.0, 960.0, 1900.0, 3800.0];
const NO_SLOPE: f64 = 1e9;
/// Change of the logarithm of the acceleration for a search step of one second.
const LN_SLOPE_PER_STEP: f64 = 20.0;
/// Ratio of the sums of squares with and without an acceleration limit, below which there is a
/// limit. A choice.
const MAX_RESIDUAL_RATIO: f64 = 0.5;
/// Smallest step of the search \[s\].
const MIN_SEARCH_STEP_S: f64 = 1e-5;
/// Relative change of setpoints that counts as a step.
const MIN_SETPOINT_CHANGE: f64 = 0.01;
/// Smallest number of steps.
const MIN_STEPS: usize = 3;
/// Smallest number of reports.
const MIN_REPORTS: usize = 20;
/// Step of the finite differences \[s\].
const DERIVATIVE_STEP_S: f64 = 1e-3;

/// Response of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RobotResponse {
    /// Time from sending a setpoint until the reported speed changes \[s\].
    pub dead_time_s: Estimated,
    /// Time constant of the speed \[s\].
    pub lag_s: Estimated,
    /// Largest acceleration \[mm/s²\]; `None` if there is no limit.
    pub slope_mm_per_s2: Option<f64>,
    /// Root mean square residual of the reported speeds \[mm/s\].
    pub residual_mm_per_s: f64,
    /// Number of setpoint steps.
    pub steps: usize,
}

/// Why the response is not identified.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RobotResponseError {
    /// Too few setpoints changed.
    #[error(
        "only {found} setpoints differ by 1 % or more from the one before, and {MIN_STEPS} are \
         needed to see how the robot answers them"
    )]
    TooFewSteps {
        /// Number of setpoint steps.
        found: usize,
    },
    /// Too few reports while the robot follows setpoints.
    #[error(
        "only {found} reports are of a robot that prints by setpoints, and {MIN_REPORTS} are \
         needed to see how it answers them"
    )]
    TooFewReports {
        /// Number of those reports.
        found: usize,
    },
    /// The reported speed does not follow the setpoints.
    #[error(
        "the reported speed does not follow the setpoints: {left:.2} mm/s are left of {moved:.2} \
         (root mean square)"
    )]
    DoesNotFollow {
        /// Root mean square residual of the reported speeds \[mm/s\].
        left: f64,
        /// Standard deviation of the reported speeds \[mm/s\].
        moved: f64,
    },
}

/// A setpoint that was sent.
#[derive(Debug, Clone, Copy)]
struct Setpoint {
    at_s: f64,
    speed: f64,
}

/// A report of the speed.
#[derive(Debug, Clone, Copy)]
struct Report {
    at_s: f64,
    speed: f64,
    /// Whether it is the first of a bead.
    is_first: bool,
}

/// Dead time and time constant by least squares.
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
    let squares = |at: ResponseParameters| {
        residuals(&setpoints, &reports, at).iter().map(|left| left * left).sum::<f64>()
    };
    let best = search(&squares);
    let mean_square = squares(best) / count;
    let mean = reports.iter().map(|report| report.speed).sum::<f64>() / count;
    let moved = reports.iter().map(|report| (report.speed - mean).powi(2)).sum::<f64>() / count;
    if mean_square > 0.25 * moved {
        let (left, moved) = (mean_square.sqrt(), moved.sqrt());
        return Err(RobotResponseError::DoesNotFollow { left, moved });
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

/// Reports while the robot follows setpoints; the start of a bead, before the first setpoint, is
/// left out.
fn reports_under_setpoints(states: &[(Stamp, RobotState)], from_s: f64) -> Vec<Report> {
    let mut reports: Vec<Report> = Vec::new();
    let mut before: Option<(Stamp, f64)> = None;
    for (at, state) in states {
        let path = state.path_mm.get();
        if state.mode != RobotMode::Print || !state.has_setpoint || at.secs() < from_s {
            before = None;
            continue;
        }
        let follows =
            before.is_some_and(|(last, at_path)| *at - last <= MAX_GAP && path >= at_path);
        let (at_s, speed) = (at.secs(), state.speed_mm_per_s.get());
        reports.push(Report { at_s, speed, is_first: !follows });
        before = Some((*at, path));
    }
    reports
}

/// Dead time \[s\], time constant \[s\] and logarithm of the largest acceleration in mm/s².
type ResponseParameters = [f64; 3];

/// Reported speeds less the speeds of the model.
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

/// The best response without an acceleration limit, or with one if that fits much better.
fn search(squares: &impl Fn(ResponseParameters) -> f64) -> ResponseParameters {
    let free = pattern_search(squares, grid_search(squares, &[NO_SLOPE.ln()]), false);
    let slopes: Vec<f64> = SLOPES.iter().map(|slope| slope.ln()).collect();
    let bound = pattern_search(squares, grid_search(squares, &slopes), true);
    if squares(bound) < MAX_RESIDUAL_RATIO * squares(free) { bound } else { free }
}

/// The best parameters on a grid.
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

/// Pattern search (Hooke and Jeeves 1961) with successively shorter steps, also along
/// directions in which two parameters compensate each other.
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

/// Standard errors from the derivatives at the minimum, for independent residuals.
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
    let (dd, ll, dl) = (dot(&dead, &dead), dot(&lag, &lag), dot(&dead, &lag));
    let det = (dd * ll - dl * dl).max(f64::MIN_POSITIVE);
    [(variance * ll / det).sqrt(), (variance * dd / det).sqrt()].map(|sigma| sigma.min(MAX_LAG_S))
}
