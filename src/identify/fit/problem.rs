//! Prediction of a model and its derivatives with the parameters.
//!
//! The parameters are those of b(s)/a(s) with a denominator that ends in 1, so that a pole
//! which the data do not determine has a coefficient of zero: the numerator β0…βm, the
//! denominator α1…αn (each with its power of s), then dead time, output level and the free
//! response where they are estimated.

use super::samples::Samples;
use super::settings::{DeadTime, FitSettings, InitialCondition, OutputLevel};
use crate::numeric::average::standard_deviation;
use crate::numeric::levenberg_marquardt::LeastSquares;
use crate::numeric::lti::{Between, ModelError, Simulator, TransferFunction, polynomial};
use crate::numeric::number::to_f64;

/// Poles faster than this many per step are not observable. A choice.
const MAX_POLE_RATE_PER_STEP: f64 = 50.0;
/// A time constant longer than this many records is an integrator. A choice.
const MAX_TIME_CONSTANT_RECORDS: f64 = 100.0;

/// Data and settings of a fit.
#[derive(Debug, Clone)]
pub(super) struct FitProblem {
    /// Input less the input level.
    pub input: Vec<f64>,
    pub input_level: f64,
    pub output: Vec<f64>,
    pub dt_s: f64,
    pub poles: usize,
    pub zeros: usize,
    pub dead_time: DeadTime,
    pub level: OutputLevel,
    pub has_free_response: bool,
    pub between: Between,
}

/// Indices of the parameters.
pub(super) struct ParameterLayout {
    /// The first coefficient of the denominator; those of the numerator come before it.
    pub denominator_from: usize,
    pub dead_time: Option<usize>,
    pub level: Option<usize>,
    pub free_from: usize,
    pub total: usize,
}

impl FitProblem {
    pub fn new(samples: &Samples, settings: &FitSettings) -> Self {
        let first = samples.input().first().copied().unwrap_or(0.0);
        let input_level = match settings.initial_state {
            InitialCondition::Settled { input } => input,
            InitialCondition::SettledAtFirst | InitialCondition::Unknown => first,
        };
        Self {
            input: samples.input().iter().map(|u| u - input_level).collect(),
            input_level,
            output: samples.output().to_vec(),
            dt_s: samples.dt_s(),
            poles: settings.structure.poles(),
            zeros: settings.structure.zeros(),
            dead_time: settings.dead_time,
            level: settings.level,
            has_free_response: settings.initial_state == InitialCondition::Unknown,
            between: settings.between,
        }
    }

    /// The problem with means of `factor` samples each: input and output that are averaged alike
    /// still correspond.
    pub fn decimated(&self, factor: usize) -> Self {
        let n = to_f64(factor);
        let means = |row: &[f64]| -> Vec<f64> {
            row.chunks_exact(factor).map(|part| part.iter().sum::<f64>() / n).collect()
        };
        let (input, output) = (means(&self.input), means(&self.output));
        Self { input, output, dt_s: n * self.dt_s, ..self.clone() }
    }

    /// Where each parameter stands.
    pub fn layout(&self) -> ParameterLayout {
        let denominator_from = self.zeros + 1;
        let mut total = denominator_from + self.poles;
        let mut next = |is: bool| {
            total += usize::from(is);
            is.then(|| total - 1)
        };
        let dead_time = next(matches!(self.dead_time, DeadTime::Estimated { .. }));
        let level = next(self.level == OutputLevel::Estimated);
        let free_from = total;
        total += if self.has_free_response { self.poles } else { 0 };
        ParameterLayout { denominator_from, dead_time, level, free_from, total }
    }

    pub fn duration_s(&self) -> f64 {
        to_f64(self.output.len()) * self.dt_s
    }

    /// Denominator, highest power first.
    pub fn den(&self, theta: &[f64]) -> Vec<f64> {
        let from = self.zeros + 1;
        theta[from..from + self.poles].iter().rev().copied().chain([1.0]).collect()
    }

