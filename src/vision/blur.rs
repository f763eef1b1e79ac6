//! Blur of an edge from all calipers together. The profiles are superimposed in bins of half a
//! pixel, and a step of free blur is fitted.

use crate::numeric::number::{to_count, to_f64};
use nalgebra::{Matrix5, Vector5};

use super::fit::ShadedStep;
use crate::numeric::blurred_step::StepTable;

/// Bins of half a pixel. Derived: 2 · 2 · 40 + 1 for ±40 px, more than the longest half window.
const BINS: usize = 161;
const CENTRE_BIN: usize = BINS / 2;
/// Gauss–Newton steps at most: more cost time on profiles that show no edge.
const MAX_STEPS: usize = 30;
/// Smallest blur that is fitted. Derived: a sharp edge that is integrated over pixels and
/// half-pixel bins has √(1/12 + 1/48) = 0.32 px; a little more keeps the fit away from it.
const MIN_BLUR_PX: f64 = 0.35;
/// Largest blur that is fitted \[px\]: a wider flank fills the window.
const MAX_BLUR_PX: f64 = 15.0;
/// Largest distance of the common edge from the approximate positions \[px\]: farther away lies
/// another edge.
const MAX_OFFSET_PX: f64 = 8.0;

/// Profiles superimposed about their edges.
#[derive(Debug, Clone)]
pub struct BinnedProfile {
    sums: [f64; BINS],
    counts: [f64; BINS],
}

impl Default for BinnedProfile {
    fn default() -> Self {
        Self { sums: [0.0; BINS], counts: [0.0; BINS] }
    }
}

impl BinnedProfile {
    /// Adds a sample at a distance from its edge \[px\]; one beyond the bins is left out.
    pub fn add(&mut self, distance_px: f64, grey: f64) {
        let bin = (2.0 * distance_px).round() + to_f64(CENTRE_BIN);
        if bin >= 0.0 && bin < to_f64(BINS) {
            self.sums[to_count(bin)] += grey;
            self.counts[to_count(bin)] += 1.0;
        }
    }

    /// Blur of the edge \[px\]; `None` where no step can be fitted. The bead's
    /// shading is fitted beside it, or it would pass for blur.
    pub fn fit(&self, table: &StepTable, bead_after: bool) -> Option<f64> {
        let (mut at, mut blur, mut shading) = (0.0, 2.0, 0.0);
        let (mut ground, mut height) = self.levels()?;
        for _ in 0..MAX_STEPS {
            let mut matrix = Matrix5::<f64>::zeros();
            let mut slope = Vector5::<f64>::zeros();
            for (distance, grey, weight) in self.samples() {
                let model = ShadedStep::at(table, distance - at, blur, bead_after);
                let by_position = -height * model.density - shading * model.depth_slope;
                let by_blur = -height * model.density * (distance - at) / blur
                    + shading * model.density * blur;
                let row = Vector5::new(by_position, 1.0, model.step, by_blur, model.depth);
                let miss = grey - ground - height * model.step - shading * model.depth;
                matrix.ger(weight, &row, &row, 1.0);
                slope += row * (weight * miss);
            }
            // A little damping keeps the first steps of a soft edge in bounds.
            for k in 0..5 {
                matrix[(k, k)] *= 1.0 + 1e-3;
            }
            let step = matrix.cholesky()?.solve(&slope);
            at += step[0].clamp(-1.0, 1.0);
            ground += step[1];
            height += step[2];
            blur = (blur + step[3].clamp(-0.5 * blur, 0.5 * blur)).clamp(MIN_BLUR_PX, MAX_BLUR_PX);
            shading += step[4];
            if step[0].abs() < 1e-4 && step[3].abs() < 1e-4 {
                break;
            }
        }
        (at.abs() < MAX_OFFSET_PX).then_some(blur)
    }

    fn samples(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        (0..BINS).filter(|&k| self.counts[k] > 0.0).map(|k| {
            let distance = (to_f64(k) - to_f64(CENTRE_BIN)) / 2.0;
            (distance, self.sums[k] / self.counts[k], self.counts[k])
        })
    }

    /// Rough levels before and after the edge: the outermost bins.
    fn levels(&self) -> Option<(f64, f64)> {
        let first = self.samples().next()?;
        let last = self.samples().last()?;
        (first.0 < last.0).then_some((first.1, last.1 - first.1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blur_comes_back() {
        let table = StepTable::default();
        for blur in [0.8, 1.5, 3.0, 6.0] {
            let mut overlay = BinnedProfile::default();
            let half = if blur > 2.0 { 20 } else { 8 };
            for caliper in 0..40 {
                let at = 0.37 * f64::from(caliper);
                for k in -half..=half {
                    let u = at.round() + f64::from(k);
                    overlay.add(u - at, 30.0 + 90.0 * table.at((u - at) / blur).0);
                }
            }
            let found = overlay.fit(&table, true).unwrap();
            assert!((found / blur - 1.0).abs() < 0.05, "{blur} came back as {found}");
        }
    }

    #[test]
    fn nothing_has_no_blur() {
        assert_eq!(BinnedProfile::default().fit(&StepTable::default(), true), None);
    }
}
