//! Structure and settings of a fit.

use crate::numeric::lti::Between;

/// Largest number of poles of a fit. A choice.
pub const MAX_POLES: usize = 4;

/// Structure of the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Structure {
    /// K·(Tz·s + 1)/(T·s + 1)·e^(−Ls). Parameters `gain`, `time_constant_s`, `zero_s`.
    FirstOrder {
        /// With Tz; otherwise Tz = 0.
        zero: bool,
    },
    /// K·(Tz·s + 1)/((T1·s + 1)(T2·s + 1))·e^(−Ls). Parameters `gain`,
    /// `time_constant_1_s` (the longer), `time_constant_2_s`, `zero_s`.
    SecondOrderReal {
        /// With Tz; otherwise Tz = 0.
        zero: bool,
    },
    /// K·(Tz·s + 1)/(T²·s² + 2ζT·s + 1)·e^(−Ls). Parameters `gain`, `period_s`
    /// (one over the natural frequency), `damping`, `zero_s`.
    SecondOrderOscillating {
        /// With Tz; otherwise Tz = 0.
        zero: bool,
    },
    /// b(s)/a(s)·e^(−Ls), 1 to 4 poles, the denominator with a leading 1.
    /// Parameters `b0`…, `a0`… with the power of s that they stand before.
    Transfer {
        /// Number of poles.
        poles: usize,
        /// Number of zeros, at most that of the poles.
        zeros: usize,
    },
}

impl Structure {
    /// Number of poles.
    pub fn poles(self) -> usize {
        match self {
            Self::FirstOrder { .. } => 1,
            Self::SecondOrderReal { .. } | Self::SecondOrderOscillating { .. } => 2,
            Self::Transfer { poles, .. } => poles,
        }
    }

    /// Number of zeros.
    pub fn zeros(self) -> usize {
        match self {
            Self::FirstOrder { zero }
            | Self::SecondOrderReal { zero }
            | Self::SecondOrderOscillating { zero } => usize::from(zero),
            Self::Transfer { zeros, .. } => zeros,
        }
    }
}

/// Dead time of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DeadTime {
    /// Known \[s\]; 0 for none.
    Known(f64),
    /// Estimated within a range, to a part of a step; to a whole step where the input
    /// is held and there are as many zeros as poles.
    Estimated {
        /// Lower end \[s\].
        min_s: f64,
        /// Upper end \[s\].
        max_s: f64,
    },
}

/// Output for a constant input at the input level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OutputLevel {
    /// Known, in units of the output. A known level reduces the standard error of the gain much
    /// where the input is a single step.
    Known(f64),
    /// A parameter of the fit, `output_level`.
    Estimated,
}

/// State before the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InitialCondition {
    /// The input had been constant at this level and the output was settled.
    Settled {
        /// Input level, in units of the input.
        input: f64,
    },
    /// The input had been constant at the level of its first sample, and the output was settled.
    SettledAtFirst,
    /// Unknown: the input is taken as constant at the first sample's level for the dead time,
    /// and the free response – one parameter for each pole – is estimated.
    Unknown,
}

/// Settings of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// Form of the model.
    pub structure: Structure,
    /// Its dead time.
    pub dead_time: DeadTime,
    /// Input between samples: held for commands, linear for measured quantities.
    pub between: Between,
    /// The output at the operating point.
    pub level: OutputLevel,
    /// State before the first sample.
    pub initial_state: InitialCondition,
    /// Whether a model with undetermined parameters is accepted, with
    /// [`super::FitNote::Undetermined`].
    pub accept_undetermined: bool,
}

impl FitSettings {
    /// A structure with a dead time, a held input, an estimated output level,
    /// settled at the first sample.
    pub fn new(structure: Structure, dead_time: DeadTime) -> Self {
        Self {
            structure,
            dead_time,
            between: Between::Held,
            level: OutputLevel::Estimated,
            initial_state: InitialCondition::SettledAtFirst,
            accept_undetermined: false,
        }
    }

    /// Number of parameters that are estimated.
    pub fn parameters(&self) -> usize {
        let poles = self.structure.poles();
        let dead_time = usize::from(matches!(self.dead_time, DeadTime::Estimated { .. }));
        let level = usize::from(self.level == OutputLevel::Estimated);
        let free = if self.initial_state == InitialCondition::Unknown { poles } else { 0 };
        self.structure.zeros() + 1 + poles + dead_time + level + free
    }
}