    pub fn dead_time_s(&self, theta: &[f64]) -> f64 {
        match self.dead_time {
            DeadTime::Known(given) => given,
            DeadTime::Estimated { .. } => theta[self.zeros + 1 + self.poles],
        }
    }

    pub fn transfer(&self, theta: &[f64]) -> Option<TransferFunction> {
        let num: Vec<f64> = theta[..=self.zeros].iter().rev().copied().collect();
        TransferFunction::new(&num, &self.den(theta), self.dead_time_s(theta)).ok()
    }

    pub fn output_level(&self, theta: &[f64]) -> f64 {
        match self.level {
            OutputLevel::Known(level) => level,
            OutputLevel::Estimated => self.layout().level.map_or(0.0, |position| theta[position]),
        }
    }

    /// Whether the parameters are those of a stable model.
    fn is_admissible(&self, theta: &[f64]) -> bool {
        let slow = theta[self.zeros + 1] > MAX_TIME_CONSTANT_RECORDS * self.duration_s();
        !slow && theta.iter().all(|p| p.is_finite()) && polynomial::is_hurwitz(&self.den(theta))
    }

    /// The predicted output; `None` for an inadmissible model.
    pub fn predict(&self, theta: &[f64]) -> Option<Vec<f64>> {
        if !self.is_admissible(theta) {
            return None;
        }
        let level = self.output_level(theta);
        let mut model = Simulator::new(&self.transfer(theta)?, self.dt_s, self.between).ok()?;
        let mut predicted: Vec<f64> = self.input.iter().map(|u| level + model.step(*u)).collect();
        if self.has_free_response {
            let layout = self.layout();
            let own: Vec<f64> = theta[layout.free_from..].iter().rev().copied().collect();
            let own = free_response(&own, &self.den(theta), self.dt_s, predicted.len()).ok()?;
            predicted.iter_mut().zip(own).for_each(|(y, own)| *y += own);
        }
        Some(predicted)
    }

    /// Responses of all linear parameters – numerator, level, free response – for a denominator
    /// and dead time, and their indices.
    pub fn linear_columns(&self, theta: &[f64]) -> Option<(Vec<usize>, Vec<Vec<f64>>)> {
        if !self.is_admissible(theta) {
            return None;
        }
        let layout = self.layout();
        let (den, dead_time_s) = (self.den(theta), self.dead_time_s(theta));
        let mut numbers = Vec::new();
        let mut columns = Vec::new();
        for i in 0..=self.zeros {
            let tf = TransferFunction::new(&power(i), &den, dead_time_s).ok()?;
            let mut model = Simulator::new(&tf, self.dt_s, self.between).ok()?;
            numbers.push(i);
            columns.push(self.input.iter().map(|u| model.step(*u)).collect());
        }
        if let Some(position) = layout.level {
            numbers.push(position);
            columns.push(vec![1.0; self.output.len()]);
        }
        if self.has_free_response {
            numbers.extend(layout.free_from..layout.total);
            columns.extend(free_responses(&den, self.dt_s, self.output.len()).ok()?);
        }
        Some((numbers, columns))
    }

    /// Magnitudes of the parameters, for difference quotients.
    pub fn scales(&self, theta: &[f64]) -> Vec<f64> {
        let layout = self.layout();
        let tiny = f64::MIN_POSITIVE;
        let mut time = 0.0_f64;
        for i in 1..=self.poles {
            let alpha = theta[layout.denominator_from + i - 1].abs();
            time = time.max(libm::pow(alpha, 1.0 / to_f64(i)));
        }
        let time = time.max(self.dt_s);
        let unit = |i: usize| libm::pow(time, to_f64(i));
        let gain = (0..=self.zeros).map(|i| theta[i].abs() / unit(i)).fold(tiny, f64::max);
        let mut scales: Vec<f64> = (0..=self.zeros).map(|i| gain * unit(i)).collect();
        scales.extend((1..=self.poles).map(unit));
        if layout.dead_time.is_some() {
            scales.push(time);
        }
        let amplitude = standard_deviation(&self.output).max(tiny);
        if layout.level.is_some() {
            scales.push(amplitude);
        }
        scales.extend((0..layout.total - layout.free_from).map(|i| amplitude * unit(i)));
        scales
    }

