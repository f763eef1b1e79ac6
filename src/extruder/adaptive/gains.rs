//! Settings of adaptive control, and their conditions of stability.

use crate::core::Span;

/// A first-order plant with a matched uncertainty: ẏ = a·y + b·(u + w + Δ), with output y, input
/// u, known part w and unknown part Δ, both in the unit of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalarPlant {
    /// a: β2 of the nozzle, β6 of the strand \[1/s\].
    pub state_gain_per_s: f64,
    /// b: β3 of the nozzle, β7 of the strand \[unit of y per second and unit
    /// of u\].
    pub input_gain: f64,
}

/// Gains of the control law u = −k·y + r − w − Δ̂ (Mohammadi Looey et al. 2026, eq. (8) with
/// its indices corrected).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveGains {
    /// k: feedback of the output \[unit of u per unit of y\].
    pub feedback: f64,
    /// Additional feedback of the error to the reference model \[unit of u per unit of y\]. It
    /// makes the error faster without changing the response to the reference; 0 is the paper's
    /// controller.
    pub error_feedback: f64,
    /// How the uncertainty is estimated.
    pub adaptation: Adaptation,
    /// Bounds of the estimate.
    pub safety: EstimateBounds,
}

impl AdaptiveGains {
    /// Gains that estimate the slope as well, with a triple pole of the error \[1/s\], which
    /// overshoots least for its speed. The response to the reference is that of the feedback
    /// alone. Faster poles pass more noise to the command: that of the measured output times
    /// feedback plus error feedback.
    pub fn triple_pole(plant: ScalarPlant, feedback: f64, pole_per_s: f64) -> Self {
        let together = (3.0 * pole_per_s + plant.state_gain_per_s) / plant.input_gain;
        let square = plant.input_gain * plant.input_gain;
        Self {
            feedback,
            error_feedback: together - feedback,
            adaptation: Adaptation::Ramp {
                learning_rate: 3.0 * pole_per_s * pole_per_s / square,
                weight: 1.0,
                slope_rate_per_s: pole_per_s / 3.0,
            },
            safety: EstimateBounds::default(),
        }
    }
}

/// How the estimate Δ̂ of the uncertainty changes with the error e to the reference model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Adaptation {
    /// Not at all: γ = 0, a constant estimate.
    Off,
    /// Δ̂' = γ·p·b·e, eq. (9). The error vanishes where Δ is constant; a ramp
    /// Δ' = c leaves c/(γ·p·b).
    Constant {
        /// γ: learning rate.
        learning_rate: f64,
        /// p: weight of the error in the Lyapunov function (16).
        weight: f64,
    },
    /// Δ̂' = γ·p·b·e + ĉ with ĉ' = λ·γ·p·b·e: the slope of Δ is estimated too, and a ramp leaves
    /// no error.
    Ramp {
        /// γ: learning rate.
        learning_rate: f64,
        /// p: weight of the error in the Lyapunov function.
        weight: f64,
        /// λ: rate of the slope's adaptation; below the error's own pole \[1/s\].
        slope_rate_per_s: f64,
    },
}

/// Bounds of the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EstimateBounds {
    /// Largest magnitude of Δ̂ (projection), where the slope is not adapted outward \[unit of u\].
    pub bound: Option<f64>,
    /// σ: leakage of the estimate, which bounds its drift by noise. In exchange a constant Δ leaves an error
    /// b·σ·Δ/(α·σ + γ·p·b²), with the error's pole −α; 0 is the paper's controller
    /// \[1/s\].
    pub leakage_per_s: f64,
}

/// Settings that are not valid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GainError {
    /// Not finite.
    #[error("{what} is {value}: give a finite number")]
    NotFinite {
        /// Which gain.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// The input gain is zero.
    #[error("the input gain is 0: the input does not move the output, so nothing can be learnt")]
    NoInput,
    /// The reference model is unstable.
    #[error(
        "the reference model's pole {pole:.4} 1/s is not stable: the feedback k must make \
         a − b·k negative, with a = {state_gain:.4} and b = {input_gain:.4}"
    )]
    Reference {
        /// a − b·k.
        pole: f64,
        /// a.
        state_gain: f64,
        /// b.
        input_gain: f64,
    },
    /// The error is unstable; its pole a − b·(k + κ) \[1/s\].
    #[error(
        "the error's pole {0:.4} 1/s is not stable: feedback and error feedback together must \
         make a − b·(k + error feedback) negative"
    )]
    Error(f64),
    /// A gain that is not positive.
    #[error("{what} is {value}: it must be above 0 (to learn nothing, switch the adaptation off)")]
    NotPositive {
        /// Which gain.
        what: &'static str,
        /// The value.
        value: f64,
    },
    /// The rate of the slope's adaptation is too large.
    #[error("the slope's rate {rate} 1/s is not stable: it must be below {limit:.4} 1/s")]
    SlopeRate {
        /// The value.
        rate: f64,
        /// The limit of stability.
        limit: f64,
    },
    /// Stable in continuous time, but not at the rate of the commands.
    #[error(
        "at a command every {hold_s} s the error grows by {radius:.3} from one to the next: \
         command more often, or take smaller gains"
    )]
    SamplingTooSlow {
        /// Time that a command is held \[s\].
        hold_s: f64,
        /// Largest eigenvalue of the sampled error.
        radius: f64,
    },
}

