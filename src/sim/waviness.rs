//! The waviness of a bead's two edges: a stationary Gaussian process along the
//! path, a function of seed and position alone.

use std::collections::VecDeque;
use std::f64::consts::PI;

use super::hash;
use crate::scenario::bead::EdgeRoughness;

/// Nodes of white noise within one correlation length L. Derived: a Gaussian kernel sampled at
/// L/3 has a variance that is constant between nodes to 10⁻⁹.
const NODES_PER_LENGTH: f64 = 3.0;
/// Nodes on either side that contribute. Derived: the kernel exp(−2(7/3)²) is 2·10⁻⁵.
const KERNEL_REACH_NODES: i64 = 7;

/// Deviations of both edges along the path: white noise on a grid, hashed from the seed and the
/// node's number, and smoothed by a Gaussian. The autocorrelation is exp(−(distance/length)²).
#[derive(Debug, Clone)]
pub struct Waviness {
    size_mm: f64,
    spacing_mm: f64,
    seed: u64,
    /// The last used nodes; a cache that changes no result.
    nodes: VecDeque<[f64; 2]>,
    first: i64,
}

impl Waviness {
    /// Each edge has half the variance of the width.
    pub fn new(roughness: EdgeRoughness, seed: u64) -> Self {
        let sum_of_squares = PI.sqrt() / 2.0 * NODES_PER_LENGTH;
        Self {
            size_mm: roughness.sigma_mm / (2.0 * sum_of_squares).sqrt(),
            spacing_mm: roughness.length_mm.max(1e-3) / NODES_PER_LENGTH,
            seed,
            nodes: VecDeque::new(),
            first: 0,
        }
    }

    /// Deviations of the left and the right edge at a path length \[mm\].
    pub fn at(&mut self, path_mm: f64) -> [f64; 2] {
        if self.size_mm == 0.0 {
            return [0.0; 2];
        }
        let position = path_mm / self.spacing_mm;
        #[expect(clippy::cast_possible_truncation, reason = "saturates far beyond any path")]
        let middle = position.round() as i64;
        self.reach_for(middle);
        let mut sum = [0.0; 2];
        for (node, number) in self.nodes.iter().zip(self.first..) {
            #[expect(clippy::cast_precision_loss, reason = "node numbers stay below 2^53")]
            let away = (position - number as f64) / NODES_PER_LENGTH;
            let weight = libm::exp(-2.0 * away * away);
            sum[0] += weight * node[0];
            sum[1] += weight * node[1];
        }
        sum.map(|deviation| deviation * self.size_mm)
    }

    /// Fills the cache with the nodes around `middle`.
    fn reach_for(&mut self, middle: i64) {
        let wanted = middle.saturating_sub(KERNEL_REACH_NODES);
        let count = 2 * KERNEL_REACH_NODES + 1;
        let shift = wanted.saturating_sub(self.first);
        let kept = i64::try_from(self.nodes.len()).unwrap_or(0).saturating_sub(shift);
        if shift < 0 || kept <= 0 {
            self.nodes.clear();
        } else {
            for _ in 0..shift {
                self.nodes.pop_front();
            }
        }
        self.first = wanted;
        let have = i64::try_from(self.nodes.len()).unwrap_or(count);
        for number in have..count {
            let key = hash::mix(&[self.seed, wanted.saturating_add(number).cast_unsigned()]);
            self.nodes.push_back(hash::normal_pair(key));
        }
    }
}
