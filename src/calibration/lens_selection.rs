//! Selection of the lens model and of the bend of the board by leave-one-out cross-validation
//! (Stone 1974). A residual cannot select: it falls with every parameter that is fitted.

use nalgebra::{DVector, SMatrix, SVector};

use super::bundle::{self, BundleFit, Guess};
use super::equations::{FreeParameters, SHARED, restrict_to_free};
use super::factor::Factor;
use super::lens::Lens;
use super::solve::data::CalibrationData;
use super::view_information::ViewInformation;

/// Relative difference of cross-validation errors that counts as none. Among models of equal
/// error the one with most coefficients is used: a coefficient that is fixed would count as
/// known exactly. The rational model must be better by as much, because its parameters are
/// undetermined where numerator and denominator nearly cancel.
const AS_GOOD_TOLERANCE: f64 = 0.005;
/// Standard deviations from which a bend of the board is significant. A choice.
const MIN_BEND_SIGMAS: f64 = 4.0;

/// Result of one model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LensTrial {
    /// What was fitted.
    pub free: FreeParameters,
    /// Root mean square of all reprojection errors \[px\].
    pub rms_px: f64,
    /// Root mean square error of each image with the camera from the others \[px\]; `None`
    /// where the others do not determine the camera.
    pub cross_validation_px: Option<f64>,
    /// Whether the distortion is not monotonic within the image: such a model is used only if
    /// all are.
    pub is_non_monotonic: bool,
}

/// Fits on a flat board, one lens model after the other, each from the result before it; models
/// without a fit are left out.
fn fits(views: &CalibrationData, most: Lens) -> Vec<(BundleFit, LensTrial)> {
    let mut fits: Vec<(BundleFit, LensTrial)> = Vec::new();
    for lens in Lens::ALL.into_iter().filter(|lens| *lens <= most) {
        let start = fits.last().map_or_else(|| views.start.clone(), |(fit, _)| guess(fit));
        let free = FreeParameters { lens: Some(lens), bend: false };
        if let Some(fit) = bundle::fit(start, free, &views.boards) {
            let trial = trial(views, &fit, free);
            fits.push((fit, trial));
        }
    }
    fits
}

/// Initial values of another fit.
fn guess(fit: &BundleFit) -> Guess {
    Guess { model: fit.model, placements: fit.placements.clone() }
}

/// The best model and all that were tried. `None` where no model gives a camera.
pub(super) fn best(views: &CalibrationData) -> Option<(BundleFit, FreeParameters, Vec<LensTrial>)> {
    let mut fits = fits(views, Lens::Rational);
    let chosen = chosen(&fits)?;
    let mut trials: Vec<LensTrial> = fits.iter().map(|(_, trial)| *trial).collect();
    let (fit, chosen) = fits.swap_remove(chosen);
    let free = FreeParameters { bend: true, ..chosen.free };
    let bent =
        bundle::fit(guess(&fit), free, &views.boards).map(|fit| (trial(views, &fit, free), fit));
    if let Some((trial, bent)) = bent {
        trials.push(trial);
        let predicts_better =
            trial.cross_validation_px.zip(chosen.cross_validation_px).is_some_and(|(b, f)| b < f);
        let is_sound = chosen.is_non_monotonic || !trial.is_non_monotonic;
        if predicts_better && is_sound && is_bent(views, &bent, free) {
            return Some((bent, free, trials));
        }
    }
    Some((fit, chosen.free, trials))
}

/// The model of a flat board that is used; without cross-validation the one with fewest
/// coefficients. `None` without a fit.
fn chosen(fits: &[(BundleFit, LensTrial)]) -> Option<usize> {
    let is_rational = |trial: &LensTrial| trial.free.lens == Some(Lens::Rational);
    let all_fold = fits.iter().all(|(_, trial)| trial.is_non_monotonic);
    let held_out = |(_, trial): &(BundleFit, LensTrial)| {
        trial.cross_validation_px.filter(|_| all_fold || !trial.is_non_monotonic)
    };
    let simpler = fits.iter().filter(|(_, trial)| !is_rational(trial));
    let least = simpler.filter_map(held_out).fold(f64::INFINITY, f64::min);
    let is_as_good = |fit: &(BundleFit, LensTrial)| {
        let most =
            if is_rational(&fit.1) { 1.0 - AS_GOOD_TOLERANCE } else { 1.0 + AS_GOOD_TOLERANCE };
        held_out(fit).is_some_and(|px| px <= most * least)
    };
    let simplest = || fits.iter().position(|(_, trial)| all_fold || !trial.is_non_monotonic);
    fits.iter().rposition(is_as_good).or_else(simplest)
}

/// A fit with a given lens, by way of the simpler ones.
#[cfg(test)]
pub(super) fn up_to(views: &CalibrationData, lens: Lens) -> Option<(BundleFit, LensTrial)> {
    fits(views, lens).pop().filter(|(_, trial)| trial.free.lens == Some(lens))
}

fn is_bent(views: &CalibrationData, fit: &BundleFit, free: FreeParameters) -> bool {
    let variance = views.noise_variance_px2(fit, free);
    let Some(spreads) = views.unit_sigmas(fit, free) else { return false };
    let sigma = |side: usize| spreads[SHARED - 2 + side] * variance.sqrt();
    (0..2).any(|side| fit.model.bend_mm[side].abs() > MIN_BEND_SIGMAS * sigma(side))
}

fn trial(views: &CalibrationData, fit: &BundleFit, free: FreeParameters) -> LensTrial {
    LensTrial {
        free,
        rms_px: views.rms_px(fit.sum_of_squares_px2),
        cross_validation_px: cross_validation_px(views, fit, free),
        is_non_monotonic: fit.model.camera.non_monotonic_at(views.size).is_some(),
    }
}

/// Root mean square error of each image with the camera from the others and its own pose fitted
/// \[px\].
///
/// To first order in the change of the camera: at the best fit the gradients of all images add
/// up to 0, so that without image v the camera changes by ds = −(S − Sᵥ)⁻¹gᵥ, with S the
/// information of all images, poses eliminated, and Sᵥ and gᵥ those of the image. Its squared
/// errors are |r|² + 2 gᵥᵀ(S − Sᵥ)⁻¹gᵥ + dsᵀSᵥds.
fn cross_validation_px(
    views: &CalibrationData,
    fit: &BundleFit,
    free: FreeParameters,
) -> Option<f64> {
    let each = ViewInformation::all(views, fit, free)?;
    let all: SMatrix<f64, SHARED, SHARED> = each.iter().map(|one| one.information).sum();
    let mut squares = 0.0;
    for ViewInformation { information: left, score, sum_of_squares_px2: squares_px2 } in each {
        let rest = Factor::of_shared(&restrict_to_free(all - left, free))?;
        let moved = rest.solve(&DVector::from_column_slice(score.as_slice()));
        let moved = SVector::<f64, SHARED>::from_fn(|row, _| moved[row]);
        squares += squares_px2 + 2.0 * score.dot(&moved) + (moved.transpose() * left * moved)[0];
    }
    Some(views.rms_px(squares))
}
