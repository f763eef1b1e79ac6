//! Detection of steps of the load: the generalised likelihood ratio of the last innovations with
//! a step that began at any of them to none (Willsky and Jones 1976), with a prior for the size
//! of the step.

/// An innovation and its variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Innovation {
    /// Measured less predicted pressure \[MPa\].
    pub difference: f64,
    /// Its variance \[MPa²\].
    pub variance: f64,
}

/// Innovations in the window. A longer one finds smaller steps later and costs more time.
const WINDOW: usize = 16;

/// Smallest decay over one interval: a step with less of its transient left counts as settled.
/// Derived: products of it over the window, 1e-96, do not underflow.
const MIN_DECAY: f64 = 1e-6;

/// A step of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// Its size once settled \[MPa\].
    pub settled: f64,
    /// Fraction of it that shows by now.
    pub shown_fraction: f64,
}

/// The last innovations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStepDetector {
    lag_s: f64,
    step_sigma: f64,
    threshold: f64,
    /// The newest first.
    innovations: [TimedInnovation; WINDOW],
    count: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct TimedInnovation {
    innovation: Innovation,
    /// Decay of a transient since the one before.
    decay: f64,
}

const NO_INNOVATION: TimedInnovation =
    TimedInnovation { innovation: Innovation { difference: 0.0, variance: 1.0 }, decay: 1.0 };

impl LoadStepDetector {
    /// For a lag \[s\], steps of this standard deviation \[MPa\], and a threshold of the log
    /// likelihood ratio.
    pub fn new(lag_s: f64, step_sigma: f64, threshold: f64) -> Self {
        Self { lag_s, step_sigma, threshold, innovations: [NO_INNOVATION; WINDOW], count: 0 }
    }

    /// Discards the innovations.
    pub fn reset(&mut self) {
        self.count = 0;
    }

    /// Adds an innovation, `dt_s` after the last. Returns a step that it detects; the window is
    /// empty after that.
    pub fn update(&mut self, innovation: Innovation, dt_s: f64) -> Option<LoadStep> {
        self.innovations.rotate_right(1);
        let kept = libm::exp(-dt_s / self.lag_s).max(MIN_DECAY);
        self.innovations[0] = TimedInnovation { innovation, decay: kept };
        self.count = (self.count + 1).min(WINDOW);
        let jump = self.likeliest();
        if jump.is_some() {
            self.reset();
        }
        jump
    }

    /// The most likely step. At each innovation a step has grown to 1 − left/passed, with
    /// `passed` the decay from there to the newest, so that the same sums serve every onset.
    fn likeliest(&self) -> Option<LoadStep> {
        let mut best = (self.threshold, None);
        let (mut passed, mut sums) = (1.0, Sums::default());
        for (back, seen) in self.innovations.iter().take(self.count).enumerate() {
            sums.add(seen.innovation, passed);
            if back > 0 {
                let (ratio, jump) = self.fit_step(&sums, passed * seen.decay.sqrt());
                if ratio > best.0 {
                    best = (ratio, Some(jump));
                }
            }
            passed *= seen.decay;
        }
        best.1
    }

    /// A step that began half an interval before the last innovation of the sums and of which
    /// the fraction `left` is still to come.
    fn fit_step(&self, sums: &Sums, left: f64) -> (f64, LoadStep) {
        let with = sums.difference[0] - left * sums.difference[1];
        let power = sums.weight[0] - 2.0 * left * sums.weight[1] + left * left * sums.weight[2];
        if power <= 0.0 {
            return (f64::NEG_INFINITY, LoadStep { settled: 0.0, shown_fraction: 0.0 });
        }
        let prior = self.step_sigma * self.step_sigma;
        let shrinkage = prior / (prior + 1.0 / power);
        let ratio = 0.5 * with * with / power * shrinkage - 0.5 * libm::log(1.0 + prior * power);
        let settled = shrinkage * with / power;
        (ratio, LoadStep { settled, shown_fraction: 1.0 - left })
    }
}

