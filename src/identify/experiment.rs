//! An input and an output on an even grid, once nothing speaks against finding
//! a model in them.

mod error;
mod outlier;

use std::fmt;

pub use self::error::{DataColumn, ExperimentError, MIN_SAMPLES};
use super::grid::{SampleGap, TimeGrid, usual_step};
use crate::numeric::number::to_f64;
pub use unit_check::implausible_unit;

/// Usual steps between these can be of an extruder's log \[s\]; beyond them the
/// unit of time is another.
const PLAUSIBLE_STEPS_S: std::ops::RangeInclusive<f64> = 2e-5..=2.0;
/// A column that moves by less than this share of its size is constant.
const MIN_RELATIVE_RANGE: f64 = 1e-9;

/// What was done to the data, or is odd about them, in words.
#[derive(Debug, Clone, PartialEq)]
pub enum DataNote {
    /// Gaps that were bridged.
    Bridged {
        /// How many.
        count: usize,
        /// The longest one.
        longest: SampleGap,
        /// The longest that would be \[s\].
        limit_s: f64,
    },
    /// Uneven sampling.
    Resampled {
        /// Step of the grid \[s\].
        step_s: f64,
    },
}

impl fmt::Display for DataNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bridged { count, longest, limit_s } => write!(
                f,
                "{count} gap{} bridged by straight lines, the longest of {:.3} s after {:.3} s (up \
                 to {limit_s:.3} s are)",
                if *count == 1 { "" } else { "s" },
                longest.length_s,
                longest.from_s
            ),
            Self::Resampled { step_s } => write!(
                f,
                "sampled unevenly; taken to a grid of {:.6} s ({:.2} Hz)",
                step_s,
                1.0 / step_s
            ),
        }
    }
}

/// What may be done to data.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rules {
    /// Gaps up to this are bridged \[s\]; none for five steps.
    pub max_gap_s: Option<f64>,
    /// Whether the unit of time was told, and is not doubted.
    pub is_time_unit_known: bool,
}

/// An input and an output on one even grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Moment of the first sample \[s\].
    pub start_s: f64,
    /// From sample to sample \[s\].
    pub step_s: f64,
    /// What goes in, in its own unit.
    pub input: Vec<f64>,
    /// What comes out, in its own unit.
    pub output: Vec<f64>,
    /// Whether the input holds each value until the next, as a command does,
    /// and does not run straight to it.
    pub input_is_held: bool,
    /// What was done to the data.
    pub notes: Vec<DataNote>,
}

impl Experiment {
    /// From columns of one length.
    pub fn new(
        time_s: &[f64],
        input: &[f64],
        output: &[f64],
        rules: &Rules,
    ) -> Result<Self, ExperimentError> {
        let got = time_s.len().min(input.len()).min(output.len());
        if got < MIN_SAMPLES {
            return Err(ExperimentError::TooFew { got });
        }
        check_time(time_s, rules)?;
        let grid = TimeGrid::of(time_s).ok_or(ExperimentError::TooFew { got })?;
        let notes = bridge_gaps(&grid, rules)?;
        for (side, values) in [(DataColumn::Input, input), (DataColumn::Output, output)] {
            check_moves(side, values)?;
            outlier::check(side, values)?;
        }
        if input == output {
            return Err(ExperimentError::Identical);
        }
        let input_is_held = is_held(input);
        let (input, output) = if grid.is_uneven {
            let input =
                if input_is_held { grid.held(time_s, input) } else { grid.linear(time_s, input) };
            (input, grid.linear(time_s, output))
        } else {
            (input.to_vec(), output.to_vec())
        };
        let TimeGrid { start_s, step_s, .. } = grid;
        Ok(Self { start_s, step_s, input, output, input_is_held, notes })
    }

