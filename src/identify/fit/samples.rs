//! Samples of an input and an output, and whether a model can be told from
//! them.

use super::clipped::Clipped;
use super::settings::Before;

/// What is wrong with the data.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DataError {
    /// Columns of different lengths.
    #[error("{input} samples of the input and {output} of the output; both must be as many")]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// Hardly any samples.
    #[error("{found} samples; it needs at least {needed}")]
    TooFew {
        /// What was found.
        found: usize,
        /// What would do.
        needed: usize,
    },
    /// A sample that is no number.
    #[error("the {what} is {value} at sample {at}; cut the data there or mend it first")]
    NotFinite {
        /// `input`, `output` or `time`.
        what: &'static str,
        /// What was found.
        value: f64,
        /// First such sample, from 0.
        at: usize,
    },
    /// A time step that is none.
    #[error("a time step of {dt_s} s; it must be above zero")]
    Step {
        /// What was found \[s\].
        dt_s: f64,
    },
    /// Times that do not go on evenly.
    #[error(
        "{count} of the time steps differ from the usual {usual_s:.6} s, the first at sample \
         {first_at} ({first_time_s:.4} s, a step of {first_step_s:.6} s), the largest of \
         {largest_step_s:.6} s at {largest_time_s:.4} s; resample to even steps or cut the data \
         at the gaps"
    )]
    UnevenSteps {
        /// How many.
        count: usize,
        /// Median step \[s\].
        usual_s: f64,
        /// Sample before the first of them, from 0.
        first_at: usize,
        /// Its time \[s\].
        first_time_s: f64,
        /// The step there \[s\].
        first_step_s: f64,
        /// Where the largest step begins \[s\].
        largest_time_s: f64,
        /// The largest step \[s\].
        largest_step_s: f64,
    },
    /// An input that never changes.
    #[error("the input is {value} throughout; a model can be told only from an input that changes")]
    ConstantInput {
        /// Its value.
        value: f64,
    },
    /// An input that changes next to nothing.
    #[error(
        "the input changes by {range:.3e} at a level of {level:.4}, less than a part in ten \
         thousand; look at its unit, or excite it more"
    )]
    InputHardlyChanges {
        /// Largest less smallest.
        range: f64,
        /// Largest size.
        level: f64,
    },
    /// An output that never changes.
    #[error("the output is {value} throughout; look whether the sensor was on")]
    ConstantOutput {
        /// Its value.
        value: f64,
    },
    /// A signal that was cut off.
    #[error(transparent)]
    Clipped(#[from] Clipped),
}

/// Samples of an input and an output at even times.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples {
    input: Vec<f64>,
    output: Vec<f64>,
    dt_s: f64,
}

/// A record shorter than this is none.
pub(super) const FEWEST: usize = 10;
/// Part of the usual step by which a step may differ.
const EVEN: f64 = 0.01;
/// Change of an input as a part of its level that is noise of the arithmetic.
const HARDLY: f64 = 1e-4;

impl Samples {
    /// Of equally long rows, `dt_s` \[s\] apart. Fails where a number is not
    /// finite or there are fewer than ten.
    pub fn new(input: Vec<f64>, output: Vec<f64>, dt_s: f64) -> Result<Self, DataError> {
        if input.len() != output.len() {
            return Err(DataError::Lengths { input: input.len(), output: output.len() });
        }
        finite("input", &input)?;
        finite("output", &output)?;
        if !dt_s.is_finite() || dt_s <= 0.0 {
            return Err(DataError::Step { dt_s });
        }
        if input.len() < FEWEST {
            return Err(DataError::TooFew { found: input.len(), needed: FEWEST });
        }
        Ok(Self { input, output, dt_s })
    }

    /// The same with the times \[s\] of the samples, which must be even to 1 %
    /// of a step: it does not resample.
    pub fn at_times(times_s: &[f64], input: Vec<f64>, output: Vec<f64>) -> Result<Self, DataError> {
        finite("time", times_s)?;
        if times_s.len() != input.len() {
            return Err(DataError::Lengths { input: times_s.len(), output: input.len() });
        }
        let dt_s = even_step(times_s)?;
        Self::new(input, output, dt_s)
    }

    /// The input.
    pub fn input(&self) -> &[f64] {
        &self.input
    }

    /// The output.
    pub fn output(&self) -> &[f64] {
        &self.output
    }

    /// Step \[s\].
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Number of samples, at least ten.
    #[expect(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.input.len()
    }

    /// Length of the record \[s\].
    #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.dt_s
    }

    /// Whether the input changes, if only from what came before, and so does the
    /// output.
    pub fn check_input(&self, before: Before) -> Result<(), DataError> {
        let [mut least, mut most] = ends(&self.input);
        if let Before::Settled { input } = before {
            (least, most) = (least.min(input), most.max(input));
        }
        if least == most {
            return Err(DataError::ConstantInput { value: least });
        }
        let (range, level) = (most - least, most.abs().max(least.abs()));
        if range < HARDLY * level {
            return Err(DataError::InputHardlyChanges { range, level });
        }
        let [least, most] = ends(&self.output);
        if least == most { Err(DataError::ConstantOutput { value: least }) } else { Ok(()) }
    }
}

fn finite(what: &'static str, row: &[f64]) -> Result<(), DataError> {
    match row.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        Some((at, value)) => Err(DataError::NotFinite { what, value: *value, at }),
        None => Ok(()),
    }
}

pub(super) fn ends(row: &[f64]) -> [f64; 2] {
    row.iter().fold([f64::MAX, f64::MIN], |[least, most], v| [least.min(*v), most.max(*v)])
}

/// The mean step of times that go on evenly.
fn even_step(times_s: &[f64]) -> Result<f64, DataError> {
    if times_s.len() < FEWEST {
        return Err(DataError::TooFew { found: times_s.len(), needed: FEWEST });
    }
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let usual_s = sorted[sorted.len() / 2];
    if usual_s <= 0.0 {
        return Err(DataError::Step { dt_s: usual_s });
    }
    let uneven = |step: f64| (step - usual_s).abs() > EVEN * usual_s;
    let odd: Vec<usize> = (0..steps.len()).filter(|&k| uneven(steps[k])).collect();
    let largest = (0..steps.len()).max_by(|a, b| steps[*a].total_cmp(&steps[*b])).unwrap_or(0);
    if let Some(&first_at) = odd.first() {
        return Err(DataError::UnevenSteps {
            count: odd.len(),
            usual_s,
            first_at,
            first_time_s: times_s[first_at],
            first_step_s: steps[first_at],
            largest_time_s: times_s[largest],
            largest_step_s: steps[largest],
        });
    }
    #[expect(clippy::cast_precision_loss, reason = "a record has fewer than 2^52 samples")]
    let mean = (times_s[times_s.len() - 1] - times_s[0]) / steps.len() as f64;
    Ok(mean)
}

#[cfg(test)]
mod tests;
