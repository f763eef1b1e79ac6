//! Columns with times of their own, as in a recording. Two of them are brought to the times of
//! the output.

use super::experiment::{Experiment, ExperimentError, MIN_SAMPLES, Rules, check_gaps};
use super::grid::{TimeGrid, usual_step};

/// A column with its times.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeSeries {
    /// Its name, which ends with its unit.
    pub name: String,
    /// Moments, which only grow \[s\].
    pub time_s: Vec<f64>,
    /// The value at each time.
    pub values: Vec<f64>,
    /// Whether each value holds until the next, as a command does.
    pub is_held: bool,
}

impl TimeSeries {
    /// An empty one.
    pub fn new(name: impl Into<String>, is_held: bool) -> Self {
        Self { name: name.into(), time_s: Vec::new(), values: Vec::new(), is_held }
    }

    /// Adds a value, unless it is not later than the last one.
    pub fn push(&mut self, time_s: f64, value: f64) {
        if self.time_s.last().is_none_or(|last| time_s > *last) {
            self.time_s.push(time_s);
            self.values.push(value);
        }
    }

    /// Samples.
    pub fn len(&self) -> usize {
        self.time_s.len().min(self.values.len())
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The part between two moments \[s\], inclusive.
    #[must_use]
    pub fn within(&self, from_s: f64, to_s: f64) -> Self {
        let low = self.time_s.partition_point(|time| *time < from_s);
        let high = self.time_s.partition_point(|time| *time <= to_s).max(low);
        Self {
            name: self.name.clone(),
            time_s: self.time_s.get(low..high).unwrap_or_default().to_vec(),
            values: self.values.get(low..high).unwrap_or_default().to_vec(),
            is_held: self.is_held,
        }
    }

    /// Linear interpolation; `None` outside the samples.
    pub fn at(&self, time_s: f64) -> Option<f64> {
        let after = self.time_s.partition_point(|time| *time < time_s);
        let (to, high) = (*self.time_s.get(after)?, *self.values.get(after)?);
        let Some(before) = after.checked_sub(1) else {
            return (to <= time_s).then_some(high);
        };
        let (from, low) = (*self.time_s.get(before)?, *self.values.get(before)?);
        Some(low + (high - low) * (time_s - from) / (to - from))
    }

    /// Mean of held values between two moments. The first value also holds before its time, the
    /// last one after the end.
    fn held_mean(&self, from_s: f64, to_s: f64) -> f64 {
        let first = self.time_s.partition_point(|time| *time <= from_s).saturating_sub(1);
        let value = |at: usize| self.values.get(at).or(self.values.last()).copied().unwrap_or(0.0);
        let (mut sum, mut since, mut at) = (0.0, from_s, first);
        while let Some(&next) = self.time_s.get(at + 1).filter(|next| **next < to_s) {
            sum += value(at) * (next - since).max(0.0);
            since = since.max(next);
            at += 1;
        }
        if since == from_s {
            value(at)
        } else {
            (sum + value(at) * (to_s - since)) / (to_s - from_s)
        }
    }

    /// At the times of another column. A held column gives its mean until the next time, so
    /// that a step between two times is neither early nor late; a measured one is interpolated.
    fn resampled_at(&self, moments: &[f64]) -> Vec<f64> {
        let usual = usual_step(moments).unwrap_or(0.0);
        let value = |(k, moment): (usize, &f64)| {
            if self.is_held {
                self.held_mean(*moment, *moments.get(k + 1).unwrap_or(&(moment + usual)))
            } else {
                self.at(*moment).or(self.values.last().copied()).unwrap_or(0.0)
            }
        };
        moments.iter().enumerate().map(value).collect()
    }
}

/// Input and output where both exist, on the output's grid. Fails as [`Experiment::new`] does,
/// and on a gap of a measured input.
pub fn paired(
    input: &TimeSeries,
    output: &TimeSeries,
    rules: &Rules,
) -> Result<Experiment, ExperimentError> {
    let (Some(&first), Some(&last)) = (input.time_s.first(), input.time_s.last()) else {
        return Err(ExperimentError::TooFew { got: 0 });
    };
    let last = if input.is_held { last + usual_step(&input.time_s).unwrap_or(0.0) } else { last };
    let output = output.within(first, last);
    if output.len() < MIN_SAMPLES {
        return Err(ExperimentError::TooFew { got: output.len() });
    }
    if let Some(grid) = TimeGrid::of(&input.time_s).filter(|_| !input.is_held) {
        check_gaps(&grid, rules)?;
    }
    // The gaps of the output and its grid first, then what went in at each of its moments.
    let at_output = input.resampled_at(&output.time_s);
    let taken = Experiment::new(&output.time_s, &at_output, &output.values, rules)?;
    let moments = taken.moments();
    let input_is_held = input.is_held;
    Ok(Experiment { input: input.resampled_at(&moments), input_is_held, ..taken })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;

    fn series(step_s: f64, count: u32, held: bool, value: impl Fn(f64) -> f64) -> TimeSeries {
        let mut made = TimeSeries::new("x_rpm", held);
        for k in 0..count {
            let time_s = f64::from(k) * step_s;
            made.push(time_s, value(time_s));
        }
        made
    }

    #[test]
    fn a_command_that_changes_between_two_samples_counts_in_part() {
        let mut command = TimeSeries::new("command_rpm", true);
        for (time, value) in [(0.0, 10.0), (0.13, 20.0), (0.17, 40.0), (0.5, 0.0)] {
            command.push(time, value);
        }
        let on = command.resampled_at(&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5]);
        let middle = 0.3 * 10.0 + 0.4 * 20.0 + 0.3 * 40.0;
        for (found, wanted) in on.iter().zip([10.0, middle, 40.0, 40.0, 40.0, 0.0]) {
            assert!((found - wanted).abs() < 1e-9, "{on:?}");
        }
    }

    #[test]
    fn columns_of_different_rates_meet_on_the_output_s_grid() {
        let input = series(0.013, 1500, false, |t| 3.0 * t);
        let output = series(0.05, 500, false, |t| 7.0 - t).within(1.01, 60.0);
        let both = paired(&input, &output, &Rules::default()).unwrap();
        assert!((both.start_s - 1.05).abs() < 1e-12 && (both.step_s - 0.05).abs() < 1e-12);
        assert!((both.start_s + both.duration_s() - 19.45).abs() < 1e-9, "{}", both.duration_s());
        for (k, (u, y)) in both.input.iter().zip(&both.output).enumerate() {
            let time_s = 1.05 + 0.05 * f64::from(u32::try_from(k).unwrap());
            assert!((u - 3.0 * time_s).abs() < 1e-9 && (y - 7.0 + time_s).abs() < 1e-9);
        }
    }

    #[test]
    fn gaps_of_either_are_reported() {
        let whole = series(0.02, 600, false, f64::sin);
        let mut broken = whole.clone();
        broken.time_s.drain(200..260);
        broken.values.drain(200..260);
        for (input, output) in [(&broken, &whole), (&whole, &broken)] {
            let refused = paired(input, output, &Rules::default()).unwrap_err().to_string();
            assert!(refused.contains("a gap of 1.220 s after 3.980 s"), "{refused}");
        }
        let apart = TimeSeries { time_s: vec![100.0, 101.0], ..series(0.02, 2, false, f64::sin) };
        let refused = paired(&apart, &whole, &Rules::default()).unwrap_err();
        assert_eq!(refused, ExperimentError::TooFew { got: 0 });
    }
}
