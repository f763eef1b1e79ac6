//! Follows a demand with placed poles by state feedback on a model that is driven by the applied
//! command: the inverse of the model without limits; with limits, or from rest, the transition
//! from the true state.

use nalgebra::{DMatrix, DVector};

use super::inverse::{InverseSettings, minimum_phase};
use super::{FeedforwardError, Inverse};
use crate::core::Span;
use crate::numeric::lti::{StateSpace, TransferFunction};
use crate::numeric::number::to_f64;

/// Smallest number of command periods in a time constant of the placed poles: with fewer the
/// sampled feedback oscillates.
const MIN_PERIODS: f64 = 4.0;

/// The model's state with its feedback.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracker {
    /// Transition of the state over one period of a held command.
    transition: DMatrix<f64>,
    input_vector: DVector<f64>,
    /// Gains of the command on the state and on the demand.
    state_gain: DVector<f64>,
    demand_gain: f64,
    /// Steady state per unit of command.
    steady: DVector<f64>,
    gain: f64,
    period: Span,
    state: DVector<f64>,
    next: DVector<f64>,
}

impl Tracker {
    /// For a model without its dead time. Fails as [`Inverse::new`] does, and for poles that are too
    /// fast for the commands.
    ///
    /// With a relative degree of n, the n-th derivative of the output is
    /// C·Aⁿ·x + C·Aⁿ⁻¹·B·u; the command is the one at which
    /// (λ·d/dt + 1)ⁿ of the output is the demand.
    pub fn new(
        model: &TransferFunction,
        settings: &InverseSettings,
    ) -> Result<Self, FeedforwardError> {
        let gain = Inverse::new(model, settings)?.gain();
        let (plant, _) = minimum_phase(model, settings.right_zeros)?;
        let space = StateSpace::of(&plant);
        let over = space.advance(settings.period.secs());
        let (time_constant_s, period_s) = (settings.time_constant_s, settings.period.secs());
        let excess = model.den().len() - model.num().len();
        let (state_gain, demand_gain) = if excess == 0 {
            (-&space.c / space.d, 1.0 / space.d)
        } else {
            feedback(&space, excess, time_constant_s)
        };
        let least_s = MIN_PERIODS * period_s;
        if excess > 0 && time_constant_s < least_s {
            return Err(FeedforwardError::PolesTooFast { time_constant_s, period_s, least_s });
        }
        let order = space.b.len();
        Ok(Self {
            transition: over.state,
            input_vector: over.constant,
            state_gain,
            demand_gain,
            steady: space.steady()?,
            gain,
            period: settings.period,
            state: DVector::zeros(order),
            next: DVector::zeros(order),
        })
    }

    /// Time of one [`Self::advance`].
    pub const fn period(&self) -> Span {
        self.period
    }

    /// Static gain.
    pub const fn gain(&self) -> f64 {
        self.gain
    }

    /// Starts in the steady state of a command.
    pub fn start(&mut self, applied: f64) {
        self.state.copy_from(&self.steady);
        self.state *= applied;
    }

    /// Advances one period with the command that was applied over it.
    pub fn advance(&mut self, applied: f64) {
        self.next.copy_from(&self.input_vector);
        self.next *= applied;
        self.next.gemv(1.0, &self.transition, &self.state, 1.0);
        std::mem::swap(&mut self.state, &mut self.next);
    }

    /// The command for a demand now.
    pub fn command(&self, demand: f64) -> f64 {
        self.state_gain.dot(&self.state) + self.demand_gain * demand
    }
}

/// The gains on the state and on the demand.
fn feedback(space: &StateSpace, excess: usize, time_constant_s: f64) -> (DVector<f64>, f64) {
    let mut row = space.c.clone();
    let mut target = DVector::zeros(space.b.len());
    let (mut binomial, mut power) = (1.0, 1.0);
    let mut lead_gain = 0.0;
    for derivative in 0..excess {
        target += &row * (binomial * power);
        lead_gain = row.dot(&space.b);
        row = space.a.tr_mul(&row);
        binomial *= to_f64(excess - derivative) / to_f64(derivative + 1);
        power *= time_constant_s;
    }
    let by_state = -(target / power + row) / lead_gain;
    (by_state, 1.0 / (power * lead_gain))
}
