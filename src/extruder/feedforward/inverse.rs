//! Inverse of a model with placed poles: the command for a demanded output.

use nalgebra::Complex;

use super::FeedforwardError;
use crate::core::Span;
use crate::extruder::limits::{CommandLimit, CommandLimits};
use crate::numeric::lti::polynomial::{from_roots, multiply};
use crate::numeric::lti::{Between, Simulator, TransferFunction};
use crate::numeric::number::to_f64;

/// How a model is inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseSettings {
    /// Time constant of the placed poles \[s\], as many as the relative degree of the model.
    pub time_constant_s: f64,
    /// How zeros in the right half plane are handled.
    pub right_zeros: RightHalfPlaneZeros,
    /// Preview of the demand.
    pub preview: Span,
    /// Allowed delay of the output beyond that.
    pub max_delay: Span,
    /// Range and rate of the command.
    pub limits: CommandLimits,
    /// Time between two commands.
    pub period: Span,
}

/// How a zero in the right half plane is handled, whose exact inverse is unstable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RightHalfPlaneZeros {
    /// The model is refused.
    Refuse,
    /// Its mirror image is inverted: the gain at every frequency is right, and the output is
    /// delayed by 2·Re(z)/|z|² at low ones, which counts as dead time.
    Mirror,
}

/// A model's inverse on the grid of the commands.
#[derive(Debug, Clone, PartialEq)]
pub struct Inverse {
    simulator: Simulator,
    gain: f64,
    limits: CommandLimits,
    period: Span,
    limit: CommandLimit,
    preview_s: f64,
    command: f64,
}

impl Inverse {
    /// Inverts a model. Fails where the model is not stable or has no static gain, where it has a
    /// zero in the right half plane that must not be mirrored, where its dead time exceeds preview
    /// and allowed delay, and where a setting is out of range.
    pub fn new(
        model: &TransferFunction,
        settings: &InverseSettings,
    ) -> Result<Self, FeedforwardError> {
        let period_s = super::positive("the period", settings.period.secs())?;
        let gain = super::usable_gain(model)?;
        let (plant, mirrored_s) = minimum_phase(model, settings.right_zeros)?;
        let missing = model.den().len() - model.num().len();
        let time_constant_s = if missing > 0 {
            super::positive("the time constant of the placed poles", settings.time_constant_s)?
        } else {
            0.0
        };
        let dead_time_s = model.dead_time_s() + mirrored_s;
        let (known_s, late_s) = (settings.preview.secs(), settings.max_delay.secs());
        if dead_time_s > known_s + late_s + 1e-9 {
            return Err(FeedforwardError::DeadTime { dead_time_s, known_s, late_s });
        }
        let poles = (0..missing).fold(vec![1.0], |p, _| multiply(&p, &[time_constant_s, 1.0]));
        let filter = TransferFunction::new(&[1.0], &poles, 0.0)?;
        let inverse = plant.inverse_through(&filter)?;
        let simulator = Simulator::new(&inverse, period_s, Between::Linear)?;
        let lag_s = to_f64(missing) * time_constant_s;
        // A zero-order hold delays by half a period in the mean.
        let preview_s = (dead_time_s + lag_s + 0.5 * period_s).min(known_s);
        let limits = settings.limits;
        let (period, limit, command) = (settings.period, CommandLimit::None, limits.idle());
        Ok(Self { simulator, gain, limits, period, limit, preview_s, command })
    }

    /// Preview of the demand for [`Self::step`]: dead time, lag of the placed poles and half a
    /// period, at most what is available \[s\].
    pub fn preview_s(&self) -> f64 {
        self.preview_s
    }

    /// Starts from a constant demand and the applied command. Where the two differ, the command
    /// goes to that of the demand at the rate limit.
    pub fn start(&mut self, demand: f64, applied: f64) -> Result<(), FeedforwardError> {
        self.simulator.settle(demand)?;
        self.command = applied;
        Ok(())
    }

    /// The command of this period for the demand [`Self::preview_s`] from now. A demand that is
    /// not finite keeps the command.
    pub fn step(&mut self, demand: f64) -> f64 {
        if demand.is_finite() {
            let ideal = self.simulator.step(demand);
            (self.command, self.limit) = self.limits.apply(ideal, self.command, self.period);
        }
        self.command
    }

    /// The limit that acted on the last command.
    pub fn limit(&self) -> CommandLimit {
        self.limit
    }

    /// Static gain.
    pub fn gain(&self) -> f64 {
        self.gain
    }
}

/// The model without dead time and with its zeros in the left half plane, and the delay by
/// mirroring \[s\].
pub(super) fn minimum_phase(
    model: &TransferFunction,
    rule: RightHalfPlaneZeros,
) -> Result<(TransferFunction, f64), FeedforwardError> {
    let zeros = model.zeros();
    let right: Vec<Complex<f64>> = zeros.iter().copied().filter(|zero| zero.re >= 0.0).collect();
    let Some(first) = right.first() else {
        return Ok((model.with_dead_time(0.0)?, 0.0));
    };
    // A zero on the imaginary axis has no stable mirror image.
    let on_the_axis = right.iter().any(|zero| zero.re <= 1e-9 * zero.norm());
    if rule == RightHalfPlaneZeros::Refuse || on_the_axis {
        return Err(FeedforwardError::NonMinimumPhase(*first));
    }
    let late_s = right.iter().map(|zero| 2.0 * zero.re / zero.norm_sqr()).sum();
    let mirrored: Vec<Complex<f64>> =
        zeros.iter().map(|zero| Complex::new(-zero.re.abs(), zero.im)).collect();
    let shape = from_roots(&mirrored);
    let rest = |row: &[f64]| row.last().copied().unwrap_or(1.0);
    let scale = rest(model.num()) / rest(&shape);
    let num: Vec<f64> = shape.iter().map(|c| c * scale).collect();
    Ok((TransferFunction::new(&num, model.den(), 0.0)?, late_s))
}
