//! One harmonic of a known period on a level that drifts: a Kalman filter on the level and
//! on the harmonic's two components, which rotate with time.

use std::f64::consts::TAU;

use super::pulsation::PulsationSample;
use super::width_model::MAX_SQUARED_INNOVATION;

/// Initial standard deviation of either component, as a fraction of the width: pulsations of
/// a pump or a screw are a few percent.
const AMPLITUDE_SIGMA: f64 = 0.03;
/// Random walk of either component: standard deviation over a radian. A larger value follows
/// a pulsation that changes and takes more noise for one.
const DRIFT_PER_ROOT_RAD: f64 = 2e-4;
/// Initial standard deviation of the level.
const LEVEL_SIGMA: f64 = 0.1;
/// State: the level, the in-phase component and the component a quarter of a period ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    rad_per_s: f64,
    parts: [f64; 3],
    /// Covariance of level and parts: (0,0), (0,1), (0,2), (1,1), (1,2), (2,2).
    covariance: [f64; 6],
    known: bool,
}

impl Harmonic {
    /// For a period \[s\]; infinite for a level alone.
    pub fn new(period_s: f64) -> Self {
        let rad_per_s = TAU / period_s;
        let part = if rad_per_s > 0.0 { AMPLITUDE_SIGMA * AMPLITUDE_SIGMA } else { 0.0 };
        let spread = [LEVEL_SIGMA * LEVEL_SIGMA, 0.0, 0.0, part, 0.0, part];
        Self { rad_per_s, parts: [0.0; 3], covariance: spread, known: false }
    }

    /// Period \[s\].
    pub fn period_s(&self) -> f64 {
        TAU / self.rad_per_s
    }

    /// Adds a value `dt_s` after the last one, that is the mean over `lasted_s`. Returns its log
    /// likelihood, without the constant.
    pub fn update(&mut self, dt_s: f64, one: &PulsationSample) -> f64 {
        let PulsationSample { value, variance, drift, lasted_s, .. } = *one;
        if !self.known {
            self.known = true;
            self.parts[0] = value;
            return 0.0;
        }
        self.rotate(dt_s, drift);
        let [p00, p01, p02, p11, p12, p22] = self.covariance;
        let kept = kept_by_mean(self.rad_per_s * lasted_s);
        let (h0, h1, h2) = (p00 + kept * p01, p01 + kept * p11, p02 + kept * p12);
        let total = (h0 + kept * h1).max(0.0) + variance;
        let by = value - self.parts[0] - kept * self.parts[1];
        let squared = (by * by / total).min(MAX_SQUARED_INNOVATION);
        let limit = (MAX_SQUARED_INNOVATION * total).sqrt();
        let by = by.clamp(-limit, limit) / total;
        self.parts = [self.parts[0] + h0 * by, self.parts[1] + h1 * by, self.parts[2] + h2 * by];
        self.covariance = [
            p00 - h0 * h0 / total,
            p01 - h0 * h1 / total,
            p02 - h0 * h2 / total,
            p11 - h1 * h1 / total,
            p12 - h1 * h2 / total,
            p22 - h2 * h2 / total,
        ];
        -0.5 * (squared + libm::log(total))
    }

    fn rotate(&mut self, dt_s: f64, drift: f64) {
        let angle = self.rad_per_s * dt_s;
        let [p00, p01, p02, p11, p12, p22] = self.covariance;
        if angle == 0.0 {
            self.covariance[0] = p00 + drift;
            return;
        }
        let (sin, cos) = libm::sincos(angle);
        let [level, a, b] = self.parts;
        self.parts = [level, cos * a + sin * b, cos * b - sin * a];
        let part_drift = 2.0 * DRIFT_PER_ROOT_RAD * DRIFT_PER_ROOT_RAD * angle;
        let (cc, ss, cs) = (cos * cos, sin * sin, cos * sin);
        self.covariance = [
            p00 + drift,
            cos * p01 + sin * p02,
            cos * p02 - sin * p01,
            cc * p11 + 2.0 * cs * p12 + ss * p22 + part_drift,
            (cc - ss) * p12 + cs * (p22 - p11),
            ss * p11 - 2.0 * cs * p12 + cc * p22 + part_drift,
        ];
    }

