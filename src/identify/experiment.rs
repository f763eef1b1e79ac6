//! Input and output on an even grid, checked for identification.

mod error;
mod outlier;

use std::fmt;

pub use self::error::{DataColumn, ExperimentError, MIN_SAMPLES};
use super::grid::{SampleGap, TimeGrid, usual_step};
use crate::numeric::number::{to_count, to_f64};
pub use unit_check::implausible_unit;

/// Plausible sampling intervals of an extruder's log \[s\]; others indicate another unit of
/// time.
const PLAUSIBLE_STEPS_S: std::ops::RangeInclusive<f64> = 2e-5..=2.0;
/// Range over size below which a column is constant: rounding.
const MIN_RELATIVE_RANGE: f64 = 1e-9;

/// What was done to the data.
#[derive(Debug, Clone, PartialEq)]
pub enum DataNote {
    /// Gaps that were bridged.
    Bridged {
        /// Number of gaps.
        count: usize,
        /// The longest gap.
        longest: SampleGap,
        /// Longest gap that may be bridged \[s\].
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

/// What may be done to the data.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rules {
    /// Longest gap that is bridged \[s\]; `None` for five steps.
    pub max_gap_s: Option<f64>,
    /// Whether the unit of time was specified, and is not checked.
    pub is_time_unit_known: bool,
}

/// An input and an output on one even grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Moment of the first sample \[s\].
    pub start_s: f64,
    /// Sampling interval \[s\].
    pub step_s: f64,
    /// Input, in its own unit.
    pub input: Vec<f64>,
    /// Output, in its own unit.
    pub output: Vec<f64>,
    /// Whether each input value holds until the next, as a command does, instead of being
    /// interpolated.
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

    /// Number of samples.
    #[expect(clippy::len_without_is_empty, reason = "an experiment has fifty samples or more")]
    pub fn len(&self) -> usize {
        self.input.len().min(self.output.len())
    }

    /// How long it lasts \[s\].
    pub fn duration_s(&self) -> f64 {
        to_f64(self.len().saturating_sub(1)) * self.step_s
    }

    /// Moments of its samples \[s\].
    pub fn moments(&self) -> Vec<f64> {
        (0..self.len()).map(|k| self.start_s + to_f64(k) * self.step_s).collect()
    }

    /// The beginning for estimation, and this fraction at the end for validation. The notes
    /// stay with the first. Fails where either is too short, or its input or output is
    /// constant.
    pub fn split(mut self, fraction: f64) -> Result<(Self, Self), ExperimentError> {
        let kept = to_count((to_f64(self.len()) * (1.0 - fraction.clamp(0.0, 1.0))).round());
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

/// Fails where time does not increase, or the sampling interval is implausible.
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
    let mut notes = Vec::new();
    if let Some((longest, limit_s)) = check_gaps(grid, rules)? {
        notes.push(DataNote::Bridged { count: grid.gaps.len(), longest, limit_s });
    } else if grid.is_uneven {
        notes.push(DataNote::Resampled { step_s: grid.step_s });
    }
    Ok(notes)
}

/// The longest gap and the limit for gaps \[s\]; `None` without a gap. Fails where it is longer
/// than the limit.
pub(super) fn check_gaps(
    grid: &TimeGrid,
    rules: &Rules,
) -> Result<Option<(SampleGap, f64)>, ExperimentError> {
    let limit_s = rules.max_gap_s.unwrap_or(grid.usual_limit_s());
    // A gap as long as the limit is bridged, in spite of rounding.
    let is_long = |gap: &&SampleGap| gap.length_s > limit_s * (1.0 + 1e-6);
    let count = grid.gaps.iter().filter(is_long).count();
    match grid.longest() {
        Some(&gap) if count > 0 => Err(ExperimentError::Gap { gap, count, limit_s }),
        longest => Ok(longest.map(|gap| (*gap, limit_s))),
    }
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
