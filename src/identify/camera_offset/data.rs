//! Widths beside the speeds that may have laid them.

use super::laid_speeds::{LaidSpeeds, PowerIntegral};
use super::observation::BeadObservation;
use super::whiten::PathPosition;
use crate::core::units::Mm;
use crate::numeric::number::to_f64;
use crate::numeric::rank;

/// Shortest piece of path over which widths are taken together, under a short gauge
/// \[mm\].
const MIN_POOL_MM: f64 = 2.0;

/// Widths beside the speeds that may have laid them. Those whose gauges overlap share
/// most of what makes them scatter, in a way that no course which merely forgets itself
/// has: what enters a gauge leaves it one length later. A controller carries that on into
/// the speed, and it would look like the bead's own answer, one gauge behind. So widths
/// are taken together over a gauge's length of path, and the model's with them.
#[derive(Debug, Clone)]
pub struct PooledWidths {
    /// The widths, in order.
    pub observations: Vec<BeadObservation>,
    /// Ends of the widths that are taken together, as their numbers.
    pub pool_ends: Vec<usize>,
    /// Where those lie that are taken together.
    pub positions: Vec<PathPosition>,
    /// Length of the gauge.
    pub gauge: Mm,
    /// Mean logarithm of the widths.
    pub mean: f64,
    sums: Vec<PowerIntegral>,
}

impl PooledWidths {
    /// `exponent` is roughly known; it counts only where the speed changes within a gauge.
    pub fn of(course: &LaidSpeeds, looks: &[BeadObservation], exponent: f64, gauge: Mm) -> Self {
        let usual = median(looks.iter().map(|look| look.relative_sigma)).unwrap_or(0.0);
        // A measurement that believes in none of its widths, or in one of them blindly,
        // is not followed.
        let variance = |look: &BeadObservation| {
            if usual > 0.0 { (look.relative_sigma / usual).clamp(0.3, 10.0).powi(2) } else { 1.0 }
        };
        let ends = ends_of_pools(looks, gauge.get().max(MIN_POOL_MM));
        let mut first = 0;
        let place = |&end: &usize| {
            let pool = &looks[std::mem::replace(&mut first, end)..end];
            let count = to_f64(pool.len());
            PathPosition {
                bead: pool[0].bead,
                path_mm: pool.iter().map(|look| look.path_mm).sum::<f64>() / count,
                variance: pool.iter().map(variance).sum::<f64>() / (count * count),
            }
        };
        let places = ends.iter().map(place).collect();
        let mean = looks.iter().map(|look| look.ln_width).sum::<f64>() / to_f64(looks.len());
        Self {
            observations: looks.to_vec(),
            pool_ends: ends,
            positions: places,
            sums: course.sums(exponent),
            gauge,
            mean,
        }
    }

    /// Logarithms of the speeds that laid each of them, at an offset \[mm\].
    pub fn ln_speeds(&self, offset_mm: f64) -> impl Iterator<Item = f64> {
        self.observations
            .iter()
            .map(move |look| self.sums[look.bead].ln_speed(look.path_mm - offset_mm, self.gauge))
    }

    /// Means over the widths that are taken together, of a number for each width.
    pub fn pooled(&self, mut values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut first = 0;
        let mean = |&end: &usize| {
            let count = end - std::mem::replace(&mut first, end);
            values.by_ref().take(count).sum::<f64>() / to_f64(count)
        };
        self.pool_ends.iter().map(mean).collect()
    }
}

/// Where pieces of path of a length end, as numbers of widths.
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

/// The middle one of some numbers; `None` without any.
pub fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    rank::median(&mut values.collect::<Vec<_>>())
}
