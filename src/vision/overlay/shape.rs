//! The shape of an edge, from a fit to it: how far its surroundings on either side are plain,
//! and how they are shaded.

use super::look::StepFit;
use super::step::{BlurredStep, Clearance, MIN_BLUR_PX, NeighbourSteps, SideInput};
use super::{ROUNDING_VARIANCE_PX2, StepFitter};
use crate::vision::blur_estimate::BlurEstimate;
use crate::vision::line::LineSums;

/// How the level beside an edge changes away from it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SideShading {
    /// Change at the edge \[1/px\].
    pub slope: f64,
    /// Half the change of the slope \[1/px²\].
    pub bend: f64,
}

impl SideShading {
    /// This shading in fractions of another step, whose height is `fraction` of this one's.
    pub fn of(self, fraction: f64) -> Self {
        Self { slope: self.slope / fraction, bend: self.bend / fraction }
    }
}

/// One side of an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideShape {
    /// Distance from the edge up to which the side is plain \[px\].
    pub extent: f64,
    /// How its level changes, as fractions of the step that was given.
    pub shading: SideShading,
    /// Variance of the level at the edge from the uncertainty of the shading.
    pub level_variance: f64,
}

/// An edge as the overlay shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepShape {
    /// The step.
    pub step: BlurredStep,
    /// Extent of the plain surroundings, all of which is used \[px\].
    pub extent: Clearance,
    /// How the level changes away from the edge, before it and after it, in
    /// fractions of the step.
    pub shading: [SideShading; 2],
    /// Steps beside the edge that reach into its pixels, as fractions of its own.
    pub flanks: NeighbourSteps,
    /// Variance of the edge's position from the uncertainty of shading and flanks \[px²\].
    pub variance: f64,
}

impl StepShape {
    /// Whether there is more beside the edge than even slopes.
    pub fn is_bent(&self) -> bool {
        self.flanks.any() || self.shading.iter().any(|shading| shading.bend != 0.0)
    }
}

impl StepFitter<'_> {
    /// Extent of the plain surroundings on one side of a known step \[px\], after it or before it;
    /// their slope in fractions of the step that was given \[1/px away from it\], and the variance
    /// that its uncertainty gives the level at the edge.
    pub fn side_slope(&self, fit: &StepFit, step: &BlurredStep, after: bool) -> (f64, (f64, f64)) {
        let (sign, room) = if after { (1.0, fit.room.after) } else { (-1.0, fit.room.before) };
        let (flanks, noise) = (&fit.flanks, fit.pixel_noise);
        let (extent, line) = self.plain_extent(&SideInput { step, flanks, sign, room, noise });
        (extent, line.shrunk_slope(noise))
    }

    /// Reads the edge's shape from a fit to it and what is known of its blur.
    #[inline(always)]
    pub fn shape(&self, fit: &StepFit, blur: BlurEstimate) -> Option<StepShape> {
        let fit = self.fit_known(fit, blur)?;
        let StepFit { step, noise, room, flanks, added_variance, .. } = fit;
        let sharp = step.blur * step.blur - ROUNDING_VARIANCE_PX2;
        let step = BlurredStep { blur: sharp.max(MIN_BLUR_PX.powi(2)).sqrt(), ..step };
        let before =
            SideInput { step: &step, flanks: &flanks, sign: -1.0, room: room.before, noise };
        let after = SideInput { sign: 1.0, room: room.after, ..before };
        let [before, after] = [before, after].map(|side| self.side_shape(&side, fit.pixel_noise));
        // A level that is off by a fraction moves the edge by √π blurs times it.
        let per_level = std::f64::consts::PI * step.blur * step.blur;
        Some(StepShape {
            step,
            extent: Clearance { before: before.extent, after: after.extent },
            shading: [before.shading, after.shading],
            flanks,
            variance: per_level * (before.level_variance + after.level_variance) + added_variance,
        })
    }

    /// One side of the edge: a straight line, or a parabola where the line ends early.
    /// `pixel_noise` is the standard deviation of a pixel, not of a row's samples.
    #[inline(always)]
    fn side_shape(&self, side: &SideInput<'_>, pixel_noise: f64) -> SideShape {
        let (extent, line) = self.plain_extent(side);
        if extent + 2.0 <= side.room
            && let Some(curved) = self.parabolic_side(side)
        {
            return curved;
        }
        let (slope, variance) = line.shrunk_slope(pixel_noise);
        SideShape { extent, shading: SideShading { slope, bend: 0.0 }, level_variance: variance }
    }

    /// Samples of two pixels beside the edge, from a distance on: distance from the edge \[px\],
    /// difference from the level there, and weight.
    #[inline(always)]
    pub fn each_beside(
        &self,
        &SideInput { step, flanks, sign, .. }: &SideInput<'_>,
        from: f64,
        mut add: impl FnMut(f64, f64, f64),
    ) {
        let height = step.after - step.before;
        let (near, far) = (step.at + sign * from, step.at + sign * (from + 2.0));
        for mean in self.overlay.means() {
            for (at, value) in mean.samples(near.min(far), near.max(far) - 1e-9) {
                let (fraction, _) = self.table.at((at - step.at) / step.blur);
                let beside = if flanks.any() { flanks.at(self.table, at) } else { 0.0 };
                let off = value - beside - step.before - height * fraction;
                add(sign * (at - step.at), off, mean.rows.into());
            }
        }
    }

    /// How far from the edge a side is plain, that is a straight line within
    /// what noise explains, and that line.
    #[inline(always)]
    fn plain_extent(&self, side: &SideInput<'_>) -> (f64, LineSums) {
        let SideInput { noise, room, .. } = *side;
        let height = side.step.after - side.step.before;
        let first = 3.0 * side.step.blur;
        let mut line = LineSums::default();
        let mut end = first.min(room);
        while end + 2.0 <= room {
            let mut block = LineSums::default();
            self.each_beside(side, end, |away, off, weight| {
                block.add(away, off, weight);
            });
            if block.weight <= 0.0 {
                break;
            }
            let (expected, variance) = line.at(block.middle());
            let off = block.mean() - expected;
            let variance = noise * noise * (variance + 1.0 / block.weight);
            // The first few pixels show the slope.
            if line.shows_slope() && off.abs() > 4.0 * variance.sqrt() + 0.006 * height {
                break;
            }
            line.join(&block);
            end += 2.0;
        }
        (end, line)
    }
}
