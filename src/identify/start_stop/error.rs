//! Why a recording does not determine starts and stops.

use crate::identify::digits::three_digits;

/// What is wrong with a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StartStopFitError {
    /// Too few samples.
    #[error("{what} has {found} samples; it needs at least {needed}")]
    TooFewSamples {
        /// `the command` or `the flow`.
        what: &'static str,
        /// Number of samples.
        found: usize,
        /// Samples that are needed.
        needed: usize,
    },
    /// The pump never runs.
    #[error("the command never exceeds zero (its largest value is {}); is it the right column?", three_digits(*.max))]
    NeverCommanded {
        /// Largest value of the command.
        max: f64,
    },
    /// A start is shorter than the sampling interval.
    #[error(
        "the flow is sampled every {step_s:.3} s and comes up within {rise_s:.3} s, in less than one \
         sample; sample it at least three times as often"
    )]
    TooSparse {
        /// From one sample to the next \[s\].
        step_s: f64,
        /// Time constant with which the flow seems to come \[s\].
        rise_s: f64,
    },
    /// A curve with three parameters needs more starts.
    #[error(
        "{found} starts after a pause that is known; the delay over the pause has three parameters \
         and takes at least {needed}, after pauses from about a second to minutes{}", and_others(*.left_out)
    )]
    TooFewStarts {
        /// Starts that count.
        found: usize,
        /// Starts that are needed.
        needed: usize,
        /// Starts that do not count: the record began with them, the run after them
        /// was too short or its command changed, or too many samples are missing.
        left_out: usize,
    },
    /// Too few stops for a standard error.
    #[error("{found} stops that can be looked at; it takes at least {needed}")]
    TooFewStops {
        /// Stops that count.
        found: usize,
        /// Stops that are needed.
        needed: usize,
    },
    /// The pauses do not show how the delay grows.
    #[error(
        "all pauses are alike: from {} to {} s. How the delay grows with the pause shows only in \
         pauses that differ by a factor of {factor} or more", three_digits(*.shortest_s), three_digits(*.longest_s)
    )]
    PausesTooSimilar {
        /// Shortest pause \[s\].
        shortest_s: f64,
        /// Longest pause \[s\].
        longest_s: f64,
        /// Smallest ratio of the longest to the shortest pause.
        factor: f64,
    },
    /// The pump runs without flow.
    #[error(
        "the pump was commanded to run at {at_s:.2} s for {lasted_s:.1} s and no flow came: \
         {} mm³/s, in other runs up to {} mm³/s. Look for a blocked nozzle or a log of another bead",
        three_digits(*.flow_mm3_per_s), three_digits(*.max_mm3_per_s)
    )]
    NoFlow {
        /// When it starts \[s\].
        at_s: f64,
        /// Duration of the run \[s\].
        lasted_s: f64,
        /// Flow at the end of the run.
        flow_mm3_per_s: f64,
        /// Largest flow at the end of a run.
        max_mm3_per_s: f64,
    },
    /// The flow does not stop.
    #[error(
        "{observed_s:.1} s after the stop at {at_s:.2} s, which was looked at longest, the flow is still \
         {percent:.0} % of that before; expected below {max_percent:.0} %. Does the command stop the \
         pump, is the zero of the flow right?"
    )]
    FlowContinues {
        /// When the pump stops \[s\].
        at_s: f64,
        /// Observation time after that \[s\].
        observed_s: f64,
        /// Remaining flow \[%\].
        percent: f64,
        /// Largest accepted remaining flow \[%\].
        max_percent: f64,
    },
    /// The delay does not depend on the pause.
    #[error(
        "the delay of the first flow does not grow with the pause: by {grows_s:.3} ± {sigma_s:.3} s \
         from a pause of {} to one of {} s. A fixed delay is enough, or shorter pauses are missing",
        three_digits(*.shortest_s), three_digits(*.longest_s)
    )]
    DelayDoesNotGrow {
        /// By how much it grows \[s\].
        grows_s: f64,
        /// Standard deviation of a delay \[s\].
        sigma_s: f64,
        /// Shortest pause \[s\].
        shortest_s: f64,
        /// Longest pause \[s\].
        longest_s: f64,
    },
    /// A time constant that the pauses do not bracket.
    #[error(
        "the pauses do not determine how fast the void opens: a time constant of {} ± {} s from pauses \
         of {} to {} s. Add pauses {}", three_digits(*.found_s), three_digits(*.sigma_s), three_digits(*.shortest_s),
        three_digits(*.longest_s), if *.found_s > 0.5 * *.longest_s { "of several times that" } else {
            "about that long, and shorter ones" }
    )]
    TimeConstantUndetermined {
        /// Estimated time constant \[s\].
        found_s: f64,
        /// Its standard error \[s\].
        sigma_s: f64,
        /// Shortest pause \[s\].
        shortest_s: f64,
        /// Longest pause \[s\].
        longest_s: f64,
    },
    /// Least squares without a result.
    #[error("no {what} could be fitted to the flow; does the flow follow the command at all?")]
    NoFit {
        /// `rise`, `fall` or `delay`.
        what: &'static str,
    },
}

fn and_others(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => "; one more had no pause before it, too short a run after it or samples missing"
            .to_owned(),
        many => {
            format!("; {many} more had no pause before, no even run after or samples missing")
        }
    }
}
