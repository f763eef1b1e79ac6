//! A step close beside an edge, such as that of a shadow: its tail reaches into
//! the edge's own pixels, so that both are fitted together.

use nalgebra::SVector;

use super::StepFitter;
use super::look::{MAX_ITERATIONS, SHADING_SIGMA, StepFit, max_sample_px};
use super::step::{BlurredStep, Clearance, MIN_BLUR_PX, NeighbourStep, NeighbourSteps};
use crate::numeric::normal_equations::NormalEquations;
use crate::vision::blur_estimate::BlurEstimate;

/// Unknowns. By definition position, blur, levels and shading of the edge, then position, height
/// and blur of the step before it and of the one after it.
const UNKNOWNS: usize = 12;
/// Number of the first unknown of a flank on either side. By definition after the six of the edge,
/// and three later.
const FIRST_FLANK_UNKNOWN: [usize; 2] = [6, 9];
/// Distance beyond a flank up to which samples are fitted, in its blurs.
const BEYOND_BLURS: f64 = 2.0;
/// Relative difference of a flank's blur from the edge's, as a standard deviation.
const FLANK_BLUR_SIGMA: f64 = 0.5;
/// Distance before a flank up to which samples are used for the edge, in the flank's blurs.
const FLANK_MARGIN_BLURS: f64 = 1.0;
/// Largest increase of the residual by the fit with flanks \[fractions of the step\].
const MAX_MISFIT_INCREASE: f64 = 0.01;
/// Weight that fixes an unknown. Derived: many orders of magnitude more than the sums over a
/// hundred rows, and far from the limits of a float.
const FIXED_WEIGHT: f64 = 1e12;

impl StepFitter<'_> {
    /// Fits an edge and the steps beside it. `start` has approximate ones, and the edge as it was
    /// fitted without them. `None` where the fit is no better.
    #[cold]
    #[inline(never)]
    pub fn fit_flanks(&self, start: &StepFit, known: Option<BlurEstimate>) -> Option<StepFit> {
        let mut fit = *start;
        for _ in 0..MAX_ITERATIONS {
            let (mut normal, _) = self.linearise_flanks(&fit);
            hold(&mut normal, &fit, known);
            let solved = normal.solve()?;
            let moved = take_step(&mut fit, &solved.unknowns);
            if moved < 1e-3 {
                break;
            }
        }
        let (mut normal, misfit) = self.linearise_flanks(&fit);
        hold(&mut normal, &fit, known);
        fit.noise = fit.pixel_noise.max(misfit.sqrt());
        fit.residual = fit.noise;
        let solved = normal.solve()?;
        fit.blur_sd = fit.noise * solved.variance(1).max(0.0).sqrt();
        fit.added_variance = fit.noise * fit.noise * added_variance(&mut normal)?;
        fit.room = samples_of_edge(&fit);
        let fraction =
            (relative_misfit(misfit, &fit), relative_misfit(start.noise * start.noise, start));
        (is_sound(&fit, start) && fraction.0 <= fraction.1 + MAX_MISFIT_INCREASE).then_some(fit)
    }

    /// Normal equations about an edge and its flanks, and the mean squared residual.
    fn linearise_flanks(&self, fit: &StepFit) -> (NormalEquations<UNKNOWNS>, f64) {
        let flanks = &fit.flanks;
        let Clearance { before: from, after: to } = reach(fit);
        let mut normal = NormalEquations::default();
        let many = 3.0 * flanks.0.iter().flatten().map(|_| 1.0).sum::<f64>();
        let (mut square, mut n) = (0.0, -6.0 - many);
        for mean in self.overlay.means() {
            let weight = f64::from(mean.rows);
            for (at, value) in mean.samples(-from, to) {
                let mut row = [0.0; UNKNOWNS];
                let (own, level) = fit.linear_at(self.table, at);
                row[..6].copy_from_slice(&own);
                let mut miss = value - level;
                for ((flank, sign), first) in
                    flanks.0.iter().zip([-1.0, 1.0]).zip(FIRST_FLANK_UNKNOWN)
                {
                    let Some(flank) = flank else { continue };
                    let (adds, slopes) = flank.reaches(self.table, at, sign);
                    miss -= adds;
                    row[first..first + 3].copy_from_slice(&slopes);
                }
                square += weight * miss * miss;
                n += 1.0;
                normal.add(row, miss, weight);
            }
        }
        (normal, square / f64::max(n, 1.0))
    }
}