    /// Samples.
    pub fn len(&self) -> usize {
        self.input.len().min(self.output.len())
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How long it lasts \[s\].
    #[expect(clippy::cast_precision_loss, reason = "counts of samples")]
    pub fn duration_s(&self) -> f64 {
        self.len().saturating_sub(1) as f64 * self.step_s
    }

    /// Moments of its samples \[s\].
    #[expect(clippy::cast_precision_loss, reason = "counts of samples")]
    pub fn moments(&self) -> Vec<f64> {
        (0..self.len()).map(|k| self.start_s + k as f64 * self.step_s).collect()
    }

    /// The beginning to fit to, and this share of it at the end to validate
    /// with. The notes stay with the first. Fails where either is too short, or
    /// the input or the output of either does not move.
    pub fn split(mut self, fraction: f64) -> Result<(Self, Self), ExperimentError> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a share of a count"
        )]
        let kept = (self.len() as f64 * (1.0 - fraction.clamp(0.0, 1.0))).round() as usize;
        let left = self.len().saturating_sub(kept);
        if left < MIN_SAMPLES {
            return Err(ExperimentError::ShortValidation { got: left });
        }
        if kept < MIN_SAMPLES {
            return Err(ExperimentError::TooFew { got: kept });
        }
        let (input, output) = (self.input.split_off(kept), self.output.split_off(kept));
        let [start_s, end_s] =
            [kept, kept + left].map(|count| self.start_s + to_f64(count) * self.step_s);
        for (side, values, validates) in [
            (DataColumn::Input, &self.input, false),
            (DataColumn::Output, &self.output, false),
            (DataColumn::Input, &input, true),
            (DataColumn::Output, &output, true),
        ] {
            check_moves(side, values).map_err(|error| {
                let ExperimentError::Constant { side, value } = error else { return error };
                let (from_s, to_s) =
                    if validates { (start_s, end_s) } else { (self.start_s, start_s) };
                ExperimentError::ConstantPart { side, value, from_s, to_s, validates }
            })?;
        }
        let rest = Self { start_s, input, output, notes: Vec::new(), ..self };
        Ok((self, rest))
    }
}

/// Fails where time does not run on, or where no log has such steps.
pub fn check_time(time_s: &[f64], rules: &Rules) -> Result<(), ExperimentError> {
    let falls = time_s.windows(2).position(|pair| pair[1] <= pair[0]);
    if let Some((at, pair)) = falls.and_then(|k| Some((k + 1, time_s.get(k..k + 2)?))) {
        return Err(ExperimentError::Order { at, before_s: pair[0], time_s: pair[1] });
    }
    let step_s = usual_step(time_s).unwrap_or(0.0);
    if !rules.is_time_unit_known && !PLAUSIBLE_STEPS_S.contains(&step_s) {
        return Err(ExperimentError::TimeUnit { step_s });
    }
    Ok(())
}

fn bridge_gaps(grid: &TimeGrid, rules: &Rules) -> Result<Vec<DataNote>, ExperimentError> {
    let limit_s = rules.max_gap_s.unwrap_or(grid.usual_limit_s());
    let mut notes = Vec::new();
    if let Some(longest) = grid.longest().copied() {
        // A limit of so many steps includes a gap of as many.
        let is_long = |gap: &&SampleGap| gap.length_s > limit_s * (1.0 + 1e-6);
        let count = grid.gaps.iter().filter(is_long).count();
        if count > 0 {
            return Err(ExperimentError::Gap { gap: longest, count, limit_s });
        }
        notes.push(DataNote::Bridged { count: grid.gaps.len(), longest, limit_s });
    } else if grid.is_uneven {
        notes.push(DataNote::Resampled { step_s: grid.step_s });
    }
    Ok(notes)
}

fn check_moves(side: DataColumn, values: &[f64]) -> Result<(), ExperimentError> {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = values.iter().fold(start, |(low, high), v| (low.min(*v), high.max(*v)));
    if high - low > MIN_RELATIVE_RANGE * high.abs().max(low.abs()) {
        return Ok(());
    }
    Err(ExperimentError::Constant { side, value: low })
}

/// Whether most samples repeat the one before them.
fn is_held(values: &[f64]) -> bool {
    let repeated = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
    repeated * 2 > values.len()
}

#[cfg(test)]
mod tests;
pub mod unit_check;
