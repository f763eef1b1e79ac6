//! Kalman filter (Kalman 1960) of a pressure that drifts as a random walk, and identification of
//! its noise from readings. Ma et al. 2026, section 2.3.

use super::{PressureError, within};
use crate::core::MPa;
use crate::numeric::number::to_f64;

/// Smallest number of readings to identify the noise from. Derived: the relative standard error
/// of a variance from n independent readings is √(2/n), 10 % for 200.
pub const MIN_READINGS: usize = 200;

/// Drift of a pressure and noise of its readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureNoise {
    drift: f64,
    reading: f64,
}

impl PressureNoise {
    /// From the variance of the drift from one reading to the next and that of a reading
    /// \[MPa²\].
    pub fn new(drift_mpa2: f64, reading_mpa2: f64) -> Result<Self, PressureError> {
        within("the drift's variance [MPa²]", drift_mpa2, 0.0..=1e6, "between 0 and 1e6")?;
        let wanted = "above 1e-18 and at most 1e6";
        within("the readings' variance [MPa²]", reading_mpa2, 1e-18..=1e6, wanted)?;
        Ok(Self { drift: drift_mpa2, reading: reading_mpa2 })
    }

    /// From readings at a constant command: the maximum likelihood estimate of a random walk in
    /// white noise, by the innovations of this filter. Needs [`MIN_READINGS`], and fails on
    /// readings that show no noise.
    pub fn identify(readings: &[MPa]) -> Result<Self, PressureError> {
        let found = readings.len();
        if found < MIN_READINGS {
            return Err(PressureError::TooFew { found, wanted: MIN_READINGS });
        }
        let squares = readings.windows(2).map(|pair| (pair[1].get() - pair[0].get()).powi(2));
        let variance = squares.sum::<f64>() / to_f64(found - 1);
        if !(variance > 0.0 && variance.is_finite()) {
            return Err(PressureError::NoNoise(variance));
        }
        let ratio = likeliest_drift(readings);
        let (reading, _) = likelihood(readings, ratio);
        if reading <= 0.01 * variance {
            return Err(PressureError::NoNoise(variance));
        }
        // A ratio at the end of the search range counts as no drift.
        Self::new(if ratio > MIN_DRIFT_RATIO { ratio * reading } else { 0.0 }, reading)
    }

    /// Standard deviation of a reading.
    pub fn sigma(&self) -> MPa {
        MPa::new(self.reading.sqrt()).unwrap_or_default()
    }

    /// Variance of the drift from one reading to the next \[MPa²\].
    pub const fn drift_mpa2(&self) -> f64 {
        self.drift
    }

    /// Variance of a reading \[MPa²\].
    pub const fn reading_mpa2(&self) -> f64 {
        self.reading
    }
}

/// The most likely variance of a reading \[MPa²\] for a ratio of the variances of drift and reading,
/// and the log likelihood at it, without the constant.
fn likelihood(readings: &[MPa], ratio: f64) -> (f64, f64) {
    let Some((first, rest)) = readings.split_first() else { return (0.0, f64::NEG_INFINITY) };
    // In units of the readings' variance; starts from the first reading.
    let (mut at, mut variance) = (first.get(), 1.0);
    let (mut squares, mut logs, mut count) = (0.0, 0.0, 0.0);
    for reading in rest {
        let predicted = variance + ratio;
        let innovation = predicted + 1.0;
        let off = reading.get() - at;
        squares += off * off / innovation;
        logs += libm::log(innovation);
        count += 1.0;
        at += predicted / innovation * off;
        variance = predicted / innovation;
    }
    let reading = squares / f64::max(count, 1.0);
    (reading, -0.5 * (count * libm::log(reading) + logs))
}

/// Ratios of the variances of drift and reading below this count as no drift: over 10⁷ readings
/// the drift is smaller than one reading's noise.
const MIN_DRIFT_RATIO: f64 = 1e-7;

