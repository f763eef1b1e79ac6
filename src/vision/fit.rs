//! Fit of a blurred step to a short profile: position, level before the edge,
//! height of the step and shading of the bead beside it, by Gauss–Newton, with
//! prior knowledge of levels and shading where neighbours give it.

use nalgebra::{Matrix4, Vector4};

use crate::numeric::blurred_step::StepTable;
use crate::numeric::number::to_f64;

/// Gauss–Newton steps at most: more cost time on lines that show no edge.
const MAX_STEPS: usize = 8;
/// Step at which the fit has converged \[px\]: far below any noise of a line.
const CONVERGED_PX: f64 = 1e-4;

/// Position and levels of an edge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FittedEdge {
    /// Position \[px\].
    pub at: f64,
    /// Level before the edge \[grey levels\]; where the bead lies before it, that of the bead.
    pub ground: f64,
    /// Signed height of the step \[grey levels\].
    pub height: f64,
    /// Change of the bead's level for each pixel away from the edge
    /// \[grey levels/px\]: the sides of a round bead fall off.
    pub shading: f64,
}

/// Prior of ground, height and shading, from neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Ground, height, shading.
    pub mean: [f64; 3],
    /// Their variances.
    pub variance: [f64; 3],
}

/// A fitted edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeFit {
    /// The edge.
    pub edge: FittedEdge,
    /// Variances of position, ground, height and shading, for samples of the variance
    /// [`ProfileWindow::noise`].
    pub variance: [f64; 4],
    /// Sum of the squared residuals.
    pub residual: f64,
}

/// A profile around an edge: samples a pixel apart.
#[derive(Debug, Clone, Copy)]
pub struct ProfileWindow<'a> {
    /// The blurred step.
    pub table: &'a StepTable,
    /// Position of the first sample \[px\].
    pub first: f64,
    /// The grey levels.
    pub samples: &'a [f32],
    /// Variance of a sample.
    pub noise: f64,
    /// Blur of the edge \[px\].
    pub blur: f64,
    /// Whether the bead lies after the edge.
    pub bead_after: bool,
}

/// Value of a blurred step with shading at a position, and its derivatives.
#[derive(Debug, Clone, Copy)]
pub struct ShadedStep {
    /// Φ: fraction of the step that is reached.
    pub step: f64,
    /// Slope of the fraction \[1/px\].
    pub density: f64,
    /// Blurred distance into the bead \[px\].
    pub depth: f64,
    /// Its derivative.
    pub depth_slope: f64,
}

impl ShadedStep {
    /// At a distance from the edge \[px\], for a blur \[px\].
    #[inline]
    pub fn at(table: &StepTable, distance: f64, blur: f64, bead_after: bool) -> Self {
        let z = distance / blur;
        let (step, density, [falling, rising]) = table.with_slopes(z);
        let (depth, depth_slope) =
            if bead_after { (blur * rising, step) } else { (blur * falling, step - 1.0) };
        Self { step, density: density / blur, depth, depth_slope }
    }
}

