//! Skew of an edge's flank. A nonlinear camera, such as one with a gamma, adds a bump to the flank
//! that is even about the edge, f · (1 − f) for a step f. A blurred step that is fitted to it
//! without the bump lies beside the edge.

use super::StepFitter;
use super::look::{SHADING_SIGMA, StepFit};
use crate::numeric::normal_equations::NormalEquations;
use crate::numeric::number::to_f64;

/// Unknowns. By definition the six of a blurred step with its shading, and the bump.
const UNKNOWNS: usize = 7;
/// Number of the bump among them. By definition the last.
const BUMP_UNKNOWN: usize = 6;

/// How far an edge lies from where a blurred step without a bump puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSkew {
    /// Towards larger positions \[px\].
    pub aside_px: f64,
    /// Variance of that \[px²\].
    pub variance: f64,
}

impl StepFitter<'_> {
    /// Skew of the flank of a fitted edge. `None` where steps beside it reach into its pixels, or
    /// it cannot be determined.
    pub fn skew(&self, fit: &StepFit) -> Option<EdgeSkew> {
        if fit.flanks.any() {
            return None;
        }
        let edge = fit.step;
        let mut normal = NormalEquations::<UNKNOWNS>::default();
        self.each_sample(fit, |_, sample| {
            let mut row = [0.0; UNKNOWNS];
            row[..BUMP_UNKNOWN].copy_from_slice(&sample.row);
            let (step, _) = self.table.at((sample.at - edge.at) / edge.blur);
            row[BUMP_UNKNOWN] = step * (1.0 - step) * (edge.after - edge.before);
            normal.add(row, sample.miss, sample.weight);
        });
        for (side, shading) in fit.shading.iter().enumerate() {
            normal.add_prior(4 + side, (fit.pixel_noise / SHADING_SIGMA).powi(2), -shading);
        }
        let solved = normal.solve()?;
        let covariance = solved.covariance();
        let (bump, of_bump) =
            (solved.unknowns[BUMP_UNKNOWN], covariance[(BUMP_UNKNOWN, BUMP_UNKNOWN)]);
        let per_bump = covariance[(0, BUMP_UNKNOWN)] / of_bump;
        // What the bump explains is no noise.
        let others = (fit.samples() - to_f64(UNKNOWNS)).max(1.0);
        let explained = bump * bump / (of_bump * others);
        let noise = (fit.residual.powi(2) - explained).max(fit.pixel_noise.powi(2));
        let variance = noise * of_bump * per_bump * per_bump;
        Some(EdgeSkew { aside_px: per_bump * bump, variance })
    }
}
