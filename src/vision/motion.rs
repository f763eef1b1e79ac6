//! Which blur both edges have: a lens's Gaussian, or with it the box of even motion
//! across the bead while the shutter is open.

use super::overlay::StepFit;
use crate::numeric::blurred_step::StepTable;

/// Fractions of the blur's variance that a box makes: neighbours differ by what a
/// hundred rows with a contrast of twenty times the noise just tell apart.
const BOX_FRACTIONS: [f64; 8] = [0.0, 0.3, 0.5, 0.65, 0.78, 0.87, 0.93, 0.97];
/// By how much a box must lower the sum of squared residuals, in variances of their
/// noise: a parameter that is not there lowers it by 16 once in 15,000 frames.
const MIN_GAIN: f64 = 16.0;
/// The same beyond that of noise, and the blur \[px\], up to which the lens's blur fits well
/// enough for other shapes to go on from: up to the box that is there each then fits better
/// than the one before, and the shortest lowers the sum by a third and more of what the best
/// does.
const MAX_NEAR_EXCESS: f64 = 250.0;
const MAX_NARROW_BLUR_PX: f64 = 2.5;
const MIN_PROMISING_GAIN: f64 = 5.0;

/// Tables of blurred steps: without a box and with longer and longer ones.
#[derive(Debug, Clone)]
pub struct BlurShapes {
    tables: Vec<StepTable>,
    chosen: usize,
}

impl Default for BlurShapes {
    fn default() -> Self {
        let tables = BOX_FRACTIONS.into_iter().map(StepTable::new).collect();
        Self { tables, chosen: 0 }
    }
}

impl BlurShapes {
    /// The shape that was chosen last.
    pub fn table(&self) -> &StepTable {
        &self.tables[self.chosen]
    }

    /// A lens's blur alone.
    pub fn lens(&self) -> &StepTable {
        &self.tables[0]
    }

    /// Whether it has the box of a motion.
    pub fn is_motion(&self) -> bool {
        self.chosen > 0
    }

    /// Goes back to a lens's blur.
    pub fn reset(&mut self) {
        self.chosen = 0;
    }

    /// Chooses the shape that leaves least of both edges. `looks` are those with a
    /// lens's blur, `again` looks with another shape at both, from such looks on or from
    /// nothing. Returns the looks with the shape that was chosen, where it is another one.
    pub fn choose(
        &mut self,
        looks: [&StepFit; 2],
        again: impl Fn(&StepTable, Option<[&StepFit; 2]>) -> [Option<StepFit>; 2],
    ) -> Option<[StepFit; 2]> {
        self.chosen = 0;
        // Where the lens's blur fits so well, no other can be clearly better.
        let excess: f64 = looks.iter().map(|look| (look.misfit() - 1.0) * look.samples()).sum();
        if excess < MIN_GAIN {
            return None;
        }
        let is_narrow = looks.iter().all(|look| look.step.blur < MAX_NARROW_BLUR_PX);
        let is_near = is_narrow && excess < MAX_NEAR_EXCESS;
        let mut best: Option<(usize, [StepFit; 2])> = None;
        let mut gain = if is_near { MIN_PROMISING_GAIN } else { MIN_GAIN };
        for (number, table) in self.tables.iter().enumerate().skip(1) {
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
        best.filter(|_| gain > MIN_GAIN).map(|(number, looks)| {
            self.chosen = number;
            looks
        })
    }
}