impl ProfileWindow<'_> {
    /// Gauss–Newton steps from a start, with a Gaussian prior if there is one. `None` where the
    /// normal matrix is singular or the edge leaves the window; that the steps have converged is
    /// not checked.
    pub fn fit(&self, start: FittedEdge, prior: Option<&Prior>) -> Option<EdgeFit> {
        let mut edge = start;
        let mut normal = Matrix4::zeros();
        for _ in 0..MAX_STEPS {
            let (matrix, slope) = self.linearise(edge, prior);
            normal = matrix;
            let step = matrix.cholesky()?.solve(&slope);
            edge.at += step.x.clamp(-self.blur, self.blur);
            edge.ground += step.y;
            edge.height += step.z;
            edge.shading += step.w;
            if step.x.abs() < CONVERGED_PX {
                break;
            }
        }
        let last = self.first + to_f64(self.samples.len()) - 1.0;
        if !(edge.at > self.first + 1.0 && edge.at < last - 1.0) {
            return None;
        }
        let inverse = normal.cholesky()?.inverse();
        Some(EdgeFit {
            edge,
            variance: [inverse.m11, inverse.m22, inverse.m33, inverse.m44],
            residual: self.residuals(edge).map(|(_, miss)| miss * miss).sum(),
        })
    }

    /// Each sample's model and how far the sample is from it.
    fn residuals(&self, edge: FittedEdge) -> impl Iterator<Item = (ShadedStep, f64)> {
        (0u32..).zip(self.samples).map(move |(position, &sample)| {
            let distance = self.first + f64::from(position) - edge.at;
            let model = ShadedStep::at(self.table, distance, self.blur, self.bead_after);
            let grey = edge.ground + edge.height * model.step + edge.shading * model.depth;
            (model, f64::from(sample) - grey)
        })
    }

    /// Normal equations at an estimate, in units of the noise.
    fn linearise(&self, edge: FittedEdge, prior: Option<&Prior>) -> (Matrix4<f64>, Vector4<f64>) {
        let mut matrix = Matrix4::zeros();
        let mut slope = Vector4::zeros();
        for (model, miss) in self.residuals(edge) {
            let by_position = -edge.height * model.density - edge.shading * model.depth_slope;
            let row = Vector4::new(by_position, 1.0, model.step, model.depth);
            matrix.ger(1.0, &row, &row, 1.0);
            slope += row * miss;
        }
        matrix /= self.noise;
        slope /= self.noise;
        if let Some(prior) = prior {
            for (k, value) in [edge.ground, edge.height, edge.shading].into_iter().enumerate() {
                matrix[(k + 1, k + 1)] += 1.0 / prior.variance[k];
                slope[k + 1] += (prior.mean[k] - value) / prior.variance[k];
            }
        }
        (matrix, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(edge: FittedEdge, blur: f64, bead_after: bool) -> Vec<f32> {
        let table = StepTable::default();
        #[expect(clippy::cast_possible_truncation, reason = "grey levels")]
        let grey = |u: u32| {
            let model = ShadedStep::at(&table, f64::from(u) - edge.at, blur, bead_after);
            (edge.ground + edge.height * model.step + edge.shading * model.depth) as f32
        };
        (0..25).map(grey).collect()
    }

    #[test]
    fn a_clean_edge_is_found_where_it_is() {
        let table = StepTable::default();
        for (height, bead_after) in [(80.0, true), (-80.0, false)] {
            let truth = FittedEdge { at: 12.34, ground: 40.0, height, shading: 1.5 };
            let samples = profile(truth, 1.7, bead_after);
            let window = ProfileWindow {
                table: &table,
                first: 0.0,
                samples: &samples,
                noise: 1.0,
                blur: 1.7,
                bead_after,
            };
            let start = FittedEdge { at: 11.0, ground: 50.0, height: 0.7 * height, shading: 0.0 };
            let fit = window.fit(start, None).unwrap();
            assert!((fit.edge.at - 12.34).abs() < 1e-3, "{fit:?}");
            assert!((fit.edge.shading - 1.5).abs() < 1e-2);
        }
    }

    #[test]
    fn known_levels_bring_the_variance_to_the_bound() {
        let table = StepTable::default();
        let edge = FittedEdge { at: 12.0, ground: 40.0, height: 80.0, shading: 0.0 };
        let samples = profile(edge, 1.5, true);
        let window = ProfileWindow {
            table: &table,
            first: 0.0,
            samples: &samples,
            noise: 16.0,
            blur: 1.5,
            bead_after: true,
        };
        let prior = Prior { mean: [40.0, 80.0, 0.0], variance: [1e-9; 3] };
        let fit = window.fit(edge, Some(&prior)).unwrap();
        // Cramér–Rao bound of one row: 1.883 (σ/A) √s.
        let bound = 1.883 * 4.0 / 80.0 * 1.5f64.sqrt();
        assert!((fit.variance[0].sqrt() / bound - 1.0).abs() < 0.01);
    }

    #[test]
    fn flat_ground_holds_no_edge() {
        let table = StepTable::default();
        let samples = [50.0; 25];
        let window = ProfileWindow {
            table: &table,
            first: 0.0,
            samples: &samples,
            noise: 1.0,
            blur: 1.5,
            bead_after: true,
        };
        let start = FittedEdge { at: 12.0, ground: 50.0, height: 0.0, shading: 0.0 };
        assert_eq!(window.fit(start, None), None);
    }
}
