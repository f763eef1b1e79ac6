//! Least-squares fits of a blurred step to an overlay.

use super::StepFitter;
use super::look::{MAX_ITERATIONS, SHADING_SIGMA, StepFit};
use super::slopes::{ProfileSlopes, SlopeLimits};
use super::step::{BlurredStep, Clearance, MIN_BLUR_PX, NeighbourSteps};
use crate::numeric::number::to_f64;
use crate::vision::blur_estimate::BlurEstimate;

/// Largest blur of a step \[px\].
const MAX_BLUR_PX: f64 = 15.0;
/// Step of the fit \[px, or blurs\] from which on it has converged: each step squares the error.
const CONVERGED_STEP: f64 = 8e-3;
/// Slope that shows another step beside the edge, times the blur. Derived: 0.08/√(2π), a twelfth of
/// the slope of the edge itself.
const MIN_NEIGHBOUR_SLOPE: f64 = 0.032;
const WEAK_SLOPE_RATIO: f64 = 0.5;

impl StepFitter<'_> {
    /// First fit of the edge. `noise` is the standard deviation of a pixel as a fraction of the
    /// step, `room` how far to look. `None` where no step can be fitted.
    #[inline(always)]
    pub fn first_fit(&self, noise: f64, room: Clearance) -> Option<StepFit> {
        let slopes = ProfileSlopes::of(self.overlay);
        let (slope, at) = slopes.steepest(room)?;
        let blur = (0.2 / slope).clamp(0.5, MAX_BLUR_PX);
        let step = BlurredStep { at, blur, before: 0.0, after: 1.0 };
        let whole_room = room;
        let (room, flanks) = self.up_to_neighbours(&slopes, step, noise, MIN_NEIGHBOUR_SLOPE, room);
        let fit = StepFit {
            step,
            blur_sd: f64::INFINITY,
            shading: [0.0; 2],
            pixel_noise: noise,
            noise,
            residual: noise,
            phases: to_f64(self.overlay.means().count()),
            room,
            flanks: NeighbourSteps::default(),
            added_variance: 0.0,
        };
        let fit = self.fit(fit, None)?;
        let flanks = flanks.near(&fit.step);
        if flanks.any() {
            let start = StepFit { flanks, ..fit };
            return Some(self.fit_flanks(&start, None).unwrap_or(fit));
        }
        if !fit.is_not_step() {
            return Some(fit);
        }
        // A weaker step beside it, if that explains the residual.
        let weaker = WEAK_SLOPE_RATIO * MIN_NEIGHBOUR_SLOPE;
        let (_, flanks) = self.up_to_neighbours(&slopes, step, noise, weaker, whole_room);
        let start = StepFit { flanks: flanks.near(&fit.step), ..fit };
        let found = start.flanks.any().then(|| self.fit_flanks(&start, None)).flatten();
        Some(found.filter(|found| !found.is_not_step()).unwrap_or(fit))
    }

    /// Fits the edge of a fit with another shape of the blur.
    pub fn refit(&self, fit: &StepFit) -> Option<StepFit> {
        self.fit_from(fit, None)
    }

    /// Fits the edge again with what is known of its blur.
    #[inline(always)]
    pub fn fit_known(&self, fit: &StepFit, blur: BlurEstimate) -> Option<StepFit> {
        let fitted = self.fit_from(fit, Some(blur));
        if fitted.is_some() || !fit.flanks.any() {
            return fitted;
        }
        self.fit(fit.without_flanks(), Some(blur))
    }

    /// Fits the edge of a fit and the steps beside it.
    #[inline(always)]
    fn fit_from(&self, fit: &StepFit, known: Option<BlurEstimate>) -> Option<StepFit> {
        if fit.flanks.any() {
            return self.fit_flanks(fit, known);
        }
        self.fit(*fit, known)
    }

    /// Room on either side up to half-way to a neighbouring step, where the slope has fallen off
    /// and rises again, and these steps, approximately.
    #[inline(always)]
    fn up_to_neighbours(
        &self,
        slopes: &ProfileSlopes,
        start: BlurredStep,
        noise: f64,
        notable: f64,
        room: Clearance,
    ) -> (Clearance, NeighbourSteps) {
        let limits =
            SlopeLimits { noise: noise / (2.0 * self.overlay.used().max(1.0)).sqrt(), notable };
        let (before, flank_before) = slopes.up_to_neighbour(start, limits, -1, room.before);
        let (after, flank_after) = slopes.up_to_neighbour(start, limits, 1, room.after);
        (Clearance { before, after }, NeighbourSteps([flank_before, flank_after]))
    }

    /// Fits position, blur, levels and a little shading about the edge.
    #[inline(always)]
    fn fit(&self, start: StepFit, known: Option<BlurEstimate>) -> Option<StepFit> {
        let mut fit = start;
        let mut last = None;
        let hold = |sd: f64| (start.noise / sd).powi(2);
        // A prior holds shading near 0, because over a short way it could pass for a shift of the
        // edge.
        let of_shading = (start.pixel_noise / SHADING_SIGMA).powi(2);
        for _ in 0..MAX_ITERATIONS {
            let step = fit.step;
            let linear = self.linearise(&fit);
            let mut normal = linear.normal();
            normal.add_prior(4, of_shading, -fit.shading[0]);
            normal.add_prior(5, of_shading, -fit.shading[1]);
            if let Some(BlurEstimate { px, sd_px }) = known {
                normal.add_prior(1, hold(sd_px), px - step.blur);
            }
            let solved = normal.solve()?;
            let moved = solved.unknowns;
            fit.step = BlurredStep {
                at: step.at + moved[0].clamp(-step.blur, step.blur),
                blur: (step.blur + moved[1].clamp(-0.5 * step.blur, 0.5 * step.blur))
                    .clamp(MIN_BLUR_PX, MAX_BLUR_PX),
                before: step.before + moved[2],
                after: step.after + moved[3],
            };
            fit.shading[0] += moved[4];
            fit.shading[1] += moved[5];
            last = Some((linear, solved));
            if moved[0].abs() < CONVERGED_STEP && moved[1].abs() < CONVERGED_STEP * step.blur {
                break;
            }
        }
        let (linear, solved) = last?;
        // The residual counts as noise, even if it is not that of the pixels.
        fit.noise = start.pixel_noise.max(linear.mean_square().sqrt());
        fit.residual = start.pixel_noise;
        if fit.noise > start.pixel_noise {
            let within_phases = linear.within_phases_after(&solved.unknowns);
            fit.residual = start.pixel_noise.max(within_phases.sqrt());
        }
        fit.blur_sd = fit.noise * solved.variance(1).max(0.0).sqrt();
        let inside = fit.step.at > -fit.room.before && fit.step.at < fit.room.after;
        (inside && fit.step.after - fit.step.before > 0.1).then_some(fit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_notable_slope_is_a_twelfth_of_the_edges_own() {
        let own = 1.0 / std::f64::consts::TAU.sqrt();
        assert!((MIN_NEIGHBOUR_SLOPE - 0.08 * own).abs() < 2e-4);
    }
}
