//! The part of the flow that the model does not tell, from measurements that
//! come late.
//!
//! It is taken for the sum of an offset that wanders slowly and of a noise
//! that is forgotten within a correlation time τ (white noise through a lag).
//! Of the latter a measurement of age T tells at most the share e^(−T/τ): of
//! its standard deviation √(1 − e^(−2T/τ)) stays whatever the controller, and
//! the observer is the Kalman filter that gets there.

use nalgebra::{Matrix2, RowVector2, Vector2};

use super::{FeedforwardError, positive};
use crate::core::time::Stamp;
use crate::core::units::Mm3PerS;

/// What the part is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnmodelledFlow {
    /// Standard deviation of the part that is forgotten.
    pub sigma: Mm3PerS,
    /// τ: after which a share of e^(−1) of it is left \[s\].
    pub correlation_s: f64,
    /// How far the offset wanders in a second, as a standard deviation.
    pub drift: Mm3PerS,
}

/// A measurement of the flow, as a difference from the model's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowResidual {
    /// When that flow left the nozzle.
    pub at: Stamp,
    /// Measured less modelled flow.
    pub residual: Mm3PerS,
    /// Standard deviation of the measurement.
    pub sigma: Mm3PerS,
}

/// Kalman filter for the unmodelled flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowObserver {
    model: UnmodelledFlow,
    /// Noise and offset \[mm³/s\], as they were at `at`.
    state: Vector2<f64>,
    covariance: Matrix2<f64>,
    at: Option<Stamp>,
}

impl FlowObserver {
    /// An observer that knows nothing but what the part is like. Fails where
    /// sizes and time are not above zero (the wander may be zero).
    pub fn new(part: UnmodelledFlow) -> Result<Self, FeedforwardError> {
        let sigma = positive("the standard deviation of the flow", part.sigma.get())?;
        positive("the correlation time", part.correlation_s)?;
        if part.drift.get() < 0.0 {
            let (what, value) = ("the drift of the offset", part.drift.get());
            return Err(FeedforwardError::NotPositive { what, value });
        }
        // Beforehand the offset may be as large as the noise is in ten times
        // its size; the first measurements settle it.
        let covariance = Matrix2::new(sigma * sigma, 0.0, 0.0, 100.0 * sigma * sigma);
        Ok(Self { model: part, state: Vector2::zeros(), covariance, at: None })
    }

    /// Takes a measurement. One that is older than the last is weighed as if
    /// only what it shares with the newer state counted.
    pub fn measure(&mut self, seen: &FlowResidual) {
        let age_s = self.at.map_or(0.0, |at| (at - seen.at).secs());
        if age_s < 0.0 {
            self.state = self.predicted(-age_s);
            self.covariance = self.predicted_covariance(-age_s);
        }
        let shared = self.decay(age_s.max(0.0));
        let row = RowVector2::new(shared, 1.0);
        let own = self.model.sigma.get().powi(2) * (1.0 - shared * shared);
        let variance = seen.sigma.get().powi(2) + own;
        let cross_covariance = self.covariance * row.transpose();
        let total = (row * cross_covariance).x + variance;
        let innovation = seen.residual.get() - (row * self.state).x;
        if total > 0.0 {
            self.state += cross_covariance * (innovation / total);
            self.covariance -= cross_covariance * cross_covariance.transpose() / total;
        }
        self.at = Some(self.at.map_or(seen.at, |at| at.max(seen.at)));
    }

    /// The part at a moment after the last measurement.
    pub fn estimate(&self, at: Stamp) -> Mm3PerS {
        let after_s = self.at.map_or(0.0, |last| (at - last).secs().max(0.0));
        Mm3PerS::new(self.predicted(after_s).sum()).unwrap_or_default()
    }

    /// Its standard deviation then.
    pub fn sigma(&self, at: Stamp) -> Mm3PerS {
        let after_s = self.at.map_or(0.0, |last| (at - last).secs().max(0.0));
        Mm3PerS::new(self.predicted_covariance(after_s).sum().max(0.0).sqrt()).unwrap_or_default()
    }

    fn decay(&self, after_s: f64) -> f64 {
        libm::exp(-after_s / self.model.correlation_s)
    }

    fn predicted(&self, after_s: f64) -> Vector2<f64> {
        Vector2::new(self.decay(after_s) * self.state.x, self.state.y)
    }

    fn predicted_covariance(&self, after_s: f64) -> Matrix2<f64> {
        let kept = self.decay(after_s);
        let mut next = self.covariance;
        next[(0, 0)] *= kept * kept;
        next[(0, 1)] *= kept;
        next[(1, 0)] *= kept;
        next[(0, 0)] += self.model.sigma.get().powi(2) * (1.0 - kept * kept);
        next[(1, 1)] += self.model.drift.get().powi(2) * after_s;
        next
    }
}

/// What share of the standard deviation of a noise that is forgotten within
/// `correlation_s` is left after the best use of measurements without noise
/// of an age: the bound for every controller that acts `age_s` after it saw.
pub fn unpredictable_fraction(age_s: f64, correlation_s: f64) -> f64 {
    (-libm::expm1(-2.0 * age_s / correlation_s)).max(0.0).sqrt()
}