/// Sums over innovations, weighted by their inverse variances and by powers of their decay.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    difference: [f64; 2],
    weight: [f64; 3],
}

impl Sums {
    fn add(&mut self, innovation: Innovation, passed: f64) {
        let weight = 1.0 / innovation.variance;
        let grown = weight / passed;
        self.difference[0] += innovation.difference * weight;
        self.difference[1] += innovation.difference * grown;
        self.weight[0] += weight;
        self.weight[1] += grown;
        self.weight[2] += grown / passed;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash::{mix, normal_pair};

    const SIGMA: f64 = 0.007;

    fn detections(load: f64, seed: u64, count: u64) -> (u32, Option<(u64, LoadStep)>) {
        let mut detector = LoadStepDetector::new(0.84, 0.06, 3.65);
        let (mut found, mut first) = (0, None);
        for i in 0..count {
            let [a, _] = normal_pair(mix(&[seed, i]));
            let t = (0.02 * (f64::from(u32::try_from(i).unwrap()) - 99.5)).max(0.0);
            let difference = SIGMA * a + load * (1.0 - f64::exp(-t / 0.84));
            let variance = SIGMA * SIGMA;
            if let Some(jump) = detector.update(Innovation { difference, variance }, 0.02) {
                found += 1;
                if i >= 100 && first.is_none() {
                    first = Some((i, jump));
                }
            }
        }
        (found, first)
    }

    #[test]
    fn a_step_of_the_load_is_detected_within_a_fifth_of_a_second() {
        let mut delayed = 0;
        for seed in 0..50 {
            let (_, first) = detections(0.1, seed, 120);
            let seen = first.is_some_and(|(at, jump)| at <= 110 && jump.settled > 0.02);
            delayed += u32::from(!seen);
        }
        assert!(delayed <= 8, "{delayed} of 50 later");
    }

    #[test]
    fn false_alarms_in_noise_are_rare() {
        let found: u32 = (0..20).map(|seed| detections(0.0, 100 + seed, 3000).0).sum();
        // 20 minutes.
        assert!(found < 80, "{found}");
    }

    /// The ratio by its definition: a step that began half an interval before the innovation at
    /// `first` shows as `grown` at each one since.
    fn by_definition(detector: &LoadStepDetector, first: usize) -> f64 {
        let (mut with, mut power, mut left) = (0.0, 0.0, 1.0);
        for (index, seen) in detector.innovations.iter().take(first + 1).rev().enumerate() {
            left *= if index == 0 { seen.decay.sqrt() } else { seen.decay };
            let grown = 1.0 - left;
            with += grown * seen.innovation.difference / seen.innovation.variance;
            power += grown * grown / seen.innovation.variance;
        }
        let prior = detector.step_sigma * detector.step_sigma;
        0.5 * with * with / power * prior / (prior + 1.0 / power)
            - 0.5 * f64::ln(1.0 + prior * power)
    }

    #[test]
    fn the_sums_give_the_ratio_of_its_definition() {
        for gap in [1e-3, 0.02, 0.3, 40.0, 1e4] {
            // Never detected, so that the window stays.
            let mut detector = LoadStepDetector::new(0.84, 0.06, f64::INFINITY);
            for i in 0..40 {
                let [a, b] = normal_pair(mix(&[7, i]));
                let variance = SIGMA * SIGMA * (1.0 + b.abs());
                let dt = if i == 30 { gap } else { 0.02 };
                detector.update(Innovation { difference: SIGMA * a, variance }, dt);
            }
            let expected = (1..WINDOW).map(|first| by_definition(&detector, first));
            let best = expected.fold(f64::NEG_INFINITY, f64::max);
            detector.threshold = best - 1e-9;
            assert!(detector.likeliest().is_some(), "{gap}");
            detector.threshold = best + 1e-9;
            assert!(detector.likeliest().is_none(), "{gap}");
        }
    }
}
