//! Initial models: least squares with state-variable filters at several bandwidths and dead
//! times (Young 1970), and models with one pole fewer.

use nalgebra::Complex;

use super::error::FitError;
use super::problem::FitProblem;
use super::settings::{DeadTime, OutputLevel};
use crate::numeric::levenberg_marquardt::{Descent, LeastSquares, Minimum, minimise};
use crate::numeric::linear::least_squares;
use crate::numeric::lti::{Between, Simulator, TransferFunction, polynomial};
use crate::numeric::number::{to_count, to_f64};
use crate::numeric::row::dot;

/// Bandwidths of the filter, evenly spaced in their logarithm. A choice between time and the risk
/// of a local minimum, as the next five.
const BANDWIDTHS: u32 = 5;
/// Largest number of dead times.
const MAX_DEAD_TIMES: usize = 25;
/// Initial models that are followed for a few steps; the next one, to the end.
const FOLLOWED_STARTS: usize = 5;
const FINAL_STARTS: usize = 2;
const FIRST_STEPS: usize = 8;
const MAX_STEPS: usize = 200;

/// Relative gain of a step, times the number of samples, that is negligible: one standard error
/// changes the sum of squares by one residual variance.
const MIN_GAIN: f64 = 1e-5;

/// A longer record is decimated to at least this many samples for the search; the last descent
/// uses all of them.
const MIN_SEARCH_SAMPLES: usize = 2000;

/// The best model from any initial model.
pub(super) fn best(problem: &FitProblem) -> Result<Minimum, FitError> {
    let factor = problem.output.len() / MIN_SEARCH_SAMPLES;
    let followed = if factor < 2 { search(problem) } else { search(&problem.decimated(factor)) };
    let ends = followed.iter().filter_map(|start| descend(problem, start, MAX_STEPS));
    ends.min_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares)).ok_or(FitError::NoStart)
}

fn descend(problem: &FitProblem, start: &Minimum, max_steps: usize) -> Option<Minimum> {
    let min_relative_gain = MIN_GAIN / to_f64(problem.output.len());
    let descent = Descent { max_steps, max_tries: 12, min_relative_gain, max_idle_steps: 2 };
    minimise(problem, &start.theta, descent)
}

/// The few models from which the last descent begins, after a short one of the best candidates.
fn search(problem: &FitProblem) -> Vec<Minimum> {
    let mut starts = candidates(problem);
    starts.sort_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    starts.dedup_by(|b, a| (b.sum_of_squares - a.sum_of_squares).abs() < 1e-6 * a.sum_of_squares);
    starts.truncate(FOLLOWED_STARTS);
    if problem.poles > 2 {
        starts.extend(from_fewer_poles(problem));
    }
    let mut followed: Vec<Minimum> =
        starts.iter().filter_map(|start| descend(problem, start, FIRST_STEPS)).collect();
    followed.sort_by(|a, b| a.sum_of_squares.total_cmp(&b.sum_of_squares));
    followed.truncate(FINAL_STARTS);
    followed
}

/// The best model with one pole fewer and a further pole of little effect: a model with more
/// poles is then never worse.
fn from_fewer_poles(problem: &FitProblem) -> Vec<Minimum> {
    let poles = problem.poles - 1;
    let fewer = FitProblem { poles, zeros: problem.zeros.min(poles), ..problem.clone() };
    let Ok(best) = best(&fewer) else { return Vec::new() };
    let slow: f64 = best.theta[fewer.zeros + 1];
    let with_pole = |time_s: f64| {
        let den = polynomial::multiply(&fewer.den(&best.theta), &[time_s, 1.0]);
        with_linear_part(problem, &den, fewer.dead_time_s(&best.theta))
    };
    [0.1 * problem.dt_s, problem.dt_s, 0.2 * slow].into_iter().filter_map(with_pole).collect()
}

/// An initial model from a denominator (highest power first, any scale) and a dead time, with
/// the best numerator.
fn with_linear_part(problem: &FitProblem, den: &[f64], dead_time_s: f64) -> Option<Minimum> {
    let layout = problem.layout();
    let mut theta = vec![0.0; layout.total];
    let last = den.last().copied()?;
    for (i, c) in den.iter().rev().skip(1).enumerate() {
        theta[layout.denominator_from + i] = c / last;
    }
    if let Some(position) = layout.dead_time {
        theta[position] = dead_time_s;
    }
    problem.project(&mut theta);
    let sum_of_squares = solve_linear(problem, &mut theta)?;
    Some(Minimum { theta, sum_of_squares })
}

/// Sets the linear parameters to their least-squares values.
fn solve_linear(problem: &FitProblem, theta: &mut [f64]) -> Option<f64> {
    let (numbers, columns) = problem.linear_columns(theta)?;
    let known = match problem.level {
        OutputLevel::Known(level) => level,
        OutputLevel::Estimated => 0.0,
    };
    let target: Vec<f64> = problem.output.iter().map(|y| y - known).collect();
    let found = least_squares(&columns, &target)?;
    let mut left = target;
    for ((number, value), column) in numbers.into_iter().zip(&found).zip(&columns) {
        theta[number] = *value;
        for (left, c) in left.iter_mut().zip(column) {
            *left -= value * c;
        }
    }
    Some(dot(&left, &left))
}

