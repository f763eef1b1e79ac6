//! Why no model can be found in data.

use std::fmt;

use crate::identify::digits::six_digits;
use crate::identify::grid::SampleGap;

/// Samples that a model takes at least.
pub const MIN_SAMPLES: usize = 50;

/// Which of the two columns is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataColumn {
    /// What the extruder was told, or what drives it.
    Input,
    /// What came of it.
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

/// Data that no model can be found in. Samples are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ExperimentError {
    /// Hardly anything there.
    #[error("{got} samples: a model takes {MIN_SAMPLES} or more")]
    TooFew {
        /// Samples that there are.
        got: usize,
    },
    /// Time that does not run on.
    #[error(
        "time {} at sample {}: {before_s} s, then {time_s} s; it must grow from line to line (write \
         it with more digits, or keep one run alone)",
        if .time_s == .before_s { "repeats" } else { "falls" }, .at + 1
    )]
    Order {
        /// Sample.
        at: usize,
        /// The moment before it \[s\].
        before_s: f64,
        /// Its moment \[s\].
        time_s: f64,
    },
    /// A unit of time that cannot be.
    #[error(
        "from sample to sample {} s, if the unit of time is right: no log of an extruder has \
         such steps. {}", six_digits(*.step_s), if *.step_s > 1.0 {
            "Is the column in ms? Say so with --unit COLUMN=ms; if it is right, with --unit COLUMN=s"
        } else {
            "Is the column in s? Say so with --unit COLUMN=s"
        }
    )]
    TimeUnit {
        /// The usual step \[s\].
        step_s: f64,
    },
    /// Nothing logged for long.
    #[error(
        "a gap of {:.3} s after {:.3} s (sample {}){}; gaps up to {limit_s:.3} s are bridged: use a \
         part without it, or allow longer ones with --max-gap-s", .gap.length_s, .gap.from_s,
        .gap.after + 1, if *.count > 1 { format!(", the longest of {count}") } else { String::new() }
    )]
    Gap {
        /// The longest one.
        gap: SampleGap,
        /// Gaps that are too long.
        count: usize,
        /// The longest that is bridged \[s\].
        limit_s: f64,
    },
    /// A column that does not move.
    #[error(
        "the {side} is {} all the time: nothing can be identified from it{}",
        six_digits(*.value), if *.side == DataColumn::Input { "; excite it (truebead extruder excite writes profiles)" } else {
            "; see that its sensor is connected"
        }
    )]
    Constant {
        /// Which one.
        side: DataColumn,
        /// Its value.
        value: f64,
    },
    /// A column that does not move in one of the parts that a log is cut into.
    #[error(
        "the {side} is {} all the time from {from_s:.1} s to {to_s:.1} s, the part that is {}: \
         cut the log elsewhere (--validate-fraction, --to-s), or name another one to validate with \
         (--validate)", six_digits(*.value),
        if *.validates { "kept to validate with" } else { "fitted to" }
    )]
    ConstantPart {
        /// Which one.
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
        /// Samples like it.
        count: usize,
        /// Least and most of all others.
        others: [f64; 2],
    },
    /// One column twice.
    #[error(
        "input and output are the same from sample to sample: a model predicts one from the other. \
         Was a command logged in place of what came of it?"
    )]
    Identical,
    /// A part that tells nothing.
    #[error("{got} samples are left to validate with: {MIN_SAMPLES} or more are needed")]
    ShortValidation {
        /// Samples that there are.
        got: usize,
    },
}
