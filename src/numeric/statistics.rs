//! Statistics of a stream of numbers in constant memory.

use super::number::{to_count, to_f64};

/// Mean and standard deviation by the recurrence of Welford 1962.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Adds a number, if it is finite.
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.count += 1;
        let delta = value - self.mean;
        self.mean += delta / to_f64(self.count);
        self.squares += delta * (value - self.mean);
    }

    /// Number of numbers.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; `None` without numbers.
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then_some(self.mean)
    }

    /// Their sample standard deviation (n − 1); `None` with fewer than two numbers.
    pub fn std(&self) -> Option<f64> {
        (self.count > 1).then(|| (self.squares / to_f64(self.count - 1)).sqrt())
    }

    /// Their root mean square; `None` without numbers.
    pub fn rms(&self) -> Option<f64> {
        let mean = self.mean()?;
        Some((self.squares / to_f64(self.count) + mean * mean).sqrt())
    }
}

/// Mean weighted by 1/variance.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WeightedMean {
    sum: f64,
    weight: f64,
}

impl WeightedMean {
    /// Adds a number with its variance; ignored without weight.
    pub fn add(&mut self, value: f64, variance: f64) {
        let weight = 1.0 / variance;
        if value.is_finite() && weight.is_finite() && weight > 0.0 {
            self.sum += weight * value;
            self.weight += weight;
        }
    }

    /// The weighted mean; `None` without numbers.
    pub fn mean(&self) -> Option<f64> {
        (self.weight > 0.0).then(|| self.sum / self.weight)
    }

    /// Standard deviation of the mean; `None` without numbers.
    pub fn sigma(&self) -> Option<f64> {
        (self.weight > 0.0).then(|| self.weight.sqrt().recip())
    }
}

/// Buckets per factor of two. Derived: the geometric middle of a bucket is off by at most
/// 2^(1/512) − 1 = 0.14 %.
const PER_OCTAVE: usize = 256;
/// Range of exponents of two; numbers beyond it count as the smallest or the largest.
const OCTAVES: std::ops::Range<i32> = -20..24;
const BUCKETS: usize = PER_OCTAVE * 44;

/// Histogram of positive numbers in logarithmic buckets, with the exact minimum and maximum.
/// Quantiles are within 0.14 % of the true ones between 1e-6 and 1.6e7.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    counts: Vec<u64>,
    total: u64,
    least: f64,
    largest: f64,
}

impl Default for Distribution {
    fn default() -> Self {
        Self {
            counts: vec![0; BUCKETS],
            total: 0,
            least: f64::INFINITY,
            largest: f64::NEG_INFINITY,
        }
    }
}

impl Distribution {
    /// Adds a number, if it is finite; one that is not positive counts as the smallest.
    pub fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.counts[bucket(value)] += 1;
            self.total += 1;
            self.least = self.least.min(value);
            self.largest = self.largest.max(value);
        }
    }

    /// Number of numbers.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// The exact maximum; `None` without numbers.
    pub fn max(&self) -> Option<f64> {
        (self.total > 0).then_some(self.largest)
    }

    /// The smallest number that at least a fraction `q` of all do not exceed.
    pub fn quantile(&self, q: f64) -> Option<f64> {
        let mut left = (to_f64(self.total) * q.clamp(0.0, 1.0)).max(1.0);
        for (index, count) in self.counts.iter().enumerate() {
            left -= to_f64(*count);
            if left <= 0.0 && *count > 0 {
                if index == 0 {
                    return Some(self.least);
                }
                let (low, high) = bounds(index);
                return Some((low * high).sqrt().clamp(self.least, self.largest));
            }
        }
        self.max()
    }

    /// Counts merged into `per_octave` bars per factor of two, from the first to the last that
    /// is not empty: lower and upper bound and count. `per_octave` must divide 256.
    pub fn bars(&self, per_octave: usize) -> Vec<(f64, f64, u64)> {
        let step = PER_OCTAVE / per_octave.clamp(1, PER_OCTAVE);
        let bar = |(index, counts): (usize, &[u64])| {
            let (low, high) = (bounds(index * step).0, bounds((index + 1) * step).0);
            (low, high, counts.iter().sum())
        };
        let mut bars: Vec<(f64, f64, u64)> =
            self.counts.chunks(step).enumerate().map(bar).collect();
        let last = bars.iter().rposition(|bar| bar.2 > 0).map_or(0, |index| index + 1);
        bars.truncate(last);
        let first = bars.iter().position(|bar| bar.2 > 0).unwrap_or(0);
        bars.split_off(first)
    }
}

fn bucket(value: f64) -> usize {
    let octaves = value.max(f64::MIN_POSITIVE).log2() - f64::from(OCTAVES.start);
    to_count(octaves * to_f64(PER_OCTAVE)).min(BUCKETS - 1)
}

fn bounds(index: usize) -> (f64, f64) {
    let at = |index: usize| (to_f64(index) / to_f64(PER_OCTAVE) + f64::from(OCTAVES.start)).exp2();
    (at(index), at(index + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_one_to_five() {
        let mut moments = Moments::default();
        assert_eq!((moments.mean(), moments.std(), moments.rms()), (None, None, None));
        for value in [1.0, 2.0, 3.0, 4.0, 5.0, f64::NAN] {
            moments.add(value);
        }
        assert_eq!(moments.count(), 5);
        assert!((moments.mean().unwrap() - 3.0).abs() < 1e-12);
        assert!((moments.std().unwrap() - 2.5_f64.sqrt()).abs() < 1e-12);
        assert!((moments.rms().unwrap() - 11.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn quantiles_are_within_their_promise() {
        let mut distribution = Distribution::default();
        for value in 1..=1000_u32 {
            distribution.add(f64::from(value) / 100.0);
        }
        for (q, exact) in [(0.5, 5.0), (0.99, 9.9), (0.001, 0.01), (0.25, 2.5)] {
            let got = distribution.quantile(q).unwrap();
            assert!((got / exact - 1.0).abs() < 0.0014, "{q}: {got} for {exact}");
        }
        assert_eq!(distribution.max(), Some(10.0));
        assert_eq!(distribution.quantile(1.0), Some(10.0));
    }

    #[test]
    fn what_is_off_the_scale_is_still_counted() {
        let mut distribution = Distribution::default();
        assert_eq!(distribution.quantile(0.5), None);
        for value in [-1.0, 0.0, 1e300, f64::INFINITY] {
            distribution.add(value);
        }
        assert_eq!(distribution.total(), 3);
        assert_eq!(distribution.max(), Some(1e300));
        assert!(distribution.quantile(0.1).unwrap() <= 0.0);
    }

    #[test]
    fn bars_hold_every_count() {
        let mut distribution = Distribution::default();
        for value in [1.0, 1.01, 1.9, 7.9] {
            distribution.add(value);
        }
        let bars = distribution.bars(2);
        assert_eq!(bars.iter().map(|bar| bar.2).sum::<u64>(), 4);
        assert_eq!(bars.len(), 6);
        assert!((bars[0].0 - 1.0).abs() < 1e-12 && (bars[5].1 - 8.0).abs() < 1e-12);
    }
}
