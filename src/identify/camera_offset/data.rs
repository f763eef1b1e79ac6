//! Widths and the speeds that may have laid them.

use super::laid_speeds::{LaidSpeeds, PowerIntegral};
use super::observation::BeadObservation;
use super::whiten::PathPosition;
use crate::core::Mm;
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Shortest path over which widths are averaged, for a short gauge \[mm\]. A choice.
const MIN_POOL_MM: f64 = 2.0;

/// Widths and the speeds that may have laid them. Widths with overlapping gauges have common
/// errors that no autoregressive process describes: what enters a gauge leaves it one length
/// later. A controller transfers them into the speed, where they would look like a response of
/// the bead one gauge behind. Widths are therefore averaged over a gauge length of path, and so
/// is the model.
#[derive(Debug, Clone)]
pub struct PooledWidths {
    /// The widths, in order.
    pub observations: Vec<BeadObservation>,
    /// Ends of the averaged groups, as indices of widths.
    pub pool_ends: Vec<usize>,
    /// Positions of the groups.
    pub positions: Vec<PathPosition>,
    /// Length of the gauge.
    pub gauge: Mm,
    /// Mean logarithm of the widths.
    pub mean: f64,
    sums: Vec<PowerIntegral>,
}

impl PooledWidths {
    /// `exponent` is approximate; it matters only where the speed changes within a gauge.
    pub fn of(course: &LaidSpeeds, looks: &[BeadObservation], exponent: f64, gauge: Mm) -> Self {
        let usual = rank::median_of(looks.iter().map(|look| look.relative_sigma)).unwrap_or(0.0);
        // Limits the weights, in case the reported standard deviations are wrong.
        let variance = |look: &BeadObservation| {
            if usual > 0.0 { (look.relative_sigma / usual).clamp(0.3, 10.0).powi(2) } else { 1.0 }
        };
        let pool_ends = ends_of_pools(looks, gauge.get().max(MIN_POOL_MM));
        let mut first = 0;
        let position = |&end: &usize| {
            let pool = &looks[std::mem::replace(&mut first, end)..end];
            let count = to_f64(pool.len());
            PathPosition {
                bead: pool[0].bead,
                path_mm: pool.iter().map(|look| look.path_mm).sum::<f64>() / count,
                variance: pool.iter().map(variance).sum::<f64>() / (count * count),
            }
        };
        let positions = pool_ends.iter().map(position).collect();
        let mean = looks.iter().map(|look| look.ln_width).sum::<f64>() / to_f64(looks.len());
        let (observations, sums) = (looks.to_vec(), course.sums(exponent));
        Self { observations, pool_ends, positions, gauge, mean, sums }
    }

    /// Logarithms of the speeds that laid each of them, at an offset \[mm\].
    pub fn ln_speeds(&self, offset_mm: f64) -> impl Iterator<Item = f64> {
        self.observations
            .iter()
            .map(move |look| self.sums[look.bead].ln_speed(look.middle_mm(offset_mm), self.gauge))
    }

    /// Means of the groups of a number for each width.
    pub fn pooled(&self, mut values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut first = 0;
        let mean = |&end: &usize| {
            let count = end - std::mem::replace(&mut first, end);
            values.by_ref().take(count).sum::<f64>() / to_f64(count)
        };
        self.pool_ends.iter().map(mean).collect()
    }
}

/// Ends of groups of a path length, as indices of widths.
fn ends_of_pools(looks: &[BeadObservation], length_mm: f64) -> Vec<usize> {
    let mut ends = Vec::new();
    let mut first = 0;
    for (number, look) in looks.iter().enumerate() {
        let begin = &looks[first];
        if look.bead != begin.bead || look.path_mm - begin.path_mm >= length_mm {
            ends.push(number);
            first = number;
        }
    }
    ends.extend((first < looks.len()).then_some(looks.len()));
    ends
}
