//! Linearisation of a blurred step about an estimate: normal equations of its position, blur,
//! levels and shading, and the misfit after a step of the fit.

use nalgebra::SVector;

use super::look::StepFit;
use super::{PHASES, StepFitter};
use crate::numeric::normal_equations::NormalEquations;
use crate::numeric::number::to_f64;

/// Unknowns. By definition position and blur of the step, its two levels, and the shading before
/// and after it.
const UNKNOWNS: usize = 6;
/// Unknowns that each phase has of its own. By definition position and levels: rows were placed by
/// a path and levels with a noise of their own, and which phase a row is in comes from the path.
const PHASE_UNKNOWNS: [usize; 3] = [0, 2, 3];

/// The equations about a step.
pub struct LinearisedStep {
    phases: [NormalEquations<UNKNOWNS>; PHASES],
    /// Weighted sum of the squared residuals.
    sum_of_squares: f64,
    /// Number of samples, and of the phases that have some.
    samples: f64,
    used: f64,
}

impl LinearisedStep {
    /// Normal equations of all phases together.
    #[inline(always)]
    pub fn normal(&self) -> NormalEquations<UNKNOWNS> {
        let [first, second] = &self.phases;
        first.plus(second)
    }

    /// Mean squared residual, for a sample of weight 1.
    #[inline(always)]
    pub fn mean_square(&self) -> f64 {
        self.sum_of_squares / (self.samples - to_f64(UNKNOWNS)).max(1.0)
    }

    /// Mean squared residual after a step of the fit, with a position and levels for each phase.
    #[inline(always)]
    pub fn within_phases_after(&self, step: &SVector<f64, UNKNOWNS>) -> f64 {
        let lowered: f64 = self.phases.iter().map(|phase| phase.decrease_after(step)).sum();
        let mut left = self.sum_of_squares - lowered;
        let mut freedom = self.samples - to_f64(UNKNOWNS);
        if self.used > 1.0 {
            let of_phases =
                self.phases.iter().map(|phase| phase.after(step).of_unknowns(PHASE_UNKNOWNS));
            left -= of_phases.map(|phase| phase.max_decrease()).sum::<f64>();
            freedom -= to_f64(PHASE_UNKNOWNS.len());
        }
        left.max(0.0) / freedom.max(1.0)
    }
}

impl StepFitter<'_> {
    /// The equations about the step of a fit, without flanks.
    #[inline(always)]
    pub fn linearise(&self, fit: &StepFit) -> LinearisedStep {
        let phases = std::array::from_fn(|_| NormalEquations::default());
        let mut linear = LinearisedStep { phases, sum_of_squares: 0.0, samples: 0.0, used: 0.0 };
        self.each_sample(fit, |phase, sample| {
            let weighted = sample.weight * sample.miss * sample.miss;
            linear.sum_of_squares += weighted;
            linear.samples += 1.0;
            linear.phases[phase].add(sample.row, sample.miss, sample.weight);
        });
        linear.used = to_f64(self.overlay.means().count());
        linear
    }

    /// Every sample about the step of a fit, with the number of its phase among those that
    /// have rows.
    #[inline(always)]
    pub fn each_sample(&self, fit: &StepFit, mut add: impl FnMut(usize, LinearSample)) {
        let (from, to) = fit.fitted();
        for (phase, mean) in self.overlay.means().enumerate() {
            for (at, value) in mean.samples(from, to) {
                let (row, level) = fit.linear_at(self.table, at);
                add(phase, LinearSample { at, row, miss: value - level, weight: mean.rows.into() });
            }
        }
    }
}

/// A sample about a step.
pub struct LinearSample {
    /// Its distance from the path \[px\].
    pub at: f64,
    /// Its derivatives by the unknowns.
    pub row: [f64; UNKNOWNS],
    /// Its residual.
    pub miss: f64,
    /// Its weight.
    pub weight: f64,
}
