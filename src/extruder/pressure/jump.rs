//! Whether the load has just stepped: the likelihood ratio of the last
//! innovations with a step that began at any of them to none (Willsky and
//! Jones 1976), with a prior for the step's size.

use super::belief::Innovation;

/// Innovations that are looked back over.
const WINDOW: usize = 16;

/// A step of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Its size once settled \[MPa\].
    pub settled: f64,
    /// Share of it that shows by now.
    pub grown: f64,
    /// Variance of its size \[MPa²\].
    pub variance: f64,
}

/// The last innovations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    lag_s: f64,
    load: f64,
    evidence: f64,
    /// The newest first.
    seen: [Seen; WINDOW],
    count: usize,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Seen {
    innovation: Innovation,
    /// Share that is left of the time since the one before, in lags.
    kept: f64,
}

const NOTHING: Seen = Seen { innovation: Innovation { difference: 0.0, variance: 1.0 }, kept: 1.0 };

impl Watch {
    /// For a lag \[s\], steps of this standard deviation \[MPa\], and the
    /// logarithm of the ratio from which on one is taken for real.
    pub fn new(lag_s: f64, load: f64, evidence: f64) -> Self {
        Self { lag_s, load, evidence, seen: [NOTHING; WINDOW], count: 0 }
    }

    /// Takes an innovation, `dt_s` after the last, and tells of a step. After
    /// one it begins anew.
    pub fn see(&mut self, innovation: Innovation, dt_s: f64) -> Option<Jump> {
        self.seen.rotate_right(1);
        self.seen[0] = Seen { innovation, kept: libm::exp(-dt_s / self.lag_s) };
        self.count = (self.count + 1).min(WINDOW);
        let jump = self.likeliest();
        if jump.is_some() {
            self.count = 0;
        }
        jump
    }

    fn likeliest(&self) -> Option<Jump> {
        let mut best = (self.evidence, None);
        for first in 1..self.count {
            let (ratio, jump) = self.of_step_at(first);
            if ratio > best.0 {
                best = (ratio, Some(jump));
            }
        }
        best.1
    }

    /// A step that began half an interval before the innovation at `first`.
    fn of_step_at(&self, first: usize) -> (f64, Jump) {
        let (mut with, mut power, mut left) = (0.0, 0.0, 1.0);
        for (index, seen) in self.seen.iter().take(first + 1).rev().enumerate() {
            left *= if index == 0 { seen.kept.sqrt() } else { seen.kept };
            let grown = 1.0 - left;
            with += grown * seen.innovation.difference / seen.innovation.variance;
            power += grown * grown / seen.innovation.variance;
        }
        if power <= 0.0 {
            let settled = 0.0;
            return (f64::NEG_INFINITY, Jump { settled, grown: 0.0, variance: 0.0 });
        }
        let prior = self.load * self.load;
        let share = prior / (prior + 1.0 / power);
        let ratio = 0.5 * with * with / power * share - 0.5 * libm::log(1.0 + prior * power);
        let settled = share * with / power;
        (ratio, Jump { settled, grown: 1.0 - left, variance: share / power })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::hash::{mix, normal_pair};

    const SIGMA: f64 = 0.007;

    fn watch(load: f64, seed: u64, count: u64) -> (u32, Option<(u64, Jump)>) {
        let mut watch = Watch::new(0.84, 0.06, 3.65);
        let (mut found, mut first) = (0, None);
        for i in 0..count {
            let [a, _] = normal_pair(mix(&[seed, i]));
            let t = (0.02 * (f64::from(u32::try_from(i).unwrap()) - 99.5)).max(0.0);
            let difference = SIGMA * a + load * (1.0 - f64::exp(-t / 0.84));
            let variance = SIGMA * SIGMA;
            if let Some(jump) = watch.see(Innovation { difference, variance }, 0.02) {
                found += 1;
                if i >= 100 && first.is_none() {
                    first = Some((i, jump));
                }
            }
        }
        (found, first)
    }

    #[test]
    fn a_step_of_the_load_is_seen_within_a_fifth_of_a_second() {
        let mut late = 0;
        for seed in 0..50 {
            let (_, first) = watch(0.1, seed, 120);
            let seen = first.is_some_and(|(at, jump)| at <= 110 && jump.settled > 0.02);
            late += u32::from(!seen);
        }
        assert!(late <= 8, "{late} of 50 later");
    }

    #[test]
    fn noise_alone_is_seldom_taken_for_a_step() {
        let found: u32 = (0..20).map(|seed| watch(0.0, 100 + seed, 3000).0).sum();
        // 20 minutes.
        assert!(found < 80, "{found}");
    }
}
