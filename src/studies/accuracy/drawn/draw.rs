//! Random numbers of a frame, with a record of those by which figures are split.

use std::ops::Range;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;

use crate::sim::hash;

/// A recorded random parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DrawnParameter {
    /// Its name, with its unit.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Ends of the range from which it was drawn.
    pub range: (f64, f64),
}

/// The random numbers of one frame.
#[derive(Debug, Clone)]
pub struct Draw {
    random: Xoshiro256PlusPlus,
    record: Vec<DrawnParameter>,
}

impl Draw {
    /// The generator for one frame of a set; the same frame gives the same numbers.
    pub fn new(set: &str, frame: u64) -> Self {
        let mut words: Vec<u64> = set.bytes().map(u64::from).collect();
        words.push(frame);
        let random = Xoshiro256PlusPlus::seed_from_u64(hash::mix(&words));
        Self { random, record: Vec::new() }
    }

    /// A number that is uniform in its logarithm; it is recorded.
    pub fn log(&mut self, name: &'static str, range: Range<f64>) -> f64 {
        let value = self.log_unnamed(range.clone());
        self.note(name, value, range);
        value
    }

    /// As [`Self::log`], but not recorded.
    pub fn log_unnamed(&mut self, range: Range<f64>) -> f64 {
        range.start * libm::exp(self.unit() * libm::log(range.end / range.start))
    }

    /// Records a number that was not drawn by [`Self::log`].
    pub fn note(&mut self, name: &'static str, value: f64, range: Range<f64>) {
        self.record.push(DrawnParameter { name, value, range: (range.start, range.end) });
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.unit()
    }

    /// True with the probability 1/`frames`.
    pub fn one_of(&mut self, frames: f64) -> bool {
        self.unit() * frames < 1.0
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// A random seed for another generator.
    pub fn key(&mut self) -> u64 {
        StandardUniform.sample(&mut self.random)
    }

    /// The recorded parameters.
    pub fn record(self) -> Vec<DrawnParameter> {
        self.record
    }

    fn unit(&mut self) -> f64 {
        StandardUniform.sample(&mut self.random)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_in_their_logarithm() {
        let mut draw = Draw::new("test", 1);
        let n = 10_000;
        let below = (0..n).filter(|_| draw.log_unnamed(0.5..8.0) < 2.0).count();
        // Half of them, with a standard deviation of 50.
        assert!((4_800..5_200).contains(&below), "{below}");
    }
}