/// Farthest samples on either side \[px\].
fn reach(fit: &StepFit) -> Clearance {
    let StepFit { step, room, flanks, .. } = fit;
    let plain = 4.5 * step.blur + 2.0;
    let of = |flank: &Option<NeighbourStep>, room: f64| match flank {
        Some(flank) => (flank.at.abs() + BEYOND_BLURS * flank.blur).min(max_sample_px()),
        None => plain.min(room).min(max_sample_px()),
    };
    Clearance { before: of(&flanks.0[0], room.before), after: of(&flanks.0[1], room.after) }
}

/// Adds priors of what is known, and fixes the unknowns of flanks that do not exist.
fn hold(normal: &mut NormalEquations<UNKNOWNS>, fit: &StepFit, known: Option<BlurEstimate>) {
    let weight = |sd: f64| (fit.noise / sd).powi(2);
    normal.add_prior(4, weight(SHADING_SIGMA), -fit.shading[0]);
    normal.add_prior(5, weight(SHADING_SIGMA), -fit.shading[1]);
    if let Some(BlurEstimate { px, sd_px }) = known {
        normal.add_prior(1, weight(sd_px), px - fit.step.blur);
    }
    for (flank, first) in fit.flanks.0.iter().zip(FIRST_FLANK_UNKNOWN) {
        match flank {
            Some(flank) => {
                let usual = weight(FLANK_BLUR_SIGMA * fit.step.blur);
                normal.add_prior(first + 2, usual, fit.step.blur - flank.blur);
            }
            None => (first..first + 3).for_each(|which| normal.add_prior(which, FIXED_WEIGHT, 0.0)),
        }
    }
}

/// Takes a step of the fit; returns how far the edge moved \[px\].
fn take_step(fit: &mut StepFit, moved: &SVector<f64, UNKNOWNS>) -> f64 {
    let step = fit.step;
    let most = 0.5 * step.blur;
    fit.step = BlurredStep {
        at: step.at + moved[0].clamp(-most, most),
        blur: (step.blur + moved[1].clamp(-0.5 * most, 0.5 * most)).max(MIN_BLUR_PX),
        before: step.before + moved[2],
        after: step.after + moved[3],
    };
    fit.shading[0] += moved[4];
    fit.shading[1] += moved[5];
    for (flank, first) in fit.flanks.0.iter_mut().zip(FIRST_FLANK_UNKNOWN) {
        let Some(flank) = flank else { continue };
        flank.at += moved[first].clamp(-most, most);
        flank.height += moved[first + 1];
        flank.blur =
            (flank.blur + moved[first + 2].clamp(-0.5 * most, 0.5 * most)).max(MIN_BLUR_PX);
    }
    moved[0].abs() + moved[1].abs()
}

/// Variance that the blur and the flanks add to the edge's position, for samples of variance 1
/// \[px²\].
fn added_variance(normal: &mut NormalEquations<UNKNOWNS>) -> Option<f64> {
    // The uncertainty of shading counts where shading shows, not wherever it may be.
    normal.add_prior(4, FIXED_WEIGHT, 0.0);
    normal.add_prior(5, FIXED_WEIGHT, 0.0);
    let all = normal.solve()?.variance(0);
    normal.add_prior(1, FIXED_WEIGHT, 0.0);
    for which in FIRST_FLANK_UNKNOWN[0]..UNKNOWNS {
        normal.add_prior(which, FIXED_WEIGHT, 0.0);
    }
    Some((all - normal.solve()?.variance(0)).max(0.0))
}

/// The samples that the edge is located from.
fn samples_of_edge(fit: &StepFit) -> Clearance {
    let of = |flank: &Option<NeighbourStep>, room: f64| {
        flank.as_ref().map_or(room, |flank| {
            ((flank.at - fit.step.at).abs() - FLANK_MARGIN_BLURS * flank.blur).max(fit.step.blur)
        })
    };
    let NeighbourSteps([before, after]) = &fit.flanks;
    Clearance { before: of(before, fit.room.before), after: of(after, fit.room.after) }
}

/// Residual of a fit, as a fraction of its own step.
fn relative_misfit(square: f64, fit: &StepFit) -> f64 {
    square.sqrt() / (fit.step.after - fit.step.before).abs()
}

/// Whether the edge is still that of `start`, and the flanks lie beside it.
fn is_sound(fit: &StepFit, start: &StepFit) -> bool {
    let step = fit.step;
    let beside = |(flank, sign): (&Option<NeighbourStep>, f64)| {
        flank.is_none_or(|flank| {
            sign * (flank.at - step.at) > 1.5 * step.blur
                && flank.blur < 3.0 * step.blur
                && flank.height.is_finite()
        })
    };
    (step.at - start.step.at).abs() < start.step.blur
        && step.after - step.before > 0.1
        && fit.flanks.0.iter().zip([-1.0, 1.0]).all(beside)
}
