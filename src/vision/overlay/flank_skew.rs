//! How skewed an edge's flank is: what light passes through between the bead and a grey
//! level, such as a camera's gamma, bends the flank by a bump that is even about the edge,
//! share · (1 − share). A blurred step that is fitted to it lies aside of the edge.

use super::StepFitter;
use super::look::{SHADING_SIGMA, StepFit};
use crate::numeric::normal_equations::NormalEquations;
use crate::numeric::number::to_f64;

/// Unknowns of a blurred step with its shading, and the bump.
const UNKNOWNS: usize = 7;
const BUMP_UNKNOWN: usize = 6;

/// How far an edge lies from where a blurred step without a bump puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSkew {
    /// Towards larger places \[px\].
    pub aside_px: f64,
    /// Variance of that \[px²\].
    pub variance: f64,
}

impl StepFitter<'_> {
    /// The skew of the flank of an edge that was looked at. `None` where steps beside it
    /// reach into its pixels, or it cannot be told.
    pub fn skew(&self, look: &StepFit) -> Option<EdgeSkew> {
        if look.flanks.any() {
            return None;
        }
        let edge = look.step;
        let mut normal = NormalEquations::<UNKNOWNS>::default();
        self.each_sample(look, |_, sample| {
            let mut row = [0.0; UNKNOWNS];
            row[..BUMP_UNKNOWN].copy_from_slice(&sample.row);
            let (step, _) = self.table.at((sample.at - edge.at) / edge.blur);
            row[BUMP_UNKNOWN] = step * (1.0 - step) * (edge.after - edge.before);
            normal.add(row, sample.miss, sample.weight);
        });
        for (side, shading) in look.shading.iter().enumerate() {
            normal.add_prior(4 + side, (look.pixel_noise / SHADING_SIGMA).powi(2), -shading);
        }
        let solved = normal.solve()?;
        let covariance = solved.covariance();
        let (bump, of_bump) =
            (solved.unknowns[BUMP_UNKNOWN], covariance[(BUMP_UNKNOWN, BUMP_UNKNOWN)]);
        let per_bump = covariance[(0, BUMP_UNKNOWN)] / of_bump;
        // What the bump explains is no noise.
        let others = (look.samples() - to_f64(UNKNOWNS)).max(1.0);
        let explained = bump * bump / (of_bump * others);
        let noise = (look.residual.powi(2) - explained).max(look.pixel_noise.powi(2));
        let variance = noise * of_bump * per_bump * per_bump;
        Some(EdgeSkew { aside_px: per_bump * bump, variance })
    }
}
