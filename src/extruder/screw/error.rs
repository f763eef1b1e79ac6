//! Parameters, setpoints and settings that no screw can have.

/// A parameter that no screw has.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ScrewError {
    /// Zero, negative or no number.
    #[error("{name} is {value}, which must be a positive number")]
    NotPositive {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// A pulsation that turns the screw round, or that is no number.
    #[error(
        "the conveying speed's pulsation is {share} of its mean, which must be from 0 to below 1"
    )]
    PulsationAmplitude {
        /// What was given.
        share: f64,
    },
    /// A frequency or phase that is no number, or a negative frequency.
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
        /// What was given.
        setpoint_mm: f64,
        /// The screw's length.
        length_mm: f64,
    },
    /// A largest share at which the plug cannot be held, or of 1 and more.
    #[error(
        "the feed is limited to {most} of full, which must be below 1 and above the {needed:.4} that holds the setpoint"
    )]
    MaxFill {
        /// What was given.
        most: f64,
        /// What the setpoint needs.
        needed: f64,
    },
    /// A slope at which the gains have no solution, eq. (31).
    #[error(
        "a slope of {slope_per_m}/m at the setpoint is too flat: it must be above {least_per_m:.4}/m"
    )]
    Slope {
        /// What was given.
        slope_per_m: f64,
        /// What is needed, `S_min`.
        least_per_m: f64,
    },
    /// A feed before the start that cannot have been.
    #[error(
        "a fill ratio of {fill} before the start cannot have been fed; it must be from 0 to below 1"
    )]
    InitialFill {
        /// What was given.
        fill: f64,
    },
    /// Too much to remember.
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
        /// Most that are kept.
        most: usize,
    },
    /// A fixed-step predictor cannot know where the feed is by its places.
    #[error("the paper's scheme keeps the feed by time; it has no delay that adds up on the way")]
    SchemeOnTheWay,
}

/// The number, if it is finite and above zero.
pub(super) fn positive(name: &'static str, value: f64) -> Result<f64, ScrewError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(ScrewError::NotPositive { name, value })
    }
}
