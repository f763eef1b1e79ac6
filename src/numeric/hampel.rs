//! Outlier removal by the Hampel filter (bcs-thesis, eqs. (1)–(4)): a sample whose distance
//! from the median of its window exceeds a number of scaled median absolute deviations is
//! replaced by that median. (The thesis calls it *mean* absolute deviation; its eq. (4) is the
//! median.)

use super::rank;

/// Largest half width of a window. A choice against a mistyped number.
const MAX_HALF_WIDTH: usize = 10_000;

/// Invalid parameters of the filter.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum HampelError {
    /// A half width out of range.
    #[error("a half width of {half_width} samples: expected 1 to {MAX_HALF_WIDTH}")]
    HalfWidth {
        /// The half width, in samples.
        half_width: usize,
    },
    /// A threshold out of range.
    #[error("a threshold of {threshold}: expected a number of standard deviations, such as 3")]
    Threshold {
        /// The threshold, in standard deviations.
        threshold: f64,
    },
}

/// The filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hampel {
    half_width: usize,
    threshold: f64,
}

/// Filtered samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Cleaned {
    /// The filtered value of each sample.
    pub values: Vec<f64>,
    /// Indices of the replaced samples.
    pub replaced: Vec<usize>,
}

impl Hampel {
    /// Window half width K in samples, threshold t in standard deviations.
    pub fn new(half_width: usize, threshold: f64) -> Result<Self, HampelError> {
        if !(1..=MAX_HALF_WIDTH).contains(&half_width) {
            return Err(HampelError::HalfWidth { half_width });
        }
        if !(threshold >= 0.0 && threshold.is_finite()) {
            return Err(HampelError::Threshold { threshold });
        }
        Ok(Self { half_width, threshold })
    }

    /// Uses K samples before and after each; windows at the ends are shorter. Samples that are
    /// not finite are outliers.
    pub fn filter(&self, samples: &[f64]) -> Cleaned {
        let mut window = Vec::with_capacity(2 * self.half_width + 1);
        let mut replaced = Vec::new();
        let mut values = Vec::with_capacity(samples.len());
        for (at, &sample) in samples.iter().enumerate() {
            let from = at.saturating_sub(self.half_width);
            let to = (at + self.half_width + 1).min(samples.len());
            let seen = samples.get(from..to).unwrap_or_default().iter().copied();
            let value = self.judge(sample, seen, &mut window);
            if value.to_bits() != sample.to_bits() {
                replaced.push(at);
            }
            values.push(value);
        }
        Cleaned { values, replaced }
    }

    /// The sample, or the median of its window. `scratch` is reused to avoid allocations.
    fn judge(&self, sample: f64, seen: impl Iterator<Item = f64>, scratch: &mut Vec<f64>) -> f64 {
        scratch.clear();
        scratch.extend(seen.filter(|value| value.is_finite()));
        let Some(middle) = rank::mean_median(scratch) else { return sample };
        for value in scratch.iter_mut() {
            *value = (*value - middle).abs();
        }
        let deviation = rank::mean_median(scratch).unwrap_or(0.0);
        let is_inlier =
            (sample - middle).abs() <= self.threshold * rank::SIGMA_PER_MEDIAN * deviation;
        if is_inlier { sample } else { middle }
    }
}

/// The filter for live use: the window is the newest 2K + 1 samples, and the last one is filtered.
/// A step of the signal passes K samples late.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveHampel {
    filter: Hampel,
    ring: Vec<f64>,
    next: usize,
    scratch: Vec<f64>,
}

impl LiveHampel {
    /// With an empty window.
    pub fn new(filter: Hampel) -> Self {
        let length = 2 * filter.half_width + 1;
        let ring = Vec::with_capacity(length);
        Self { filter, ring, next: 0, scratch: Vec::with_capacity(length) }
    }

    /// Takes a sample; returns it or the median. One that is not finite is returned as it is as
    /// long as no finite one has come.
    pub fn step(&mut self, sample: f64) -> f64 {
        let length = 2 * self.filter.half_width + 1;
        match self.ring.get_mut(self.next) {
            Some(oldest) => *oldest = sample,
            None => self.ring.push(sample),
        }
        self.next = (self.next + 1) % length;
        self.filter.judge(sample, self.ring.iter().copied(), &mut self.scratch)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test may fail")]

    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_outlier_is_replaced_by_the_median() {
        // Window of the fourth: 1, 3, 90, 2, 4 with the median 3, deviations 2, 0, 87, 1, 1:
        // scale 1.4826, so that 90 goes and its neighbours stay.
        let cleaned = Hampel::new(2, 3.0).unwrap().filter(&[2.0, 1.0, 3.0, 90.0, 2.0, 4.0, 3.0]);
        assert_eq!(cleaned.values, [2.0, 1.0, 3.0, 3.0, 2.0, 4.0, 3.0]);
        assert_eq!(cleaned.replaced, [3]);
    }

    #[test]
    fn the_threshold_counts_scaled_median_deviations() {
        // Median 0, median absolute deviation 1, mean absolute deviation 1.44.
        let at = |value: f64| [-1.0, -1.0, -1.0, 0.0, value, 0.0, 1.0, 1.0, 1.0];
        let filter = Hampel::new(4, 2.0).unwrap();
        let bound = 2.0 * 1.4826;
        assert_eq!(filter.filter(&at(bound - 1e-9)).replaced, Vec::<usize>::new());
        assert_eq!(filter.filter(&at(bound + 1e-9)).replaced, [4]);
    }

    #[test]
    fn live_it_passes_a_step_late_and_a_spike_not_at_all() {
        let mut live = LiveHampel::new(Hampel::new(2, 3.0).unwrap());
        let mut samples: Vec<f64> = [0.0, 0.1, -0.1].repeat(5);
        samples.extend([8.0, 0.1, 0.0, -0.1, 0.1]);
        let passed: Vec<f64> = samples.iter().map(|sample| live.step(*sample)).collect();
        assert!(passed.iter().all(|value| value.abs() < 0.2), "{passed:?}");
        let after: Vec<f64> = [5.0, 5.1, 4.9, 5.0].iter().map(|v| live.step(*v)).collect();
        assert!(after[0] < 1.0 && after[1] < 1.0 && after[2] > 4.0 && after[3] > 4.0, "{after:?}");
    }

    #[test]
    fn what_is_not_finite_is_an_outlier() {
        let cleaned =
            Hampel::new(2, 3.0).unwrap().filter(&[1.0, f64::NAN, 1.2, f64::INFINITY, 1.1]);
        assert!(cleaned.values.iter().all(|value| value.is_finite()), "{cleaned:?}");
        assert_eq!(cleaned.replaced, [1, 3]);
        let mut live = LiveHampel::new(Hampel::new(2, 3.0).unwrap());
        assert!(live.step(f64::NAN).is_nan());
        assert_eq!([live.step(2.0), live.step(f64::NAN)], [2.0, 2.0]);
    }

    #[test]
    fn numbers_that_make_no_filter_are_refused() {
        assert!(Hampel::new(0, 3.0).is_err());
        assert!(Hampel::new(3, f64::NAN).is_err() && Hampel::new(3, -1.0).is_err());
    }

    proptest! {
        #[test]
        fn every_value_comes_from_its_window(samples in prop::collection::vec(-1e3..1e3, 1..60)) {
            let cleaned = Hampel::new(3, 2.0).unwrap().filter(&samples);
            prop_assert_eq!(cleaned.values.len(), samples.len());
            let low = samples.iter().copied().fold(f64::INFINITY, f64::min);
            let high = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(cleaned.values.iter().all(|value| (low..=high).contains(value)));
        }
    }
}
