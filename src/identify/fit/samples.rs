//! Samples of an input and an output, checked for identification.

use super::clipped::{self, Clipped};
use super::settings::InitialCondition;
use crate::identify::digits::six_digits;
use crate::numeric::number::to_f64;
use crate::numeric::row::min_max;

/// Magnitude above which squares and products might overflow.
const MAX_VALUE: f64 = 1e12;

/// What is wrong with the data.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SamplesError {
    /// Columns of different lengths.
    #[error("{input} samples of the input and {output} of the output; both must be as many")]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// Too few samples.
    #[error("{found} samples; it needs at least {needed}")]
    TooFew {
        /// Number of samples.
        found: usize,
        /// Number that is needed.
        needed: usize,
    },
    /// A sample that is not finite.
    #[error(
        "the {what} is {} at sample {at}, which nothing that is measured can be; cut the data \
         there or mend it first", six_digits(*.value)
    )]
    NotFinite {
        /// `input` or `output`.
        what: &'static str,
        /// Its value.
        value: f64,
        /// First such sample, from 0.
        at: usize,
    },
    /// An invalid time step.
    #[error("a time step of {dt_s} s; it must be above zero")]
    Step {
        /// The time step \[s\].
        dt_s: f64,
    },
    /// A constant input.
    #[error(
        "the input is {} throughout; a model can be identified only from an input that changes",
        six_digits(*.value)
    )]
    ConstantInput {
        /// Its value.
        value: f64,
    },
    /// An almost constant input.
    #[error(
        "the input changes by {range:.3e} at a level of {level:.4}, less than a part in ten \
         thousand; look at its unit, or excite it more"
    )]
    InputHardlyChanges {
        /// Largest less smallest value.
        range: f64,
        /// Largest magnitude.
        level: f64,
    },
    /// A constant output.
    #[error("the output is {} throughout; look whether the sensor was on", six_digits(*.value))]
    ConstantOutput {
        /// Its value.
        value: f64,
    },
    /// A clipped signal.
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

/// Smallest number of samples. A choice.
const MIN_SAMPLES: usize = 10;
/// Range of an input over its level below which it is constant but for rounding.
const MIN_RELATIVE_RANGE: f64 = 1e-4;

impl Samples {
    /// Rows of equal length, `dt_s` \[s\] apart. Fails where a number is not finite or there
    /// are fewer than ten.
    pub fn new(input: Vec<f64>, output: Vec<f64>, dt_s: f64) -> Result<Self, SamplesError> {
        if input.len() != output.len() {
            return Err(SamplesError::Lengths { input: input.len(), output: output.len() });
        }
        check_finite("input", &input)?;
        check_finite("output", &output)?;
        if !dt_s.is_finite() || dt_s <= 0.0 {
            return Err(SamplesError::Step { dt_s });
        }
        if input.len() < MIN_SAMPLES {
            return Err(SamplesError::TooFew { found: input.len(), needed: MIN_SAMPLES });
        }
        Ok(Self { input, output, dt_s })
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
    pub fn duration_s(&self) -> f64 {
        to_f64(self.len()) * self.dt_s
    }

    /// Whether input or output are clipped.
    pub fn check_clipped(&self) -> Result<(), Clipped> {
        clipped::check(&self.input, &self.output, self.dt_s)
    }

    /// Whether the input changes, at least from its initial value, and the output, too.
    pub fn check_input(&self, before: InitialCondition) -> Result<(), SamplesError> {
        let [mut least, mut most] = min_max(&self.input);
        if let InitialCondition::Settled { input } = before {
            (least, most) = (least.min(input), most.max(input));
        }
        if least == most {
            return Err(SamplesError::ConstantInput { value: least });
        }
        let (range, level) = (most - least, most.abs().max(least.abs()));
        if range < MIN_RELATIVE_RANGE * level {
            return Err(SamplesError::InputHardlyChanges { range, level });
        }
        let [least, most] = min_max(&self.output);
        if least == most { Err(SamplesError::ConstantOutput { value: least }) } else { Ok(()) }
    }
}

fn check_finite(what: &'static str, row: &[f64]) -> Result<(), SamplesError> {
    match row.iter().enumerate().find(|(_, value)| !value.is_finite() || value.abs() >= MAX_VALUE) {
        Some((at, value)) => Err(SamplesError::NotFinite { what, value: *value, at }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
