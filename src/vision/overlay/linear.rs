//! What a blurred step leaves of an overlay's means, linear about the step: the normal
//! equations of its place, blur, levels and shading, and the misfit after a step of the fit.

use nalgebra::SVector;

use super::look::Look;
use super::{Overlay, PHASES};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::normal_equations::Normal;
use crate::numeric::number::float;

/// Place and blur of the step, its two levels, and the shading before and after it.
const UNKNOWNS: usize = 6;
/// Unknowns that each phase has of its own: place and levels. Rows were laid down by a path
/// and levels with a noise of their own, and which phase a row is in comes from the path.
const OF_PHASE: [usize; 3] = [0, 2, 3];

/// The equations about a step.
pub struct Linear {
    phases: [Normal<UNKNOWNS>; PHASES],
    /// Sum of the squared misses, of samples of weight 1.
    square: f64,
    /// Number of samples, and of the phases that have some.
    samples: f64,
    used: f64,
}

impl Linear {
    /// Those of all phases together.
    #[inline(always)]
    pub fn normal(&self) -> Normal<UNKNOWNS> {
        let [first, second] = &self.phases;
        first.plus(second)
    }

    /// Mean square of what is left, for a sample of weight 1.
    #[inline(always)]
    pub fn mean_square(&self) -> f64 {
        self.square / (self.samples - float(UNKNOWNS)).max(1.0)
    }

    /// The same after a step of the fit, where each phase has a place and levels of its own.
    #[inline(always)]
    pub fn within_phases_after(&self, step: &SVector<f64, UNKNOWNS>) -> f64 {
        let lowered: f64 = self.phases.iter().map(|phase| phase.lowered_by(step)).sum();
        let mut left = self.square - lowered;
        let mut freedom = self.samples - float(UNKNOWNS);
        if self.used > 1.0 {
            let of_phases = self.phases.iter().map(|phase| phase.after(step).part(OF_PHASE));
            left -= of_phases.map(|phase| phase.lowers()).sum::<f64>();
            freedom -= float(OF_PHASE.len());
        }
        left.max(0.0) / freedom.max(1.0)
    }
}

impl Overlay {
    /// The equations about the step of a look, without flanks.
    #[inline(always)]
    pub(super) fn linearise(&self, table: &StepTable, look: &Look) -> Linear {
        let (from, to) = look.fitted();
        let phases = std::array::from_fn(|_| Normal::default());
        let mut linear = Linear { phases, square: 0.0, samples: 0.0, used: 0.0 };
        for (normal, mean) in linear.phases.iter_mut().zip(self.means()) {
            for (at, value) in mean.samples(from, to) {
                let (row, level) = look.linear_at(table, at);
                let miss = value - level;
                linear.square += mean.weight * miss * miss;
                linear.samples += 1.0;
                normal.add(row, miss, mean.weight);
            }
            linear.used += 1.0;
        }
        linear
    }
}