    /// By central differences, one-sided at an end of the range.
    fn finite_difference(&self, theta: &[f64], number: usize, step: f64) -> Option<Vec<f64>> {
        let [least, most] = self.range(theta, number);
        let moved = |by: f64| {
            let mut moved = theta.to_vec();
            moved[number] = (theta[number] + by).clamp(least, most);
            self.predict(&moved).map(|y| (moved[number], y))
        };
        let here = || self.predict(theta).map(|y| (theta[number], y));
        let (from, low) = moved(-step).or_else(here)?;
        let (to, high) = moved(step).or_else(here)?;
        Some(high.iter().zip(&low).map(|(a, b)| (a - b) / (to - from)).collect())
    }
}

impl LeastSquares for FitProblem {
    fn residuals(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let predicted = self.predict(theta)?;
        Some(self.output.iter().zip(&predicted).map(|(y, p)| y - p).collect())
    }

    /// Range of a parameter, which may depend on others.
    fn range(&self, theta: &[f64], number: usize) -> [f64; 2] {
        let layout = self.layout();
        if Some(number) == layout.dead_time
            && let DeadTime::Estimated { min_s, max_s } = self.dead_time
        {
            return [min_s, max_s];
        }
        let last_pole = layout.denominator_from + self.poles - 1;
        if number == last_pole {
            let before = if self.poles == 1 { 1.0 } else { theta[last_pole - 1].abs() };
            return [before * self.dt_s / MAX_POLE_RATE_PER_STEP, f64::MAX];
        }
        [f64::MIN, f64::MAX]
    }

    /// Derivative of the prediction with every parameter; `None` at the limit of stability.
    fn jacobian(&self, theta: &[f64]) -> Option<Vec<Vec<f64>>> {
        let scales = self.scales(theta);
        let (numbers, linear) = self.linear_columns(theta)?;
        let mut columns = vec![Vec::new(); theta.len()];
        for (number, column) in numbers.into_iter().zip(linear) {
            columns[number] = column;
        }
        for number in 0..theta.len() {
            if columns[number].is_empty() {
                columns[number] =
                    self.finite_difference(theta, number, RELATIVE_STEP * scales[number])?;
            }
        }
        Some(columns)
    }
}

/// s to a power, as a numerator.
fn power(i: usize) -> Vec<f64> {
    let mut num = vec![0.0; i + 1];
    num[0] = 1.0;
    num
}

/// Free response of an initial state: the response of c(s)/a(s) to a pulse one sample before
/// the first.
fn free_response(
    num: &[f64],
    den: &[f64],
    dt_s: f64,
    samples: usize,
) -> Result<Vec<f64>, ModelError> {
    let tf = TransferFunction::new(num, den, 0.0)?;
    let mut model = Simulator::new(&tf, dt_s, Between::Held)?;
    let _ = model.step(1.0);
    Ok((0..samples).map(|_| model.step(0.0)).collect())
}

/// Free responses for c = 1, s, …: together they span all free responses.
pub(super) fn free_responses(
    den: &[f64],
    dt_s: f64,
    samples: usize,
) -> Result<Vec<Vec<f64>>, ModelError> {
    (0..den.len() - 1).map(|i| free_response(&power(i), den, dt_s, samples)).collect()
}

/// Step of the difference quotients over the magnitude of a parameter. A choice between
/// truncation and rounding.
const RELATIVE_STEP: f64 = 1e-5;
