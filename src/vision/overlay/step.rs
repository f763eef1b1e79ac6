//! A blurred step, and the steps close beside it.

use crate::numeric::blurred_step::StepTable;

/// Smallest blur of a step \[px\].
pub const MIN_BLUR_PX: f64 = 0.3;
/// Farthest that a flank is fitted, in blurs: from there on its tail is nothing.
const MAX_NEIGHBOUR_BLURS: f64 = 7.0;

/// Samples that are free of anything but this edge, on either side \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Towards smaller places.
    pub before: f64,
    /// Towards larger ones.
    pub after: f64,
}

/// A blurred step, its levels in shares of the step that was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlurredStep {
    /// How far it lies from the path \[px\].
    pub at: f64,
    /// Blur as the standard deviation of a Gaussian \[px\], integration over
    /// pixels included.
    pub blur: f64,
    /// Level before it.
    pub before: f64,
    /// Level after it.
    pub after: f64,
}

/// A step beside the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeighbourStep {
    /// Its place, beside the path \[px\].
    pub at: f64,
    /// What it adds to the level beyond it, in shares of the edge's step.
    pub height: f64,
    /// Its blur \[px\].
    pub blur: f64,
}

impl NeighbourStep {
    /// What it adds to the level at a place, and the derivatives of that by
    /// place, height and blur. `sign` is −1 for one before the edge, 1 for one
    /// after it.
    #[inline(always)]
    pub fn reaches(&self, table: &StepTable, at: f64, sign: f64) -> (f64, [f64; 3]) {
        let z = sign * (at - self.at) / self.blur;
        let (share, density) = table.at(z);
        let per_px = self.height * density / self.blur;
        (self.height * share, [-sign * per_px, share, -z * per_px])
    }
}

/// The steps beside an edge: before it and after it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct NeighbourSteps(pub [Option<NeighbourStep>; 2]);

impl NeighbourSteps {
    /// Whether there are any.
    pub fn any(&self) -> bool {
        self.0.iter().any(Option::is_some)
    }

    /// What they add to the level at a place beside the path, in shares of the
    /// step.
    pub fn at(&self, table: &StepTable, at: f64) -> f64 {
        let one = |(flank, sign): (&Option<NeighbourStep>, f64)| {
            flank.as_ref().map_or(0.0, |flank| flank.reaches(table, at, sign).0)
        };
        self.0.iter().zip([-1.0, 1.0]).map(one).sum()
    }

    /// The same flanks about an edge that lies at a place beside the path and
    /// has another step, of which the given one is a share.
    pub fn about(&self, at: f64, share: f64) -> Self {
        let moved = |flank: NeighbourStep| NeighbourStep {
            at: flank.at - at,
            height: flank.height / share,
            ..flank
        };
        Self(self.0.map(|flank| flank.map(moved)))
    }

    /// Only those near enough to an edge to reach into its pixels.
    pub fn near(&self, step: &BlurredStep) -> Self {
        let near =
            |flank: &NeighbourStep| (flank.at - step.at).abs() < MAX_NEIGHBOUR_BLURS * step.blur;
        Self(self.0.map(|flank| flank.filter(near)))
    }
}

/// One side of a step with steps beside it.
#[derive(Debug, Clone, Copy)]
pub struct SideInput<'a> {
    /// The step.
    pub step: &'a BlurredStep,
    /// The steps beside it.
    pub flanks: &'a NeighbourSteps,
    /// Direction away from the step: 1 after it, −1 before it.
    pub sign: f64,
    /// How far there is nothing else \[px\].
    pub room: f64,
    /// Standard deviation of a sample, as a fraction of the step.
    pub noise: f64,
}