fn candidates(problem: &FitProblem) -> Vec<Minimum> {
    let dead_times = dead_times(problem);
    let slowest = 4.0 / problem.duration_s();
    let ratio = libm::log(0.5 / problem.dt_s / slowest) / f64::from(BANDWIDTHS - 1);
    let mut found = Vec::new();
    for k in 0..BANDWIDTHS {
        let bandwidth = slowest * libm::exp(ratio * f64::from(k));
        let Some(filtered) = Filtered::of(problem, bandwidth) else { continue };
        for &dead_time_s in &dead_times {
            let den = filtered.denominator(problem, dead_time_s);
            found.extend(den.and_then(|den| with_linear_part(problem, &den, dead_time_s)));
        }
    }
    found
}

/// Whole steps of a narrow range, evenly spaced in a wide one.
fn dead_times(problem: &FitProblem) -> Vec<f64> {
    let DeadTime::Estimated { min_s, max_s } = problem.dead_time else {
        return vec![problem.dead_time_s(&[])];
    };
    let steps = to_count(((max_s - min_s) / problem.dt_s).ceil());
    let count = steps.clamp(1, MAX_DEAD_TIMES - 1);
    let at = |k: usize| min_s + (max_s - min_s) * to_f64(k) / to_f64(count);
    (0..=count).map(at).collect()
}

/// Input, output and a constant, filtered by s^j/(s + λ)^n.
struct Filtered {
    /// j from 0 to the number of zeros.
    input: Vec<Vec<f64>>,
    /// j from 0 to the number of poles.
    output: Vec<Vec<f64>>,
    /// j from 0 to one below the number of poles; empty where the level is known and the record
    /// begins at rest.
    constant: Vec<Vec<f64>>,
}

impl Filtered {
    fn of(problem: &FitProblem, bandwidth: f64) -> Option<Self> {
        let n = problem.poles;
        let den = (0..n).fold(vec![1.0], |p, _| polynomial::multiply(&p, &[1.0, bandwidth]));
        let through = |row: &[f64], j: usize, between: Between| -> Option<Vec<f64>> {
            let mut num = vec![0.0; j + 1];
            num[0] = libm::pow(bandwidth, f64::from(u32::try_from(n - j).ok()?));
            let tf = TransferFunction::new(&num, &den, 0.0).ok()?;
            let mut model = Simulator::new(&tf, problem.dt_s, between).ok()?;
            Some(row.iter().map(|u| model.step(*u)).collect())
        };
        let level = match problem.level {
            OutputLevel::Known(level) => level,
            OutputLevel::Estimated => problem.output.first().copied()?,
        };
        let output: Vec<f64> = problem.output.iter().map(|y| y - level).collect();
        let unsettled = problem.has_free_response || problem.level == OutputLevel::Estimated;
        let ones = vec![1.0; output.len()];
        let constants = if unsettled { n } else { 0 };
        let rows = |row: &[f64], count: usize, between: Between| {
            (0..count).map(|j| through(row, j, between)).collect::<Option<Vec<_>>>()
        };
        let input = rows(&problem.input, problem.zeros + 1, problem.between)?;
        let output = rows(&output, n + 1, Between::Linear)?;
        let constant = rows(&ones, constants, Between::Held)?;
        Some(Self { input, output, constant }.unscaled(bandwidth, n))
    }

    /// From the filter of unit gain to s^j/(s + λ)^n.
    fn unscaled(mut self, bandwidth: f64, n: usize) -> Self {
        let power = |j: usize| (j..n).fold(1.0, |p, _| p * bandwidth);
        for rows in [&mut self.input, &mut self.output, &mut self.constant] {
            for (j, row) in rows.iter_mut().enumerate() {
                let factor = 1.0 / power(j);
                for value in row.iter_mut() {
                    *value *= factor;
                }
            }
        }
        self
    }

    /// A stable denominator from s^n·y = −Σ a(j)·s^j·y + Σ b(j)·s^j·u(t − L).
    fn denominator(&self, problem: &FitProblem, dead_time_s: f64) -> Option<Vec<f64>> {
        let delay = to_count((dead_time_s / problem.dt_s).round());
        let delayed = |row: &Vec<f64>| -> Vec<f64> {
            let zeros = std::iter::repeat_n(0.0, delay.min(row.len()));
            zeros.chain(row.iter().copied()).take(row.len()).collect()
        };
        let n = problem.poles;
        let mut columns: Vec<Vec<f64>> = self.output[..n].to_vec();
        columns.extend(self.input.iter().map(delayed));
        columns.extend(self.constant.iter().cloned());
        let found = least_squares(&columns, &self.output[n])?;
        let monic: Vec<f64> =
            [1.0].into_iter().chain(found[..n].iter().rev().map(|a| -a)).collect();
        Some(stabilised(&monic, problem))
    }
}

/// A denominator with its unstable poles mirrored, and no pole slower than the record or faster
/// than a tenth of a step.
fn stabilised(monic: &[f64], problem: &FitProblem) -> Vec<f64> {
    let (least, most) = (1.0 / problem.duration_s(), 10.0 / problem.dt_s);
    let mend = |pole: &Complex<f64>| {
        Complex::new(-pole.re.abs().clamp(least, most), pole.im.clamp(-most, most))
    };
    let poles: Vec<Complex<f64>> = polynomial::roots(monic).iter().map(mend).collect();
    polynomial::from_roots(&poles)
}
