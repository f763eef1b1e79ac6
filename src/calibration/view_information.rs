//! What each picture says of the numbers that all pictures share, and whether the
//! pictures contradict each other more than independent corners would.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::bundle::BundleFit;
use super::equations::{Equations, FreeParameters, SHARED, restrict_to_free};
use super::factor::{Elimination, Factor};
use super::solve::data::CalibrationData;

/// Design effect below which it is no less but by chance: its own standard error is some
/// 0.16 with a dozen pictures. Not 1, so that it is right on average for independent corners.
const MIN_DESIGN_EFFECT: f64 = 0.8;

/// One picture's part of the equations, its board's pose eliminated.
#[derive(Debug, Clone)]
pub struct ViewInformation {
    /// Information on the shared numbers, in units of one over the noise's variance.
    pub information: SMatrix<f64, SHARED, SHARED>,
    /// Its gradient: which way this picture alone would move them. At the best fit
    /// all of them together are 0.
    pub score: SVector<f64, SHARED>,
    /// Sum of the squares of its residuals \[px²\].
    pub sum_of_squares_px2: f64,
}

impl ViewInformation {
    /// Of each picture. `None` where one does not fix its board's pose.
    pub(super) fn all(
        views: &CalibrationData,
        fit: &BundleFit,
        free: FreeParameters,
    ) -> Option<Vec<Self>> {
        let each = fit.placements.iter().zip(&views.boards);
        each.map(|(place, boards)| {
            let equations = Equations::of(&fit.model, free, place, boards)?;
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

/// How many times larger the variance of the shared numbers is than if every corner were
/// off by itself: the design effect of sampling by clusters (Kish 1965, *Survey
/// Sampling*, section 5.4), a picture being a cluster.
///
/// What bends all corners of a picture alike (a board that is not quite flat, a lens that
/// no model describes, light that moves edges) makes its score gᵥ larger than the noise σ²
/// of a corner explains. With `S = ΣSᵥ` and independent corners, `Σ gᵥᵀS⁻¹gᵥ` has the mean
/// `σ²(p − Σ tr(S⁻¹SᵥS⁻¹Sᵥ))` at the best fit of p numbers; the ratio of both is the effect.
/// The cluster-robust covariance (Liang and Zeger 1986) has the same scores and a matrix
/// where this has a number, which so few pictures tell better. `None`
/// where the pictures do not settle the numbers.
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
        let part = DMatrix::from_columns(
            &left
                .column_iter()
                .map(|column| inverse.solve(&DVector::from_column_slice(column.as_slice())))
                .collect::<Vec<_>>(),
        );
        used += (&part * &part).trace();
    }
    #[expect(clippy::cast_precision_loss, reason = "a handful of numbers")]
    let expected = noise_variance_px2 * (free.count() as f64 - used);
    let effect = found / expected;
    (expected > 0.0 && effect.is_finite()).then(|| effect.max(MIN_DESIGN_EFFECT))
}