/// The most likely ratio of the variances of drift and reading, between 1e-10 and 1e4, to one
/// per cent.
fn likeliest_drift(readings: &[MPa]) -> f64 {
    let log_of = |exponent: f64| likelihood(readings, libm::exp(exponent)).1;
    let mut likeliest = -7.0;
    for (step, steps) in [(1.0, 16), (0.1, 9), (0.01, 9)] {
        let around = (-steps..=steps).map(|k| likeliest + step * f64::from(k));
        let better = |best: (f64, f64), next: (f64, f64)| if next.0 > best.0 { next } else { best };
        let start = (f64::NEG_INFINITY, likeliest);
        likeliest = around.map(|exponent| (log_of(exponent), exponent)).fold(start, better).1;
    }
    libm::exp(likeliest)
}

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kalman {
    noise: PressureNoise,
    estimate: f64,
    variance: f64,
}

impl Kalman {
    /// Starts at a pressure with the variance of a reading.
    pub fn new(noise: PressureNoise, pressure: MPa) -> Self {
        Self { noise, estimate: pressure.get(), variance: noise.reading }
    }

    /// Updates with a reading; returns the estimated pressure \[MPa\].
    pub fn step(&mut self, reading: MPa) -> f64 {
        let predicted = self.variance + self.noise.drift;
        let gain = predicted / (predicted + self.noise.reading);
        let innovation = reading.get() - self.estimate;
        self.estimate += gain * innovation;
        self.variance = (1.0 - gain) * predicted;
        self.estimate
    }

    /// The estimated pressure \[MPa\].
    pub const fn pressure(&self) -> f64 {
        self.estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash::{mix, normal_pair};

    const Q: f64 = 2e-5;
    const R: f64 = 4.98e-5;

    fn readings(q: f64, r: f64, count: u64) -> Vec<MPa> {
        let mut pressure = 0.6;
        (0..count)
            .map(|i| {
                let [a, b] = normal_pair(mix(&[42, i]));
                pressure += q.sqrt() * a;
                MPa::constant(pressure + r.sqrt() * b)
            })
            .collect()
    }

    #[test]
    fn the_gain_settles_at_the_solution_of_the_riccati_equation() {
        let mut kalman = Kalman::new(PressureNoise::new(Q, R).unwrap(), MPa::ZERO);
        for _ in 0..200 {
            kalman.step(MPa::ZERO);
        }
        let predicted = Q / 2.0 + (Q * Q / 4.0 + Q * R).sqrt();
        let before = kalman.pressure();
        kalman.step(MPa::constant(1.0));
        let expected = predicted / (predicted + R);
        assert!((kalman.pressure() - before - expected).abs() < 1e-12);
    }

    #[test]
    fn the_noise_is_identified_from_readings() {
        let found = PressureNoise::identify(&readings(Q, R, 20_000)).unwrap();
        assert!((found.reading / R - 1.0).abs() < 0.04, "{found:?}");
        assert!((found.drift / Q - 1.0).abs() < 0.08, "{found:?}");
        assert!((found.sigma().get() - 0.007_06).abs() < 3e-4);
    }

    #[test]
    fn the_smallest_number_of_readings_gives_a_variance_to_a_tenth() {
        let relative_error = (2.0 / to_f64(MIN_READINGS)).sqrt();
        assert!((relative_error - 0.1).abs() < 1e-12);
    }

    #[test]
    fn readings_without_noise_are_refused() {
        let stuck = [MPa::constant(0.6); 300];
        assert!(matches!(PressureNoise::identify(&stuck), Err(PressureError::NoNoise(_))));
        let ramp: Vec<MPa> = (0..300).map(|i| MPa::constant(f64::from(i) * 0.001)).collect();
        assert!(matches!(PressureNoise::identify(&ramp), Err(PressureError::NoNoise(_))));
        let few = PressureNoise::identify(&stuck[..10]);
        assert_eq!(few, Err(PressureError::TooFew { found: 10, wanted: MIN_READINGS }));
        assert!(PressureNoise::new(Q, 0.0).is_err());
        assert!(PressureNoise::new(f64::NAN, R).is_err());
    }
}
