//! A flow that drifts along the path: a random walk of its logarithm.

use super::hash;
use crate::numeric::number::to_count;

/// Distance between the nodes of the random walk \[mm\], linear in between: less than half a
/// gauge.
const NODE_MM: f64 = 5.0;
/// Random stream of the walk. Derived: the bytes of "wander".
const DRIFT_STREAM: u64 = 0x0077_616e_6465_7200;

/// The random walk of one bead, a function of seed and position. Nodes are computed when needed
/// and cached.
#[derive(Debug, Clone)]
pub struct FlowDrift {
    /// Standard deviation of a step from node to node.
    step: f64,
    seed: u64,
    nodes: Vec<f64>,
}

impl FlowDrift {
    /// A walk whose standard deviation over a metre is `per_root_m`, relative to the width.
    pub fn new(per_root_m: f64, seed: u64) -> Self {
        Self { step: per_root_m * (NODE_MM / 1000.0).sqrt(), seed, nodes: vec![0.0] }
    }

    /// Ratio of the width at a position to the width without the walk; 1 before the start.
    pub fn at(&mut self, path_mm: f64) -> f64 {
        if self.step <= 0.0 || path_mm <= 0.0 {
            return 1.0;
        }
        let position = path_mm / NODE_MM;
        let node = to_count(position);
        while self.nodes.len() < node + 2 {
            let number = self.nodes.len() as u64;
            let [step, _] = hash::normal_pair(hash::mix(&[self.seed, DRIFT_STREAM, number]));
            let last = self.nodes.last().copied().unwrap_or(0.0);
            self.nodes.push(last + self.step * step);
        }
        let (before, after) = (self.nodes[node], self.nodes[node + 1]);
        libm::exp(before + (after - before) * position.fract())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_standard_deviation_is_the_given_one_whatever_is_asked_first() {
        let far: Vec<f64> =
            (0..400).map(|seed| FlowDrift::new(0.01, seed).at(4000.0).ln()).collect();
        let size = (far.iter().map(|x| x * x).sum::<f64>() / 400.0).sqrt();
        // The relative standard error of a standard deviation from 400 numbers is 3.5 %.
        assert!((size / 0.02 - 1.0).abs() < 0.14, "{size}");
        let mut walk = FlowDrift::new(0.01, 3);
        let first = walk.at(300.0);
        let _ = walk.at(4000.0);
        assert_eq!(walk.at(300.0), first);
        assert_eq!(FlowDrift::new(0.0, 3).at(4000.0), 1.0);
    }
}
