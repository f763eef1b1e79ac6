//! Errors of parameters, setpoints and settings of a screw.

/// A parameter out of range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ScrewError {
    /// Not positive or not finite.
    #[error("{name} is {value}, which must be a positive number")]
    NotPositive {
        /// The parameter.
        name: &'static str,
        /// The value.
        value: f64,
    },
    /// A relative amplitude of the pulsation out of range.
    #[error("the conveying speed's pulsation is {0} of its mean, which must be from 0 to below 1")]
    PulsationAmplitude(f64),
    /// A frequency or phase that is not finite, or a negative frequency.
    #[error(
        "the pulsation has {rad_per_s} rad/s and a phase of {phase_rad} rad, which must be a frequency from 0 and a number"
    )]
    Frequency {
        /// Given frequency.
        rad_per_s: f64,
        /// Given phase.
        phase_rad: f64,
    },
    /// A setpoint outside the screw.
    #[error(
        "the filled length is to be {setpoint_mm} mm, which must lie within the screw of {length_mm} mm"
    )]
    Setpoint {
        /// The value.
        setpoint_mm: f64,
        /// The screw's length.
        length_mm: f64,
    },
    /// A largest fill ratio that cannot hold the plug, or of 1 and more.
    #[error(
        "the feed is limited to {most} of full, which must be below 1 and above the {needed:.4} that holds the setpoint"
    )]
    MaxFill {
        /// The value.
        most: f64,
        /// Fill ratio that holds the setpoint.
        needed: f64,
    },
    /// A slope at which the gains have no solution, eq. (31).
    #[error(
        "a slope of {slope_per_m}/m at the setpoint is too flat: it must be above {least_per_m:.4}/m"
    )]
    Slope {
        /// The value.
        slope_per_m: f64,
        /// The limit, `S_min`.
        least_per_m: f64,
    },
    /// An initial fill ratio out of range.
    #[error(
        "a fill ratio of {0} before the start cannot have been fed; it must be from 0 to below 1"
    )]
    InitialFill(f64),
    /// Too many steps in the longest delay.
    #[error(
        "at one step every {period_s} s a delay of up to {delay_s:.3} s is {steps:.0} steps, of which at most {most} are kept; step less often"
    )]
    TooManySteps {
        /// Time between steps.
        period_s: f64,
        /// Longest delay.
        delay_s: f64,
        /// Steps in it.
        steps: f64,
        /// Largest number that is kept.
        most: usize,
    },
    /// The fixed-step predictor has no integrated delay.
    #[error("the paper's scheme keeps the feed by time; it has no delay that adds up on the way")]
    SchemeOnTheWay,
}

/// The number, if it is finite and positive.
pub(super) fn positive(name: &'static str, value: f64) -> Result<f64, ScrewError> {
    let is_valid = value.is_finite() && value > 0.0;
    if is_valid { Ok(value) } else { Err(ScrewError::NotPositive { name, value }) }
}
