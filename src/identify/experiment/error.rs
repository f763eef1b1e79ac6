//! Why data cannot be identified.

use std::fmt;

use crate::identify::digits::six_digits;
use crate::identify::grid::SampleGap;

/// Smallest number of samples. A choice: five for each of ten parameters.
pub const MIN_SAMPLES: usize = 50;

/// One of the two columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataColumn {
    /// The command, or the measured quantity that drives the extruder.
    Input,
    /// The response.
    Output,
}

impl fmt::Display for DataColumn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Input => "input",
            Self::Output => "output",
        })
    }
}

/// Data that cannot be identified. Samples are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExperimentError {
    /// Too few samples.
    #[error("{got} samples: a model takes {MIN_SAMPLES} or more")]
    TooFew {
        /// Samples that there are.
        got: usize,
    },
    /// Time does not increase.
    #[error(
        "time {} at sample {}: {before_s} s, then {time_s} s; it must grow from line to line (write \
         it with more digits, or keep one run alone)",
        if .time_s == .before_s { "repeats" } else { "falls" }, .at + 1
    )]
    Order {
        /// Number of the sample, from 0.
        at: usize,
        /// The moment before it \[s\].
        before_s: f64,
        /// Its moment \[s\].
        time_s: f64,
    },
    /// An implausible unit of time.
    #[error(
        "from sample to sample {} s, if the unit of time is right: no log of an extruder has \
         such steps. {}", six_digits(*.step_s), if *.step_s > 1.0 {
            "Is the column in ms? Say so with --unit COLUMN=ms; if it is right, with --unit COLUMN=s"
        } else {
            "Is the column in s? Say so with --unit COLUMN=s"
        }
    )]
    TimeUnit {
        /// Median sampling interval \[s\].
        step_s: f64,
    },
    /// A long gap.
    #[error(
        "a gap of {:.3} s after {:.3} s (sample {}){}; gaps up to {limit_s:.3} s are bridged: use a \
         part without it, or allow longer ones with --max-gap-s", .gap.length_s, .gap.from_s,
        .gap.after + 1, if *.count > 1 { format!(", the longest of {count}") } else { String::new() }
    )]
    Gap {
        /// The longest one.
        gap: SampleGap,
        /// Number of gaps that are too long.
        count: usize,
        /// The longest that is bridged \[s\].
        limit_s: f64,
    },
    /// A constant column.
    #[error(
        "the {side} is {} all the time: nothing can be identified from it{}",
        six_digits(*.value), if *.side == DataColumn::Input { "; excite it (truebead extruder excite writes profiles)" } else {
            "; see that its sensor is connected"
        }
    )]
    Constant {
        /// The constant column.
        side: DataColumn,
        /// Its value.
        value: f64,
    },
    /// A column that is constant in one of the parts of a log.
    #[error(
        "the {side} is {} all the time from {from_s:.1} s to {to_s:.1} s, the part that is {}: \
         cut the log elsewhere (--validate-fraction, --to-s), or name another one to validate with \
         (--validate)", six_digits(*.value),
        if *.validates { "kept to validate with" } else { "fitted to" }
    )]
    ConstantPart {
        /// The constant column.
        side: DataColumn,
        /// Its value.
        value: f64,
        /// Beginning of the part \[s\].
        from_s: f64,
        /// End of the part \[s\].
        to_s: f64,
        /// Whether it is the part to validate with.
        validates: bool,
    },
    /// A few samples far beyond all others.
    #[error(
        "the {side} is {} at sample {}{}, and all others lie between {} and {}: that is no reading. \
         Mend it in the log, or use a part without it (--from-s, --to-s){}", six_digits(*.value), .at + 1,
        if *.count > 1 { format!(" (the farthest of {count})") } else { String::new() },
        six_digits(.others[0]), six_digits(.others[1]), if *.side == DataColumn::Output {
            "; --hampel 5,5 replaces such samples"
        } else { "" }
    )]
    Outlier {
        /// Which column.
        side: DataColumn,
        /// The farthest sample.
        at: usize,
        /// Its value.
        value: f64,
        /// Number of such samples.
        count: usize,
        /// Smallest and largest of all others.
        others: [f64; 2],
    },
    /// One column twice.
    #[error(
        "input and output are the same from sample to sample: a model predicts one from the other. \
         Was a command logged in place of what came of it?"
    )]
    Identical,
    /// Too few samples for validation.
    #[error("{got} samples are left to validate with: {MIN_SAMPLES} or more are needed")]
    ShortValidation {
        /// Samples that there are.
        got: usize,
    },
}
