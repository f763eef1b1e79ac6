//! Widths beside the speeds that may have laid them.

use super::course::{Course, Sums};
use super::observation::Look;
use super::whiten::Place;
use crate::core::units::Mm;
use crate::numeric::number::float;
use crate::numeric::rank;

/// Shortest piece of path over which widths are taken together, under a short gauge
/// \[mm\].
const SHORTEST_POOL_MM: f64 = 2.0;

/// Widths beside the speeds that may have laid them. Those whose gauges overlap share
/// most of what makes them scatter, in a way that no course which merely forgets itself
/// has: what enters a gauge leaves it one length later. A controller carries that on into
/// the speed, and it would look like the bead's own answer, one gauge behind. So widths
/// are taken together over a gauge's length of path, and the model's with them.
#[derive(Debug, Clone)]
pub struct Data {
    /// The widths, in order.
    pub looks: Vec<Look>,
    /// Ends of the widths that are taken together, as their numbers.
    pub ends: Vec<usize>,
    /// Where those lie that are taken together.
    pub places: Vec<Place>,
    /// Length of the gauge.
    pub gauge: Mm,
    /// Mean logarithm of the widths.
    pub mean: f64,
    sums: Vec<Sums>,
}

impl Data {
    /// `exponent` is roughly known; it counts only where the speed changes within a gauge.
    pub fn of(course: &Course, looks: &[Look], exponent: f64, gauge: Mm) -> Self {
        let usual = median(looks.iter().map(|look| look.share)).unwrap_or(0.0);
        // A measurement that believes in none of its widths, or in one of them blindly,
        // is not followed.
        let variance = |look: &Look| {
            if usual > 0.0 { (look.share / usual).clamp(0.3, 10.0).powi(2) } else { 1.0 }
        };
        let ends = ends_of_pools(looks, gauge.get().max(SHORTEST_POOL_MM));
        let mut first = 0;
        let place = |&end: &usize| {
            let pool = &looks[std::mem::replace(&mut first, end)..end];
            let count = float(pool.len());
            Place {
                bead: pool[0].bead,
                path_mm: pool.iter().map(|look| look.path_mm).sum::<f64>() / count,
                variance: pool.iter().map(variance).sum::<f64>() / (count * count),
            }
        };
        let places = ends.iter().map(place).collect();
        let mean = looks.iter().map(|look| look.ln_width).sum::<f64>() / float(looks.len());
        Self { looks: looks.to_vec(), ends, places, sums: course.sums(exponent), gauge, mean }
    }

    /// Logarithms of the speeds that laid each of them, at an offset \[mm\].
    pub fn ln_speeds(&self, offset_mm: f64) -> impl Iterator<Item = f64> {
        self.looks
            .iter()
            .map(move |look| self.sums[look.bead].ln_speed(look.path_mm - offset_mm, self.gauge))
    }

    /// Means over the widths that are taken together, of a number for each width.
    pub fn pooled(&self, mut values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut first = 0;
        let mean = |&end: &usize| {
            let count = end - std::mem::replace(&mut first, end);
            values.by_ref().take(count).sum::<f64>() / float(count)
        };
        self.ends.iter().map(mean).collect()
    }
}

/// Where pieces of path of a length end, as numbers of widths.
fn ends_of_pools(looks: &[Look], length_mm: f64) -> Vec<usize> {
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
