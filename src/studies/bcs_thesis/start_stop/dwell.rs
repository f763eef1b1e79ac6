//! Fixed dwell times, as printers use them, and the best of them.

use rayon::prelude::*;

use super::bench::{StartStopBench, StartStopScore, StartStopStrategy};
use crate::core::Span;
use crate::extruder::start_stop::Pause;
use crate::sim::melt::MeltParameters;

/// The same dwell times at every start and every stop. Bead characterisation thesis, section
/// 1.3.4.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dwell {
    /// Time from the run command until the robot moves \[s\].
    pub start_s: f64,
    /// Time from the stop command until the end of the bead \[s\].
    pub stop_s: f64,
    /// Speed of the robot \[mm/s\].
    pub speed_mm_per_s: f64,
}

impl StartStopStrategy for Dwell {
    fn begins(&self, _: &Pause) -> (f64, impl Fn(Span) -> f64) {
        (self.start_s, |_| 1.0)
    }

    fn ends(&self) -> (f64, impl Fn(Span) -> f64) {
        (self.speed_mm_per_s * self.stop_s, |_| 1.0)
    }
}

/// Longest dwell times in the search \[s\].
const MAX_DWELL_S: [f64; 2] = [4.0, 1.5];
/// Steps of the golden-section search; each shortens the interval to 0.618 of itself.
const GOLDEN_STEPS: u32 = 8;
/// Intervals of the coarse grid.
const COARSE_STEPS: u32 = 10;
/// Alternations between searching the start time and the stop time.
const ROUNDS: u32 = 2;

/// The pair of dwell times with the least void and drool over all given pauses and seeds.
pub fn tune(
    bench: &StartStopBench,
    machine: MeltParameters,
    idle_s: &[f64],
    seeds: std::ops::Range<u64>,
) -> Dwell {
    let cost = |dwell: &Dwell| -> f64 {
        let of = |seed| bench.score_pauses(machine, seed, dwell, idle_s);
        // Collected first: the order of the sum must not depend on which seed ends first.
        let scores: Vec<Vec<StartStopScore>> = seeds.clone().into_par_iter().map(of).collect();
        scores.iter().flatten().map(StartStopScore::sum_mm3).sum()
    };
    let speed_mm_per_s = bench.laid.speed.get();
    let mut best = Dwell { start_s: 1.0, stop_s: 0.3, speed_mm_per_s };
    for _ in 0..ROUNDS {
        let [max_start_s, max_stop_s] = MAX_DWELL_S;
        best.start_s = minimise(max_start_s, |start_s| cost(&Dwell { start_s, ..best }));
        best.stop_s = minimise(max_stop_s, |stop_s| cost(&Dwell { stop_s, ..best }));
    }
    best
}

/// The minimum of a function from zero to `max`: the best point of a coarse grid, then a
/// golden-section search about it.
fn minimise(max: f64, cost: impl Fn(f64) -> f64) -> f64 {
    let step = max / f64::from(COARSE_STEPS);
    let coarse = (0..=COARSE_STEPS).map(|k| f64::from(k) * step);
    let costs = coarse.map(|at| (at, cost(at)));
    let near = costs.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |(at, _)| at);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = ((near - step).max(0.0), near + step);
    for _ in 0..GOLDEN_STEPS {
        let [left, right] = [high - golden * (high - low), low + golden * (high - low)];
        if cost(left) < cost(right) { high = right } else { low = left }
    }
    0.5 * (low + high)
}
