//! Choice of the blur's shape for both edges: a lens's Gaussian, or with it the box of even motion
//! across the bead during the exposure.

use super::overlay::StepFit;
use crate::numeric::blurred_step::StepTable;

/// Fractions of the blur's variance that a box makes: neighbours differ by what a
/// hundred rows with a contrast of twenty times the noise just distinguish.
const BOX_FRACTIONS: [f64; 8] = [0.0, 0.3, 0.5, 0.65, 0.78, 0.87, 0.93, 0.97];
/// By how much a box must lower the sum of squared residuals, in variances of their noise. Derived:
/// a parameter that is not there lowers it by 16 with the probability P(χ²₁ > 16) = 6·10⁻⁵, once in
/// 15,000 frames.
const MIN_GAIN: f64 = 16.0;
/// Sum of squared residuals beyond that of noise, in variances of it, and blur \[px\] up to which
/// the lens's fit is near enough for other shapes to start from: longer boxes then fit better and
/// better up to the true one, and the shortest gains a third and more of what the best does.
const MAX_NEAR_EXCESS: f64 = 250.0;
const MAX_NARROW_BLUR_PX: f64 = 2.5;
const MIN_PROMISING_GAIN: f64 = 5.0;

/// Tables of blurred steps: without a box and with longer and longer ones.
#[derive(Debug, Clone)]
pub struct BlurShapes(Vec<StepTable>);

impl Default for BlurShapes {
    fn default() -> Self {
        Self(BOX_FRACTIONS.into_iter().map(StepTable::new).collect())
    }
}

impl BlurShapes {
    /// A shape by its number: 0 is a lens's blur alone, all others have a box of motion.
    pub fn table(&self, number: usize) -> &StepTable {
        &self.0[number]
    }

    /// A lens's blur alone.
    pub fn lens(&self) -> &StepTable {
        self.table(0)
    }

    /// Chooses the shape with the smallest sum of squared residuals of both edges. `looks` are the
    /// fits with a lens's blur; `again` fits both with another shape, starting from given fits or
    /// from none. Returns the number of the chosen shape and the fits with it; `None` where a
    /// lens's blur is enough.
    pub fn choose(
        &self,
        looks: [&StepFit; 2],
        again: impl Fn(&StepTable, Option<[&StepFit; 2]>) -> [Option<StepFit>; 2],
    ) -> Option<(usize, [StepFit; 2])> {
        // Where the lens's blur fits so well, no other can be clearly better.
        let excess: f64 = looks.iter().map(|fit| (fit.misfit() - 1.0) * fit.samples()).sum();
        if excess < MIN_GAIN {
            return None;
        }
        let is_narrow = looks.iter().all(|fit| fit.step.blur < MAX_NARROW_BLUR_PX);
        let is_near = is_narrow && excess < MAX_NEAR_EXCESS;
        let mut best: Option<(usize, [StepFit; 2])> = None;
        let mut gain = if is_near { MIN_PROMISING_GAIN } else { MIN_GAIN };
        for (number, table) in self.0.iter().enumerate().skip(1) {
            let before = best.as_ref().map_or(looks, |(_, [left, right])| [left, right]);
            let found = again(table, is_near.then_some(before));
            let [Some(left), Some(right)] = found else { continue };
            let fits = looks.iter().zip([&left, &right]);
            let gained = fits.map(|(lens, other)| {
                lens.samples() * (lens.misfit_of_all() - other.misfit_of_all())
            });
            let gained = gained.sum();
            if gained > gain {
                gain = gained;
                best = Some((number, [left, right]));
            } else if is_near {
                break;
            }
        }
        best.filter(|_| gain > MIN_GAIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// P(χ²₁ > g) = erfc(√(g/2)).
    #[test]
    fn a_box_that_is_not_there_gains_as_much_once_in_15_000_frames() {
        let chance = libm::erfc((0.5 * MIN_GAIN).sqrt());
        assert!((1.0 / chance / 15_000.0 - 1.0).abs() < 0.1, "{chance}");
    }
}
