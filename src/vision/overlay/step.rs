//! A blurred step, and the steps close beside it.

use crate::numeric::blurred_step::StepTable;

/// Smallest blur of a step \[px\].
pub const MIN_BLUR_PX: f64 = 0.3;
/// Farthest that a step beside the edge is fitted, in blurs. Derived: beyond 7 blurs 10⁻¹² of a
/// step is left, 1 − Φ(7).
const MAX_NEIGHBOUR_BLURS: f64 = 7.0;

/// Samples that are free of anything but this edge, on either side \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// Towards smaller positions.
    pub before: f64,
    /// Towards larger ones.
    pub after: f64,
}

/// A blurred step, its levels as fractions of the step that was given.
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
    /// Its position, beside the path \[px\].
    pub at: f64,
    /// What it adds to the level beyond it, as fractions of the edge's step.
    pub height: f64,
    /// Its blur \[px\].
    pub blur: f64,
}

impl NeighbourStep {
    /// What it adds to the level at a position, and the derivatives of that by
    /// position, height and blur. `sign` is −1 for one before the edge, 1 for one
    /// after it.
    #[inline(always)]
    pub fn reaches(&self, table: &StepTable, at: f64, sign: f64) -> (f64, [f64; 3]) {
        let z = sign * (at - self.at) / self.blur;
        let (fraction, density) = table.at(z);
        let per_px = self.height * density / self.blur;
        (self.height * fraction, [-sign * per_px, fraction, -z * per_px])
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

    /// What they add to the level at a position beside the path, as fractions of the
    /// step.
    pub fn at(&self, table: &StepTable, at: f64) -> f64 {
        let one = |(flank, sign): (&Option<NeighbourStep>, f64)| {
            flank.as_ref().map_or(0.0, |flank| flank.reaches(table, at, sign).0)
        };
        self.0.iter().zip([-1.0, 1.0]).map(one).sum()
    }

    /// These flanks relative to an edge at a position beside the path, in fractions of its step,
    /// whose height is `fraction` of this one's.
    pub fn about(&self, at: f64, fraction: f64) -> Self {
        let moved = |NeighbourStep { at: of_flank, height, blur }: NeighbourStep| NeighbourStep {
            at: of_flank - at,
            height: height / fraction,
            blur,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives of the level that a step adds, against differences of it.
    #[test]
    fn derivatives_of_a_step_are_those_of_its_level() {
        let table = StepTable::default();
        let step = NeighbourStep { at: 3.0, height: 0.7, blur: 1.6 };
        for (sign, at) in [(1.0, 2.0), (1.0, 4.1), (-1.0, 1.2), (-1.0, 3.4)] {
            let level = |of: NeighbourStep| of.reaches(&table, at, sign).0;
            let d = 0.05;
            let found = [
                level(NeighbourStep { at: 3.0 + d, ..step })
                    - level(NeighbourStep { at: 3.0 - d, ..step }),
                level(NeighbourStep { height: 0.7 + d, ..step })
                    - level(NeighbourStep { height: 0.7 - d, ..step }),
                level(NeighbourStep { blur: 1.6 + d, ..step })
                    - level(NeighbourStep { blur: 1.6 - d, ..step }),
            ];
            for (found, expected) in found.iter().zip(step.reaches(&table, at, sign).1) {
                assert!(
                    (found / (2.0 * d) - expected).abs() < 3e-3,
                    "{sign} {at}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn steps_beside_an_edge_move_with_it_and_far_ones_do_not_count() {
        let flank = NeighbourStep { at: 8.0, height: 0.4, blur: 1.5 };
        let flanks = NeighbourSteps([None, Some(flank)]);
        let about = flanks.about(0.5, 2.0).0[1].unwrap();
        assert_eq!((about.at, about.height, about.blur), (7.5, 0.2, 1.5));
        let edge = BlurredStep { at: 0.0, blur: 1.5, before: 0.0, after: 1.0 };
        assert!(flanks.near(&edge).any());
        assert!(!flanks.near(&BlurredStep { blur: 1.1, ..edge }).any());
    }
}
