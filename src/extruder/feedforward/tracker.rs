//! A demand followed with placed poles by feedback on the state of a model,
//! which is told what was applied: the inverse of the model as long as nothing
//! limits the command, and where something does, or the extruder stood before,
//! the way from where it really is.

use nalgebra::{DMatrix, DVector};

use super::inverse::{InverseSettings, minimum_phase};
use super::{FeedforwardError, Inverse};
use crate::core::time::Span;
use crate::numeric::lti::{StateSpace, TransferFunction};

/// Periods of the command in one time constant of the placed poles: with fewer,
/// the feedback, which is held over a period, swings.
const MIN_PERIODS: f64 = 4.0;

/// The model's state with the feedback on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracker {
    /// State over one period of a command that is held.
    transition: DMatrix<f64>,
    input_vector: DVector<f64>,
    /// The command for each unit of the state and of the demand.
    state_gain: DVector<f64>,
    demand_gain: f64,
    /// State for each unit of a command that stands.
    steady: DVector<f64>,
    gain: f64,
    period: Span,
    state: DVector<f64>,
    next: DVector<f64>,
}

impl Tracker {
    /// For a model without its dead time. What cannot be inverted is refused
    /// as [`Inverse::new`] refuses it, and so are poles that the commands are
    /// too rare for.
    ///
    /// With n poles more than zeros, the n-th derivative of the output is
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
        let excess = model.den().len() - model.num().len();
        let (by_state, by_demand) = if excess == 0 {
            (-&space.c / space.d, 1.0 / space.d)
        } else {
            feedback(&space, excess, settings.time_constant_s)
        };
        let least_s = MIN_PERIODS * settings.period.secs();
        if excess > 0 && settings.time_constant_s < least_s {
            return Err(FeedforwardError::PolesTooFast {
                time_constant_s: settings.time_constant_s,
                period_s: settings.period.secs(),
                least_s,
            });
        }
        let order = space.b.len();
        Ok(Self {
            transition: over.state,
            input_vector: over.constant,
            state_gain: by_state,
            demand_gain: by_demand,
            steady: space.steady()?,
            gain,
            period: settings.period,
            state: DVector::zeros(order),
            next: DVector::zeros(order),
        })
    }

    /// Time that [`Self::pass`] goes on by.
    pub const fn period(&self) -> Span {
        self.period
    }

    /// Output for each unit of a command that stands.
    pub const fn gain(&self) -> f64 {
        self.gain
    }

    /// As after a command that has stood for long.
    pub fn start(&mut self, applied: f64) {
        self.state.copy_from(&self.steady);
        self.state *= applied;
    }

    /// One period passes with what was applied over it.
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

/// The rows that act on the state and on the demand.
fn feedback(space: &StateSpace, excess: usize, time_constant_s: f64) -> (DVector<f64>, f64) {
    let mut row = space.c.clone();
    let mut wanted = DVector::zeros(space.b.len());
    let (mut binomial, mut power) = (1.0, 1.0);
    let mut lead_gain = 0.0;
    for derivative in 0..excess {
        wanted += &row * (binomial * power);
        lead_gain = row.dot(&space.b);
        row = space.a.tr_mul(&row);
        #[expect(clippy::cast_precision_loss, reason = "an order is small")]
        let step = (excess - derivative) as f64 / (derivative + 1) as f64;
        binomial *= step;
        power *= time_constant_s;
    }
    let by_state = -(wanted / power + row) / lead_gain;
    (by_state, 1.0 / (power * lead_gain))
}
