//! From a demanded output to the command that gives it: the stable part of a
//! model's inverse with placed poles.

use nalgebra::Complex;

use super::FeedforwardError;
use crate::core::time::Span;
use crate::extruder::limits::{CommandLimit, CommandLimits};
use crate::numeric::lti::polynomial::{from_roots, multiply};
use crate::numeric::lti::{Between, Simulator, TransferFunction};

/// How a model is inverted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseSettings {
    /// Time constant of the poles that are placed where the inverse has none
    /// of its own \[s\]: as many as the model has poles more than zeros.
    pub time_constant_s: f64,
    /// What becomes of a zero in the right half plane.
    pub right_zeros: RightHalfPlaneZeros,
    /// How far ahead the demand is known.
    pub preview: Span,
    /// How late the output may be beyond that.
    pub max_delay: Span,
    /// Range and slew of the command.
    pub limits: CommandLimits,
    /// Time between two commands.
    pub period: Span,
}

/// What becomes of a zero in the right half plane, whose exact inverse would
/// grow without bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RightHalfPlaneZeros {
    /// The model is refused.
    Refuse,
    /// Its mirror image is inverted: the size at every frequency is right, and
    /// the output is late by 2·Re(z)/|z|² at low ones, which counts as dead
    /// time.
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
    dead_time_s: f64,
    lag_s: f64,
    preview_s: f64,
    command: f64,
}

impl Inverse {
    /// Inverts a model. Fails where the model is not stable or has no gain at
    /// rest, where it has a zero in the right half plane that is not to be
    /// mirrored, where its dead time is longer than the demand is known ahead
    /// and the output may be late, and where the settings make no sense.
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
        #[expect(clippy::cast_precision_loss, reason = "an order is small")]
        let lag_s = missing as f64 * time_constant_s;
        // A command that is held is half a period late in the mean.
        let preview_s = (dead_time_s + lag_s + 0.5 * period_s).min(known_s);
        let limits = settings.limits;
        Ok(Self {
            simulator,
            gain,
            limits,
            period: settings.period,
            limit: CommandLimit::None,
            dead_time_s,
            lag_s,
            preview_s,
            command: limits.idle(),
        })
    }

    /// How far ahead of now the demand is to be read for [`Self::step`]: dead
    /// time, lag of the placed poles and half a period, or as much of it as is
    /// known ahead \[s\].
    pub fn preview_s(&self) -> f64 {
        self.preview_s
    }

    /// How late the output is at low frequencies when the demand is read
    /// [`Self::preview_s`] ahead \[s\].
    pub fn delay_s(&self) -> f64 {
        self.dead_time_s + self.lag_s + 0.5 * self.period.secs() - self.preview_s
    }

    /// Takes a steady state up: a demand that has stood for long, and the
    /// command that is applied. Where the two do not belong together, the
    /// command goes from there to the demand's at the rate that is allowed.
    pub fn start(&mut self, demand: f64, applied: f64) -> Result<(), FeedforwardError> {
        self.simulator.settle(demand)?;
        self.command = applied;
        Ok(())
    }

    /// The command of this period for the demand at [`Self::preview_s`] from
    /// now. A demand that is no number leaves the command.
    pub fn step(&mut self, demand: f64) -> f64 {
        if demand.is_finite() {
            let wanted = self.simulator.step(demand);
            (self.command, self.limit) = self.limits.apply(wanted, self.command, self.period);
        }
        self.command
    }

    /// Tells what was applied in place of the command, so that the slew is
    /// counted from there.
    pub fn settle(&mut self, applied: f64) {
        if applied.is_finite() {
            self.command = applied;
        }
    }

    /// The limit that shaped the last command.
    pub fn limit(&self) -> CommandLimit {
        self.limit
    }

    /// Output for each unit of command at rest.
    pub fn gain(&self) -> f64 {
        self.gain
    }
}

/// The model without dead time and with its zeros in the left half plane, and
/// by how much mirroring makes it late \[s\].
pub(super) fn minimum_phase(
    model: &TransferFunction,
    rule: RightHalfPlaneZeros,
) -> Result<(TransferFunction, f64), FeedforwardError> {
    let zeros = model.zeros();
    let right: Vec<Complex<f64>> = zeros.iter().copied().filter(|zero| zero.re >= 0.0).collect();
    let Some(first) = right.first() else {
        return Ok((model.with_dead_time(0.0)?, 0.0));
    };
    // On the imaginary axis there is no mirror image that is stable.
    let on_the_axis = right.iter().any(|zero| zero.re <= 1e-9 * zero.norm());
    if rule == RightHalfPlaneZeros::Refuse || on_the_axis {
        return Err(FeedforwardError::NonMinimumPhase { re: first.re, im: first.im.abs() });
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