impl Adaptation {
    /// γ, p and λ; 0 for those that it does not have.
    fn parameters(&self) -> [f64; 3] {
        match *self {
            Self::Off => [0.0; 3],
            Self::Constant { learning_rate, weight } => [learning_rate, weight, 0.0],
            Self::Ramp { learning_rate, weight, slope_rate_per_s } => {
                [learning_rate, weight, slope_rate_per_s]
            }
        }
    }

    /// γ·p·b, the gain from the error to the rate of the estimate; 0 without adaptation.
    pub(super) fn rate(&self, input_gain: f64) -> f64 {
        let [learning_rate, weight, _] = self.parameters();
        learning_rate * weight * input_gain
    }

    /// λ \[1/s\]; 0 where the slope is not estimated.
    pub(super) fn slope_rate_per_s(&self) -> f64 {
        self.parameters()[2]
    }
}

impl ScalarPlant {
    /// Zero-order hold over a time \[s\]: e^(a·t) and b·∫e^(a·s)ds.
    pub fn zero_order_hold(&self, t_s: f64) -> (f64, f64) {
        let x = self.state_gain_per_s * t_s;
        (libm::exp(x), self.input_gain * t_s * mean_exp(x))
    }

    /// The pole under a feedback \[1/s\].
    pub fn pole(&self, feedback: f64) -> f64 {
        self.state_gain_per_s - self.input_gain * feedback
    }
}

/// (e^x − 1)/x, which is 1 at 0.
pub(super) fn mean_exp(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { libm::expm1(x) / x }
}

/// Checks stability in continuous time: eq. (11), γ and p above zero, and the Routh–Hurwitz
/// condition of the error where the slope is estimated.
pub fn check(plant: ScalarPlant, gains: &AdaptiveGains, hold: Span) -> Result<(), GainError> {
    all_finite(plant, gains)?;
    positive("the time that a command is held", hold.secs())?;
    if plant.input_gain == 0.0 {
        return Err(GainError::NoInput);
    }
    let pole = plant.pole(gains.feedback);
    if pole >= 0.0 {
        let (state_gain, input_gain) = (plant.state_gain_per_s, plant.input_gain);
        return Err(GainError::Reference { pole, state_gain, input_gain });
    }
    let pole = plant.pole(gains.feedback + gains.error_feedback);
    if pole >= 0.0 {
        return Err(GainError::Error(pole));
    }
    if let Some(bound) = gains.safety.bound {
        positive("the bound of the estimate", bound)?;
    }
    let leak = gains.safety.leakage_per_s;
    if leak < 0.0 {
        return Err(GainError::NotPositive { what: "the leakage", value: leak });
    }
    if gains.adaptation == Adaptation::Off {
        return Ok(());
    }
    let [learning_rate, weight, rate] = gains.adaptation.parameters();
    positive("the learning rate", learning_rate)?;
    positive("the weight of the error", weight)?;
    if let Adaptation::Ramp { .. } = gains.adaptation {
        positive("the slope's rate", rate)?;
        let square = gains.adaptation.rate(plant.input_gain) * plant.input_gain;
        let limit = slope_rate_limit(-pole, square, leak);
        if rate >= limit || limit.is_nan() {
            return Err(GainError::SlopeRate { rate, limit });
        }
    }
    Ok(())
}

/// The λ below which all roots of (s + a)(s + σ)² + ω²(s + σ) + λω² lie in the left half plane
/// (Hurwitz 1895); a without leakage.
fn slope_rate_limit(a: f64, square: f64, leak: f64) -> f64 {
    let (c2, c1) = (a + 2.0 * leak, leak * leak + 2.0 * a * leak + square);
    (c2 * c1 - a * leak * leak - leak * square) / square
}

fn positive(what: &'static str, value: f64) -> Result<(), GainError> {
    if value > 0.0 { Ok(()) } else { Err(GainError::NotPositive { what, value }) }
}

fn all_finite(plant: ScalarPlant, gains: &AdaptiveGains) -> Result<(), GainError> {
    let [learning_rate, weight, slope] = gains.adaptation.parameters();
    let found = [
        ("the state gain", plant.state_gain_per_s),
        ("the input gain", plant.input_gain),
        ("the feedback", gains.feedback),
        ("the error feedback", gains.error_feedback),
        ("the learning rate", learning_rate),
        ("the weight of the error", weight),
        ("the slope's rate", slope),
        ("the leakage", gains.safety.leakage_per_s),
        ("the bound of the estimate", gains.safety.bound.unwrap_or(0.0)),
    ];
    match found.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((what, value)) => Err(GainError::NotFinite { what, value }),
        None => Ok(()),
    }
}
