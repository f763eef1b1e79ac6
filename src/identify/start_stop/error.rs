//! Why a recording does not tell how an extruder starts and stops.

use crate::identify::digits::three_digits;

/// What is wrong with a recording, with what was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StartStopFitError {
    /// Nothing to look at.
    #[error("{what} has {found} samples; it needs at least {needed}")]
    TooFewSamples {
        /// `the command` or `the flow`.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many would do.
        needed: usize,
    },
    /// The pump was never told to run.
    #[error("the command never exceeds zero (its largest value is {}); is it the right column?", three_digits(*.max))]
    NeverCommanded {
        /// Largest value of the command.
        max: f64,
    },
    /// Samples so far apart that a start is over before the next one.
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
        /// Starts that would do.
        needed: usize,
        /// Starts that do not count: the record began with them, the run after them
        /// was too short or its command changed, or too many samples are missing.
        left_out: usize,
    },
    /// Too few stops to tell how alike they are.
    #[error("{found} stops that can be looked at; it takes at least {needed}")]
    TooFewStops {
        /// Stops that count.
        found: usize,
        /// Stops that would do.
        needed: usize,
    },
    /// Pauses that do not tell how the delay grows.
    #[error(
        "all pauses are alike: from {} to {} s. How the delay grows with the pause shows only in \
         pauses that differ by a factor of {factor} or more", three_digits(*.shortest_s), three_digits(*.longest_s)
    )]
    PausesTooSimilar {
        /// Shortest pause \[s\].
        shortest_s: f64,
        /// Longest pause \[s\].
        longest_s: f64,
        /// What they must differ by.
        factor: f64,
    },
    /// The pump was told to run and nothing came.
    #[error(
        "the pump was commanded to run at {at_s:.2} s for {lasted_s:.1} s and no flow came: \
         {} mm³/s, in other runs up to {} mm³/s. Look for a blocked nozzle or a log of another bead",
        three_digits(*.flow_mm3_per_s), three_digits(*.max_mm3_per_s)
    )]
    NoFlow {
        /// When it was told \[s\].
        at_s: f64,
        /// How long it was told to run \[s\].
        lasted_s: f64,
        /// Flow at the end of that.
        flow_mm3_per_s: f64,
        /// Largest flow at the end of a run.
        max_mm3_per_s: f64,
    },
    /// Flow that does not cease.
    #[error(
        "{observed_s:.1} s after the stop at {at_s:.2} s, which was looked at longest, the flow is still \
         {percent:.0} % of that before; expected below {max_percent:.0} %. Does the command stop the \
         pump, is the zero of the flow right?"
    )]
    FlowContinues {
        /// When the pump was told to stop \[s\].
        at_s: f64,
        /// How long after that it was looked at \[s\].
        observed_s: f64,
        /// What is left of the flow \[%\].
        percent: f64,
        /// What may be left \[%\].
        max_percent: f64,
    },
    /// The delay has nothing to do with the pause.
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
        /// What was found \[s\].
        found_s: f64,
        /// Its standard error \[s\].
        sigma_s: f64,
        /// Shortest pause \[s\].
        shortest_s: f64,
        /// Longest pause \[s\].
        longest_s: f64,
    },
    /// Least squares that found nothing.
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
