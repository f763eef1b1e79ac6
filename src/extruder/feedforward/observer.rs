//! Observer of the unmodelled flow, from delayed measurements.
//!
//! The unmodelled flow is the sum of an offset that drifts slowly and of correlated noise with
//! a correlation time τ (white noise through a lag). A measurement of age T predicts at most the
//! fraction e^(−T/τ) of the latter: √(1 − e^(−2T/τ)) of its standard deviation remains for any
//! controller, and the Kalman filter reaches that bound.

use nalgebra::{Matrix2, RowVector2, Vector2};

use super::{FeedforwardError, positive};
use crate::core::{Mm3PerS, Stamp};

/// Model of the unmodelled flow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnmodelledFlow {
    /// Standard deviation of the correlated noise.
    pub sigma: Mm3PerS,
    /// τ: its correlation time \[s\].
    pub correlation_s: f64,
    /// Drift of the offset: standard deviation over a second.
    pub drift: Mm3PerS,
}

/// Residual of a measured flow to the model.
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
    /// Before the first measurement. Fails where standard deviation and time are not positive (the
    /// drift may be zero).
    pub fn new(part: UnmodelledFlow) -> Result<Self, FeedforwardError> {
        let sigma = positive("the standard deviation of the flow", part.sigma.get())?;
        positive("the correlation time", part.correlation_s)?;
        if part.drift.get() < 0.0 {
            let (what, value) = ("the drift of the offset", part.drift.get());
            return Err(FeedforwardError::NotPositive { what, value });
        }
        // Initial standard deviation of the offset: ten times that of the noise, so that the
        // first measurements determine it.
        let covariance = Matrix2::new(sigma * sigma, 0.0, 0.0, 100.0 * sigma * sigma);
        Ok(Self { model: part, state: Vector2::zeros(), covariance, at: None })
    }

    /// Updates with a measurement. One that is older than the last is weighted by its correlation
    /// with the newer state.
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

    /// The unmodelled flow at a moment after the last measurement.
    pub fn estimate(&self, at: Stamp) -> Mm3PerS {
        let after_s = self.at.map_or(0.0, |last| (at - last).secs().max(0.0));
        Mm3PerS::new(self.predicted(after_s).sum()).unwrap_or_default()
    }

    /// Standard deviation of that estimate.
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

/// Fraction of the standard deviation of correlated noise that remains after optimal prediction
/// from exact measurements of an age: the bound for every controller with that delay.
pub fn unpredictable_fraction(age_s: f64, correlation_s: f64) -> f64 {
    (-libm::expm1(-2.0 * age_s / correlation_s)).max(0.0).sqrt()
}
