//! A fit of a blurred step to an overlay: the step, the uncertainty of its blur, the residual, and
//! how far there is nothing else.

use super::HALF_SPAN;
use super::step::{BlurredStep, Clearance, NeighbourStep, NeighbourSteps};
use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::{to_count, to_f64};
use crate::vision::blur_estimate::BlurEstimate;

/// How far from the edge samples are fitted, in blurs. Derived: beyond 4.5 blurs 3·10⁻⁶ of a step
/// is left, 1 − Φ(4.5).
const FIT_BLURS: f64 = 4.5;
/// Margin beyond that \[px\]: the levels of a sharp edge need some pixels.
const FIT_MARGIN_PX: f64 = 2.0;
/// Misfit from which on an edge is no blurred step.
const MIN_NOTABLE_MISFIT: f64 = 1.3;
/// Shading that is usual close to an edge, as a standard deviation \[1/px\].
pub const SHADING_SIGMA: f64 = 0.02;
/// Steps of a fit at most.
pub const MAX_ITERATIONS: usize = 16;

/// A first fit to an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepFit {
    /// The step.
    pub step: BlurredStep,
    /// Standard deviation of its blur \[px\].
    pub blur_sd: f64,
    /// Change of the level before and after it \[1/px away from it\].
    pub(super) shading: [f64; 2],
    /// Standard deviation of a pixel, as fractions of the step.
    pub pixel_noise: f64,
    /// Standard deviation of a row's samples about the step before the fit's last move, in
    /// fractions of it.
    pub(super) noise: f64,
    /// Standard deviation after that move, where each phase has a position and levels of its own.
    pub(super) residual: f64,
    /// Number of the phases that have rows.
    pub(super) phases: f64,
    /// How far there is nothing but this edge.
    pub room: Clearance,
    /// Steps beside it that reach into its pixels.
    pub(super) flanks: NeighbourSteps,
    /// Variance that they and the blur add to its position \[px²\]; 0 without such steps.
    pub(super) added_variance: f64,
}

/// Distances from an edge between which nothing else lies \[px\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SideRange {
    /// Beyond the flank.
    pub near: usize,
    /// The end.
    pub far: usize,
}

impl StepFit {
    /// Samples beside the edge on either side.
    pub fn beside(&self) -> [SideRange; 2] {
        let near = 3.0 * self.step.blur + 1.0;
        let Clearance { before, after } = self.room;
        [(near - self.step.at, before), (near + self.step.at, after)].map(|(near, room)| {
            let far = to_count(room).min(HALF_SPAN);
            SideRange { near: to_count(near.ceil()), far }
        })
    }

    /// Its blur.
    pub fn blur(&self) -> BlurEstimate {
        BlurEstimate { px: self.step.blur, sd_px: self.blur_sd }
    }

    /// Mean square of the residuals about the edge, in variances of their noise: at
    /// least 1. Each phase has a position and levels of its own, so that they are those of the
    /// step's shape.
    pub fn misfit(&self) -> f64 {
        (self.residual / self.pixel_noise).powi(2)
    }

    /// Whether the residual is larger than noise.
    pub fn is_not_step(&self) -> bool {
        self.misfit() >= MIN_NOTABLE_MISFIT
    }

    /// The misfit of one position and levels for all phases.
    pub fn misfit_of_all(&self) -> f64 {
        (self.noise / self.pixel_noise).powi(2)
    }

    /// Number of samples about the edge that the misfit is the mean of.
    pub fn samples(&self) -> f64 {
        let reach = FIT_BLURS * self.step.blur + FIT_MARGIN_PX;
        let Clearance { before, after } = self.room;
        self.phases * (reach.min(before) + reach.min(after))
    }

    /// Ends of the samples about the edge that are fitted \[px from the path\].
    #[inline(always)]
    pub fn fitted(&self) -> (f64, f64) {
        let reach = FIT_BLURS * self.step.blur + FIT_MARGIN_PX;
        let from = (self.step.at - reach.min(self.room.before)).max(-max_sample_px());
        let to = (self.step.at + reach.min(self.room.after)).min(max_sample_px());
        (from, to)
    }

    /// Derivatives of the level at a distance from the path for the step's position
    /// and blur, its two levels and the two shadings, and the level itself,
    /// without flanks.
    #[inline(always)]
    pub fn linear_at(&self, table: &StepTable, at: f64) -> ([f64; 6], f64) {
        let Self { step: edge, shading, .. } = self;
        let per_blur = 1.0 / edge.blur;
        let z = (at - edge.at) * per_blur;
        let (step, density, slopes) = table.with_slopes(z);
        let depth = slopes.map(|level| level * edge.blur);
        let slope = (edge.after - edge.before) * density * per_blur;
        let levels = edge.before * (1.0 - step) + edge.after * step;
        let level = levels + shading[0] * depth[0] + shading[1] * depth[1];
        ([-slope, -slope * z, 1.0 - step, step, depth[0], depth[1]], level)
    }

    /// This fit up to half-way to the steps beside the edge.
    pub fn without_flanks(&self) -> Self {
        let half = |flank: &Option<NeighbourStep>, room: f64| {
            flank.as_ref().map_or(room, |flank| 0.5 * (flank.at - self.step.at).abs())
        };
        let NeighbourSteps([before, after]) = &self.flanks;
        let room = Clearance {
            before: half(before, self.room.before),
            after: half(after, self.room.after),
        };
        Self { room, flanks: NeighbourSteps::default(), added_variance: 0.0, ..*self }
    }

    /// This fit where texture makes samples more uncertain than noise does: `noise` is the standard
    /// deviation of independent samples with the same effect.
    pub fn with_texture(self, noise: f64) -> Self {
        let blur_sd = self.blur_sd * (noise / self.noise).max(1.0);
        let [of_rows, residual] = [self.noise, self.residual].map(|own| noise.max(own));
        Self { blur_sd, pixel_noise: noise, noise: of_rows, residual, ..self }
    }
}

/// Farthest position of a sample from the path \[px\].
pub fn max_sample_px() -> f64 {
    to_f64(HALF_SPAN - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives of the level about a step without shading, against differences of it: those
    /// by position and blur leave the shading out.
    #[test]
    fn derivatives_of_an_edge_are_those_of_its_level() {
        let table = StepTable::default();
        let fit = StepFit {
            step: BlurredStep { at: 0.3, blur: 1.6, before: 0.1, after: 1.2 },
            blur_sd: 0.1,
            shading: [0.0; 2],
            pixel_noise: 0.05,
            noise: 0.05,
            residual: 0.05,
            phases: 2.0,
            room: Clearance { before: 20.0, after: 20.0 },
            flanks: NeighbourSteps::default(),
            added_variance: 0.0,
        };
        let d = 0.02;
        let moved = |unknown: usize, by: f64| {
            let mut moved = fit;
            let BlurredStep { at, blur, before, after } = &mut moved.step;
            let [outer, inner] = &mut moved.shading;
            *[at, blur, before, after, outer, inner][unknown] += by;
            moved
        };
        for at in [-3.0, -0.6, 0.9, 2.8] {
            let (derivatives, _) = fit.linear_at(&table, at);
            for (unknown, expected) in derivatives.iter().enumerate() {
                let level = |by: f64| moved(unknown, by).linear_at(&table, at).1;
                let found = (level(d) - level(-d)) / (2.0 * d);
                assert!((found - expected).abs() < 5e-3, "{unknown} at {at}: {found} {expected}");
            }
        }
    }
}
