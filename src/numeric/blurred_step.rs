//! Table of a blurred step, the model of an edge in a profile: a step blurred by a Gaussian
//! (defocus) and by a box (uniform motion during the exposure). Positions are in standard
//! deviations of the total blur.

use super::number::{to_count, to_f64};

/// Half length of the table in standard deviations. Derived: beyond it the step differs from
/// its end by Φ(−6) = 1e-9.
const TABLE_HALF_RANGE_SD: f64 = 6.0;
/// Entries per standard deviation. Derived: linear interpolation errs by at most max|φ'|·h²/8 =
/// 0.242/(8·64²) = 7e-6.
const ENTRIES_PER_SD: f64 = 64.0;
/// Fraction of the variance below which a box is ignored. A choice: the formula of the box
/// divides by its length.
const MIN_BOX_FRACTION: f64 = 1e-6;

/// A blurred step at a position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    /// Value of the unit step.
    fraction: f64,
    /// Its slope.
    density: f64,
    /// Integral of the step up to this position, less z times the step.
    tail: f64,
}

/// A blurred step by interpolation, to about 1e-5.
#[derive(Debug, Clone)]
pub struct StepTable {
    entries: Vec<Entry>,
}

impl Default for StepTable {
    /// Blurred by a Gaussian alone.
    fn default() -> Self {
        Self::new(0.0)
    }
}

impl StepTable {
    /// For a blur of which a box makes a fraction of the variance, from 0 to below 1.
    pub fn new(box_fraction: f64) -> Self {
        let count = to_count(2.0 * TABLE_HALF_RANGE_SD * ENTRIES_PER_SD) + 2;
        let position = |k: usize| to_f64(k) / ENTRIES_PER_SD - TABLE_HALF_RANGE_SD;
        let entries = (0..count).map(|k| Entry::of(position(k), box_fraction)).collect();
        Self { entries }
    }

    /// Value of the unit step and its slope.
    #[inline]
    pub fn at(&self, z: f64) -> (f64, f64) {
        let entry = self.entry(z);
        (entry.fraction, entry.density)
    }

    /// Value of the unit step, its slope, and two blurred ramps that begin at the step: one
    /// that falls towards it and one that rises after it.
    #[inline]
    pub fn with_slopes(&self, z: f64) -> (f64, f64, [f64; 2]) {
        let Entry { fraction: share, density, tail } = self.entry(z);
        (share, density, [tail - z * (1.0 - share), tail + z * share])
    }

    #[inline]
    fn entry(&self, z: f64) -> Entry {
        let position = (z + TABLE_HALF_RANGE_SD) * ENTRIES_PER_SD;
        if position <= 0.0 {
            return Entry { fraction: 0.0, density: 0.0, tail: 0.0 };
        }
        let index = to_count(position);
        let (Some(low), Some(high)) = (self.entries.get(index), self.entries.get(index + 1)) else {
            return Entry { fraction: 1.0, density: 0.0, tail: 0.0 };
        };
        let part = position - to_f64(index);
        let between = |low: f64, high: f64| low + part * (high - low);
        Entry {
            fraction: between(low.fraction, high.fraction),
            density: between(low.density, high.density),
            tail: between(low.tail, high.tail),
        }
    }
}

impl Entry {
    fn of(z: f64, box_fraction: f64) -> Self {
        if box_fraction < MIN_BOX_FRACTION {
            let (share, density) = gaussian(z);
            return Self { fraction: share, density, tail: density };
        }
        // First and second integrals of Φ between the ends of the box.
        let sd = (1.0 - box_fraction).sqrt();
        let length = (12.0 * box_fraction).sqrt();
        let [far, near] = [z + 0.5 * length, z - 0.5 * length].map(|end| {
            let u = end / sd;
            let (share, density) = gaussian(u);
            let once = u * share + density;
            let twice = 0.5 * ((u * u + 1.0) * share + u * density);
            [share, sd * once, sd * sd * twice]
        });
        let [density, share, integral] = [0, 1, 2].map(|k| (far[k] - near[k]) / length);
        Self { fraction: share, density, tail: integral - z * share }
    }
}

fn gaussian(z: f64) -> (f64, f64) {
    let step = 0.5 * (1.0 + libm::erf(z * std::f64::consts::FRAC_1_SQRT_2));
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    (step, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_function() {
        let table = StepTable::default();
        for k in -800..800 {
            let z = f64::from(k) * 0.0101;
            let (step, density) = table.at(z);
            let (true_step, true_density) = gaussian(z);
            assert!((step - true_step).abs() < 2e-5 && (density - true_density).abs() < 2e-5);
        }
    }

    #[test]
    fn a_box_leaves_a_ramp_of_its_length_and_a_variance_of_1() {
        for fraction in [0.3, 0.8, 0.99] {
            let table = StepTable::new(fraction);
            let (mut sum, mut square, mut integral) = (0.0, 0.0, 0.0);
            for k in -6000..6000 {
                let z = (f64::from(k) + 0.5) / 1000.0;
                let (share, density, [falling, rising]) = table.with_slopes(z);
                sum += density / 1000.0;
                square += z * z * density / 1000.0;
                integral += share / 1000.0;
                let upper = integral - share / 2000.0;
                assert!((rising - upper).abs() < 1e-3, "{fraction} {z}: {rising} {upper}");
                assert!((rising - falling - z).abs() < 1e-9);
            }
            assert!((sum - 1.0).abs() < 1e-4 && (square - 1.0).abs() < 1e-3, "{sum} {square}");
            let ramp = 1.0 / (12.0 * fraction).sqrt();
            let (half, density) = table.at(0.0);
            assert!((half - 0.5).abs() < 1e-9 && density < 1.02 * ramp, "{density} {ramp}");
        }
    }
}
