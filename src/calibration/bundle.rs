//! Bundle adjustment: camera, bend of the board and poses of the boards that minimise the
//! squared reprojection errors (Triggs et al. 2000, *Bundle adjustment – a modern synthesis*),
//! by the Levenberg-Marquardt method with the poses eliminated from the normal equations.

use nalgebra::{DVector, SMatrix, SVector};

use super::equations::{
    BoardPlacement, CameraModel, Correspondence, Equations, FreeParameters, SHARED,
};
use super::factor::{Elimination, Factor};
use crate::numeric::levenberg_marquardt::Damping;

/// Limit of accepted steps; a fit that needs more does not converge.
const MAX_STEPS: usize = 100;
/// Damping beyond which steps are too short to lower the sum of squares.
const MAX_DAMPING: f64 = 1e12;
/// Smallest relative decrease of the sum of squares for which another step is taken: above the
/// rounding of the sum.
const MIN_RELATIVE_GAIN: f64 = 1e-13;

/// Initial values of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// The camera and the board's bend.
    pub model: CameraModel,
    /// Poses of the boards, in the order of the images.
    pub placements: Vec<BoardPlacement>,
}

/// Result of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct BundleFit {
    /// The camera and the board's bend.
    pub model: CameraModel,
    /// Poses of the boards, in the order of the images.
    pub placements: Vec<BoardPlacement>,
    /// Sum of the squared reprojection errors \[px²\].
    pub sum_of_squares_px2: f64,
}

/// A step of all parameters.
struct Step {
    shared: SVector<f64, SHARED>,
    placements: Vec<DVector<f64>>,
}

/// Fits the free parameters to the corners of the boards, a list of boards for each placement.
/// `None` where a board of the initial guess is behind the camera, or a parameter is not
/// finite.
pub fn fit(
    start: Guess,
    free: FreeParameters,
    boards: &[Vec<Vec<Correspondence>>],
) -> Option<BundleFit> {
    let Guess { model, placements } = start;
    let sum_of_squares_px2 = sum_of_squares_px2(&model, &placements, boards)?;
    let mut best = BundleFit { model, placements, sum_of_squares_px2 };
    let mut damping = Damping::up_to(MAX_DAMPING);
    for _ in 0..MAX_STEPS {
        let equations = equations(&best, free, boards)?;
        let Some((next, is_last)) = descend(&best, free, &equations, boards, &mut damping) else {
            break;
        };
        best = next;
        if is_last {
            break;
        }
    }
    best.model.camera.numbers().iter().all(|number| number.is_finite()).then_some(best)
}

/// The next better fit, and whether its gain is negligible; `None` where no step lowers the sum
/// of squares.
fn descend(
    from: &BundleFit,
    free: FreeParameters,
    equations: &[Equations],
    boards: &[Vec<Vec<Correspondence>>],
    damping: &mut Damping,
) -> Option<(BundleFit, bool)> {
    let next = damping.descend(usize::MAX, |damping| {
        let step = step(equations, free, damping)?;
        let model = from.model.moved(&step.shared);
        let moved = from.placements.iter().zip(&step.placements).map(|(one, by)| one.moved(by));
        let placements: Vec<BoardPlacement> = moved.collect();
        let sum_of_squares_px2 = sum_of_squares_px2(&model, &placements, boards)?;
        let is_lower = sum_of_squares_px2 <= from.sum_of_squares_px2;
        is_lower.then_some(BundleFit { model, placements, sum_of_squares_px2 })
    })?;
    let gain_px2 = from.sum_of_squares_px2 - next.sum_of_squares_px2;
    Some((next, gain_px2 <= MIN_RELATIVE_GAIN * from.sum_of_squares_px2))
}

fn sum_of_squares_px2(
    model: &CameraModel,
    placements: &[BoardPlacement],
    boards: &[Vec<Vec<Correspondence>>],
) -> Option<f64> {
    let each = placements.iter().zip(boards);
    let each = each.map(|(placement, boards)| model.sum_of_squares_px2(placement, boards));
    each.sum::<Option<f64>>().filter(|squares| squares.is_finite())
}

fn equations(
    at: &BundleFit,
    free: FreeParameters,
    boards: &[Vec<Vec<Correspondence>>],
) -> Option<Vec<Equations>> {
    let each = at.placements.iter().zip(boards);
    each.map(|(position, boards)| Equations::of(&at.model, free, position, boards)).collect()
}

/// Solves the damped equations, with the placements eliminated.
fn step(equations: &[Equations], free: FreeParameters, damping: f64) -> Option<Step> {
    let mut left = SMatrix::<f64, SHARED, SHARED>::zeros();
    let mut side = SVector::<f64, SHARED>::zeros();
    let mut eliminated = Vec::with_capacity(equations.len());
    for one in equations {
        let mut damped = one.clone();
        for i in 0..damped.placement.nrows() {
            damped.placement[(i, i)] *= 1.0 + damping;
        }
        let elimination = Elimination::of(&damped)?;
        left += elimination.reduced;
        let known = elimination.placement.solve(&damped.placement_side);
        side += damped.shared_side - as_shared(&(damped.both.transpose() * &known));
        eliminated.push((elimination, damped));
    }
    let shared = if free.count() == 0 {
        SVector::zeros()
    } else {
        for i in 0..SHARED {
            let own: f64 = equations.iter().map(|one| one.shared[(i, i)]).sum();
            left[(i, i)] += damping * own;
            // Rows of fixed parameters hold rounding errors only.
            if !free.has(i) {
                left[(i, i)] = 0.0;
            }
        }
        let shared = Factor::of_shared(&left)?.solve(&DVector::from_column_slice(side.as_slice()));
        as_shared(&shared)
    };
    let along = DVector::from_column_slice(shared.as_slice());
    let placement = |(elimination, damped): &(Elimination, Equations)| {
        elimination.placement.solve(&(&damped.placement_side - &damped.both * &along))
    };
    Some(Step { shared, placements: eliminated.iter().map(placement).collect() })
}

fn as_shared(vector: &DVector<f64>) -> SVector<f64, SHARED> {
    SVector::from_fn(|row, _| vector[row])
}
