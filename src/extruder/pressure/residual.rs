//! Measured less modelled pressure: filtered, without spikes, and with the noise of the readings.

/// Weight of a reading in the filter. A larger one lets more noise through, a smaller one delays.
/// Derived: this one delays by one reading.
const WEIGHT: f64 = 0.5;
/// Distance from the filter, in standard deviations of a reading, from which one reading alone is a
/// spike. A smaller one delays the answer to a step that the model does not predict, a larger one
/// lets spikes through.
pub const SPIKE_SIGMAS: f64 = 15.0;
/// Readings in a row that are no spikes, however they differ: the pressure moves faster than any
/// two of them agree. Derived: with 2 % of outliers, once in 125,000 readings by chance.
const MAX_SPIKES: u32 = 3;
/// Weight of a reading in the variance of the noise. Derived: a mean over fifty readings.
const NOISE_WEIGHT: f64 = 0.02;
/// Squares are clipped at this multiple of the variance, so that a step does not count as noise.
/// Derived: three standard deviations.
const MAX_SQUARE: f64 = 9.0;

/// The residual with its noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Standard deviation of a reading that the cell states \[MPa\].
    stated_sigma: f64,
    filtered: f64,
    /// The last reading that was used.
    last: Option<f64>,
    /// A reading that is a spike unless the next one agrees with it.
    suspect: Option<f64>,
    /// Readings in a row that are far from the filter.
    far_in_a_row: u32,
    variance: f64,
}

impl Residual {
    /// Before the first reading, for readings with a standard deviation \[MPa\].
    pub const fn new(sigma: f64) -> Self {
        let variance = sigma * sigma;
        Self {
            stated_sigma: sigma,
            filtered: 0.0,
            last: None,
            suspect: None,
            far_in_a_row: 0,
            variance,
        }
    }

    /// Takes the residual of a reading \[MPa\]; returns whether it is used.
    pub fn update(&mut self, residual: f64) -> bool {
        let spike = SPIKE_SIGMAS * self.stated_sigma;
        let far = (residual - self.filtered).abs() > spike;
        let agrees = self.suspect.is_some_and(|suspect| (residual - suspect).abs() < spike);
        self.far_in_a_row = if far { self.far_in_a_row + 1 } else { 0 };
        if far && !agrees && self.far_in_a_row < MAX_SPIKES {
            self.suspect = Some(residual);
            return false;
        }
        (self.suspect, self.far_in_a_row) = (None, 0);
        let weight = if far { 1.0 } else { WEIGHT };
        self.filtered += weight * (residual - self.filtered);
        if let Some(last) = self.last.replace(residual) {
            let square = 0.5 * (residual - last) * (residual - last);
            self.variance +=
                NOISE_WEIGHT * (square.min(MAX_SQUARE * self.variance) - self.variance);
        }
        true
    }

    /// The model's pressure has changed by a difference \[MPa\].
    pub fn shift(&mut self, by: f64) {
        self.filtered -= by;
        self.last = self.last.map(|last| last - by);
        self.suspect = self.suspect.map(|suspect| suspect - by);
    }

    /// The filtered residual \[MPa\].
    pub const fn filtered(&self) -> f64 {
        self.filtered
    }

    /// Standard deviation of a reading \[MPa\]: as stated, or as found where that is larger.
    pub fn sigma(&self) -> f64 {
        self.variance.sqrt().max(self.stated_sigma)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash::{mix, normal_pair};

    const SIGMA: f64 = 0.007;

    #[test]
    fn one_spike_is_left_out_and_a_step_is_followed_from_its_second_reading_on() {
        let mut residual = Residual::new(SIGMA);
        assert!(residual.update(0.001));
        assert!(!residual.update(1.5));
        assert!(residual.update(-0.001));
        assert!(residual.filtered().abs() < 0.001);
        assert!(!residual.update(0.4));
        assert!(residual.update(0.39));
        assert!((residual.filtered() - 0.39).abs() < 1e-12);
    }

    #[test]
    fn a_ramp_that_is_too_fast_for_two_readings_to_agree_is_followed_from_the_third_on() {
        let mut residual = Residual::new(SIGMA);
        assert!(residual.update(0.0));
        let used = [0.2, 0.4, 0.6].map(|reading| residual.update(reading));
        assert_eq!(used, [false, false, true]);
        assert!((residual.filtered() - 0.6).abs() < 1e-12);
    }

    #[test]
    fn a_noise_above_the_stated_one_is_found_and_one_below_it_is_not_trusted() {
        for (factor, expected) in [(4.0, 4.0), (1.0, 1.0), (0.3, 1.0)] {
            let mut residual = Residual::new(SIGMA);
            for i in 0..2000 {
                let [noise, _] = normal_pair(mix(&[11, i]));
                residual.update(factor * SIGMA * noise);
            }
            let found = residual.sigma() / SIGMA;
            assert!((found / expected - 1.0).abs() < 0.25, "{factor}: {found}");
        }
    }
}