    /// The level may have changed by a variance.
    pub fn loosen(&mut self, variance: f64) {
        self.covariance[0] += variance;
    }

    /// The pulsation `dt_s` after the last value.
    pub fn at(&self, dt_s: f64) -> f64 {
        let (sin, cos) = libm::sincos(self.rad_per_s * dt_s);
        cos * self.parts[1] + sin * self.parts[2]
    }

    /// What a mean over a time \[s\] keeps of the amplitude; negative where it inverts it.
    pub fn kept_over(&self, lasted_s: f64) -> f64 {
        kept_by_mean(self.rad_per_s * lasted_s)
    }

    /// Expected square of that mean.
    pub fn mean_square(&self, from_s: f64, to_s: f64) -> f64 {
        let (sin, cos) = libm::sincos(self.rad_per_s * 0.5 * (from_s + to_s));
        let [_, _, _, p11, p12, p22] = self.covariance;
        let variance = cos * cos * p11 + 2.0 * cos * sin * p12 + sin * sin * p22;
        let kept = kept_by_mean(self.rad_per_s * (to_s - from_s));
        self.mean(from_s, to_s).powi(2) + kept * kept * variance
    }

    /// Mean of the pulsation between two times after the last value \[s\].
    pub fn mean(&self, from_s: f64, to_s: f64) -> f64 {
        self.at(0.5 * (from_s + to_s)) * kept_by_mean(self.rad_per_s * (to_s - from_s))
    }
}

/// What a mean over an angle keeps of the harmonic's amplitude.
fn kept_by_mean(angle_rad: f64) -> f64 {
    let half = 0.5 * angle_rad;
    if half.abs() < 1e-9 { 1.0 } else { libm::sin(half) / half }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(value: f64, variance: f64, drift: f64, lasted_s: f64) -> PulsationSample {
        PulsationSample { laid_s: 0.0, lasted_s, value, variance, drift }
    }

    #[test]
    fn a_pulsation_of_its_period_is_predicted() {
        let period = 2.3;
        let truth = |at: f64| 3.7 + 0.02 * (TAU * at / period + 0.4).sin();
        let mut harmonic = Harmonic::new(period);
        for k in 0..600 {
            let _ = harmonic.update(0.02, &sample(truth(0.02 * f64::from(k)), 1e-6, 1e-9, 0.0));
        }
        let last = 0.02 * 599.0;
        for ahead in [0.0, 0.5, 1.3] {
            let found = harmonic.at(ahead) - (truth(last + ahead) - 3.7);
            assert!(found.abs() < 1e-4, "{ahead}: {found}");
        }
        let mean = harmonic.mean(0.2, 0.2 + period);
        assert!(mean.abs() < 1e-9, "a whole period has no mean: {mean}");
    }

    #[test]
    fn a_level_alone_has_no_pulsation() {
        let mut harmonic = Harmonic::new(f64::INFINITY);
        for k in 0..100 {
            let _ = harmonic.update(0.1, &sample(3.7 + 0.01 * f64::from(k % 2), 1e-4, 1e-8, 0.0));
        }
        assert_eq!(harmonic.at(0.3), 0.0);
    }

    #[test]
    fn a_mean_over_a_gauge_is_less_than_the_pulsation_at_the_nozzle() {
        let (period, lasted) = (2.0, 0.8);
        let half = 0.5 * TAU * lasted / period;
        let truth = |at: f64| 0.02 * (TAU * at / period).sin();
        let mut harmonic = Harmonic::new(period);
        for k in 0..600 {
            let seen = 3.7 + truth(0.02 * f64::from(k)) * half.sin() / half;
            let _ = harmonic.update(0.02, &sample(seen, 1e-6, 1e-9, lasted));
        }
        let off = harmonic.at(0.5) - truth(0.02 * 599.0 + 0.5);
        assert!(off.abs() < 1e-4, "{off}");
    }
}
