//! A series that is predicted from its last values.

/// Variance of a coefficient before the first value, and the largest one. Derived: the coefficients of a
/// sinusoid are between −2 and 2.
const PRIOR_VARIANCE: f64 = 1.0;
/// Increase of that variance with each value. Derived: a coefficient changes by 0.1 over 100 values.
const DRIFT: f64 = 1e-4;
/// Coefficients before the first value. Derived: a change that passes through the gauge goes
/// on for some widths; between 0 of roughness and 1 of a ramp.
const PRIOR: [f64; 2] = [0.7, 0.0];
/// Weight of a squared prediction error in the variance, after the first ones. Derived: a mean over 50
/// values, some four offsets of a camera.
const WEIGHT: f64 = 0.02;
/// Smallest variance. Derived: a hundred-thousandth of a width, below any camera.
const MIN_VARIANCE: f64 = 1e-10;
/// Squared prediction errors are clipped at this many variances. Derived: as in the test of the offset ...
const MAX_SQUARE: f64 = 20.0;
/// ... and at this many where the variance is learnt. Derived: the mean of min(z², 5) is 0.95; a jump
/// hardly changes the variance by which the next one is judged.
const MAX_LEARNT_SQUARE: f64 = 5.0;
/// Values before the first prediction. Derived: they make two differences.
const BEFORE_PREDICTING: u32 = 3;
/// Values after which predictions are more than a beginning. Derived: by then a variance that was given
/// a hundred times too small, (13/4)⁴, has been learnt.
const BEGINNING: u32 = 13;

/// What a prediction missed a value by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictionError {
    /// The squared error; 0 where there was no prediction yet.
    pub square: f64,
    /// The variance that it was expected to have.
    pub variance: f64,
}

/// An autoregression of second order of the differences of a series, whose coefficients are estimated
/// by a Kalman filter. It predicts a drift or a sinusoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Autoregression {
    prior_variance: f64,
    coefficients: [f64; 2],
    covariance: [[f64; 2]; 2],
    last: f64,
    /// The last two differences, newest first.
    differences: [f64; 2],
    count: u32,
    /// Mean of earlier squared errors.
    variance: f64,
}

impl Autoregression {
    /// With a first guess of the variance of its prediction errors.
    pub fn new(variance: f64) -> Self {
        let variance = variance.max(MIN_VARIANCE);
        let covariance = [[PRIOR_VARIANCE, 0.0], [0.0, PRIOR_VARIANCE]];
        let (last, differences) = (0.0, [0.0; 2]);
        Self {
            prior_variance: variance,
            coefficients: PRIOR,
            covariance,
            last,
            differences,
            count: 0,
            variance,
        }
    }

    /// A new series.
    pub fn begin(&mut self) {
        *self = Self::new(self.prior_variance);
    }

    /// Whether enough values have come for predictions.
    pub fn is_begun(&self) -> bool {
        self.count >= BEGINNING
    }

    /// Adds a value.
    pub fn predict(&mut self, value: f64) -> PredictionError {
        let (difference, variance) = (value - self.last, self.variance);
        let square = if self.count < BEFORE_PREDICTING { 0.0 } else { self.learn(difference) };
        if self.count > 0 {
            self.differences = [difference, self.differences[0]];
        }
        self.last = value;
        self.count = self.count.saturating_add(1);
        PredictionError { square, variance }
    }

    /// Kalman step of the coefficients; returns the squared prediction error.
    fn learn(&mut self, difference: f64) -> f64 {
        let [a, b] = self.differences;
        let error = difference - self.coefficients[0] * a - self.coefficients[1] * b;
        for (number, row) in self.covariance.iter_mut().enumerate() {
            row[number] = (row[number] + DRIFT).min(PRIOR_VARIANCE);
        }
        let along = self.covariance.map(|row| row[0] * a + row[1] * b);
        let predicted = self.variance + a * along[0] + b * along[1];
        let limit = (MAX_SQUARE * predicted).sqrt();
        let innovation = error.clamp(-limit, limit);
        for (row, gain) in self.covariance.iter_mut().zip(along) {
            row[0] -= gain * along[0] / predicted;
            row[1] -= gain * along[1] / predicted;
        }
        for (coefficient, gain) in self.coefficients.iter_mut().zip(along) {
            *coefficient += gain / predicted * innovation;
        }
        let square = error * error;
        let clipped = square.min(MAX_LEARNT_SQUARE * self.variance);
        let weight = (1.0 / f64::from(self.count + 1)).max(WEIGHT);
        self.variance = (self.variance + weight * (clipped - self.variance)).max(MIN_VARIANCE);
        square
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash;

    #[test]
    fn a_series_without_noise_has_a_finite_variance() {
        let mut series = Autoregression::new(0.0);
        let noise = |k: u32| hash::normal_pair(hash::mix(&[3, u64::from(k)]))[0];
        let value = |k: u32| if k < 20 { 3.7 } else { 3.7 + 1e-3 * noise(k) };
        for k in 0..60 {
            assert!(series.predict(value(k)).variance.is_finite());
        }
        assert!(series.predict(value(60)).variance > 1e-9);
    }

    #[test]
    fn a_sinusoid_and_a_drift_are_predicted_and_a_jump_is_not() {
        let mut series = Autoregression::new(1e-6);
        let value = |k: u32| 0.02 * (f64::from(k) / 2.0).sin() + 1e-4 * f64::from(k);
        let errors: Vec<f64> = (0..200).map(|k| series.predict(value(k)).square).collect();
        // The difference of two values is up to 0.01.
        assert!(errors[100..].iter().all(|square| square.sqrt() < 1.5e-3));
        assert!(series.predict(value(200) + 0.02).square.sqrt() > 0.015);
    }
}
