//! Kalman's filter (1960) of a pressure that wanders, and the noise it needs,
//! from readings. Ma et al. 2026, section 2.3.

use super::{PressureError, within};
use crate::core::units::MPa;

/// Fewest readings that a noise is told from: its variance is then known to
/// about a tenth.
pub const MIN_READINGS: usize = 200;

/// How a pressure wanders and how its readings scatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureNoise {
    drift: f64,
    reading: f64,
}

impl PressureNoise {
    /// From the variance of the wandering from one reading to the next and
    /// that of a reading \[MPa²\].
    pub fn new(wander_mpa2: f64, reading_mpa2: f64) -> Result<Self, PressureError> {
        within("the drift's variance [MPa²]", wander_mpa2, 0.0..=1e6, "between 0 and 1e6")?;
        let wanted = "above 1e-18 and at most 1e6";
        within("the readings' variance [MPa²]", reading_mpa2, 1e-18..=1e6, wanted)?;
        Ok(Self { drift: wander_mpa2, reading: reading_mpa2 })
    }

    /// From readings at a steady command: of all random walks under white noise
    /// the one that makes them likeliest, by this filter's own innovations.
    /// Needs [`FEWEST_READINGS`], and fails on readings that show no noise.
    pub fn identify(readings: &[MPa]) -> Result<Self, PressureError> {
        let found = readings.len();
        if found < MIN_READINGS {
            return Err(PressureError::TooFew { found, wanted: MIN_READINGS });
        }
        let changes: Vec<f64> =
            readings.windows(2).map(|pair| pair[1].get() - pair[0].get()).collect();
        let variance = mean(changes.iter().map(|change| change * change));
        if !(variance > 0.0 && variance.is_finite()) {
            return Err(PressureError::NoNoise { variance });
        }
        let ratio = likeliest_drift(readings);
        let reading = Likelihood::of(readings, ratio).reading;
        if reading <= 0.01 * variance {
            return Err(PressureError::NoNoise { variance });
        }
        // A share at the end of what was looked through is none.
        Self::new(if ratio > MIN_DRIFT_RATIO { ratio * reading } else { 0.0 }, reading)
    }

    /// Standard deviation of a reading.
    pub fn sigma(&self) -> MPa {
        MPa::new(self.reading.sqrt()).unwrap_or_default()
    }

    /// Variance that the pressure gains from one reading to the next \[MPa²\].
    pub const fn drift_mpa2(&self) -> f64 {
        self.drift
    }

    /// Variance of a reading \[MPa²\].
    pub const fn reading_mpa2(&self) -> f64 {
        self.reading
    }
}

#[expect(clippy::cast_precision_loss, reason = "a count of readings")]
fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

/// How likely readings are where the pressure's own steps have a share of the
/// variance of a reading, whose own variance is the likeliest to that share.
#[derive(Debug, Clone, Copy)]
struct Likelihood {
    /// Variance of a reading \[MPa²\].
    reading: f64,
    /// Logarithm, but for a constant.
    log: f64,
}

impl Likelihood {
    fn of(readings: &[MPa], ratio: f64) -> Self {
        let Some((first, rest)) = readings.split_first() else {
            return Self { reading: 0.0, log: f64::NEG_INFINITY };
        };
        // In units of the readings' variance; the first reading is all that is
        // known to begin with.
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
        Self { reading, log: -0.5 * (count * libm::log(reading) + logs) }
    }
}

/// Shares of the pressure's own steps below this are none.
const MIN_DRIFT_RATIO: f64 = 1e-7;

/// Variance of the pressure's own step from reading to reading over that of a
/// reading, between 1e-10 and 1e4, to a hundredth.
fn likeliest_drift(readings: &[MPa]) -> f64 {
    let log_of = |exponent: f64| Likelihood::of(readings, libm::exp(exponent)).log;
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
    /// Starts at a pressure that is known as well as a reading.
    pub fn new(noise: PressureNoise, pressure: MPa) -> Self {
        Self { noise, estimate: pressure.get(), variance: noise.reading }
    }

    /// Takes a reading, and gives the pressure \[MPa\].
    pub fn step(&mut self, reading: MPa) -> f64 {
        let predicted = self.variance + self.noise.drift;
        let gain = predicted / (predicted + self.noise.reading);
        let innovation = reading.get() - self.estimate;
        self.estimate += gain * innovation;
        self.variance = (1.0 - gain) * predicted;
        self.estimate
    }

    /// The pressure \[MPa\].
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
    fn the_gain_settles_where_the_riccati_equation_says() {
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
    fn the_noise_is_told_from_readings() {
        let found = PressureNoise::identify(&readings(Q, R, 20_000)).unwrap();
        assert!((found.reading / R - 1.0).abs() < 0.04, "{found:?}");
        assert!((found.drift / Q - 1.0).abs() < 0.08, "{found:?}");
        assert!((found.sigma().get() - 0.007_06).abs() < 3e-4);
    }

    #[test]
    fn readings_that_tell_no_noise_are_refused() {
        let stuck = [MPa::constant(0.6); 300];
        assert!(matches!(PressureNoise::identify(&stuck), Err(PressureError::NoNoise { .. })));
        let ramp: Vec<MPa> = (0..300).map(|i| MPa::constant(f64::from(i) * 0.001)).collect();
        assert!(matches!(PressureNoise::identify(&ramp), Err(PressureError::NoNoise { .. })));
        let few = PressureNoise::identify(&stuck[..10]);
        assert_eq!(few, Err(PressureError::TooFew { found: 10, wanted: MIN_READINGS }));
        assert!(PressureNoise::new(Q, 0.0).is_err());
        assert!(PressureNoise::new(f64::NAN, R).is_err());
    }
}
