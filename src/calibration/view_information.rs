//! Information of each image on the shared parameters, and whether images contradict each other
//! more than independent corners would.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::bundle::BundleFit;
use super::equations::{Equations, FreeParameters, SHARED, restrict_to_free};
use super::factor::{Elimination, Factor};
use super::solve::data::CalibrationData;
use crate::numeric::number::to_f64;

/// Smallest design effect. A choice: its standard error is some 0.16 with a dozen images, and
/// with a bound of 1 it would be biased for independent corners.
const MIN_DESIGN_EFFECT: f64 = 0.8;

/// Normal equations of one image with the pose eliminated.
#[derive(Debug, Clone)]
pub struct ViewInformation {
    /// Information on the shared parameters, in units of the inverse noise variance.
    pub information: SMatrix<f64, SHARED, SHARED>,
    /// Gradient of this image alone; at the best fit the gradients of all images add up to 0.
    pub score: SVector<f64, SHARED>,
    /// Sum of the squares of its residuals \[px²\].
    pub sum_of_squares_px2: f64,
}

impl ViewInformation {
    /// For each image. `None` where one does not determine the pose of its board.
    pub(super) fn all(
        views: &CalibrationData,
        fit: &BundleFit,
        free: FreeParameters,
    ) -> Option<Vec<Self>> {
        let each = fit.placements.iter().zip(&views.boards);
        each.map(|(position, boards)| {
            let equations = Equations::of(&fit.model, free, position, boards)?;
            let elimination = Elimination::of(&equations)?;
            let known = elimination.placement.solve(&equations.placement_side);
            let score = DVector::from_column_slice(equations.shared_side.as_slice())
                - equations.both.transpose() * known;
            Some(Self {
                information: elimination.reduced,
                score: SVector::from_fn(|row, _| score[row]),
                sum_of_squares_px2: equations.sum_of_squares_px2,
            })
        })
        .collect()
    }
}

/// Ratio of the variance of the shared parameters to that for independent corners: the design
/// effect of cluster sampling (Kish 1965, *Survey Sampling*, section 5.4), with the images as
/// clusters.
///
/// A common error of all corners of an image (a bent board, distortion beyond the model, light
/// that shifts edges) makes its score gᵥ larger than the noise σ² of a corner explains. With `S
/// = ΣSᵥ` and independent corners, `Σ gᵥᵀS⁻¹gᵥ` has the mean `σ²(p − Σ tr(S⁻¹SᵥS⁻¹Sᵥ))` at the
/// best fit of p parameters; the ratio of both is the effect. The cluster-robust covariance
/// (Liang and Zeger 1986) has a matrix from the same scores where this has one number, which
/// few images estimate better. `None` where the images do not determine the parameters.
pub fn design_effect(
    pulls: &[ViewInformation],
    free: FreeParameters,
    noise_variance_px2: f64,
) -> Option<f64> {
    let all = pulls.iter().map(|one| one.information).sum();
    let inverse = Factor::of_shared(&restrict_to_free(all, free))?;
    let (mut found, mut used) = (0.0, 0.0);
    for one in pulls {
        let score = DVector::from_iterator(
            SHARED,
            (0..SHARED).map(|number| if free.has(number) { one.score[number] } else { 0.0 }),
        );
        found += score.dot(&inverse.solve(&score));
        let left = restrict_to_free(one.information, free);
        let columns = left.column_iter();
        let solve = |column: &[f64]| inverse.solve(&DVector::from_column_slice(column));
        let columns: Vec<_> = columns.map(|column| solve(column.as_slice())).collect();
        let part = DMatrix::from_columns(&columns);
        used += (&part * &part).trace();
    }
    let expected = noise_variance_px2 * (to_f64(free.count()) - used);
    let effect = found / expected;
    (expected > 0.0 && effect.is_finite()).then(|| effect.max(MIN_DESIGN_EFFECT))
}
