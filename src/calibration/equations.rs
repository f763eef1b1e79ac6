//! Normal equations of boards before a camera: derivatives of the corners' positions with the
//! camera, the bend of the board and the poses, summed over the corners (Triggs et al. 2000,
//! *Bundle adjustment – a modern synthesis*, section 6.1).

mod unknowns;

pub use unknowns::{
    BoardPlacement, CameraModel, Correspondence, FreeParameters, ON_PLANE, POSE, SHARED,
    restrict_to_free,
};

use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix3, Point3, SMatrix, SVector, Vector3};

use super::camera::{NUMBERS, Projection};
use crate::core::Pose;

const PLACEMENT_PARAMETERS: usize = POSE + ON_PLANE;
/// Normal equations of one placement, with the reprojection errors on the right-hand side.
#[derive(Debug, Clone)]
pub struct Equations {
    /// Block of the shared parameters.
    pub shared: SMatrix<f64, SHARED, SHARED>,
    /// Right-hand side of the shared parameters.
    pub shared_side: SVector<f64, SHARED>,
    /// Block of the placement.
    pub placement: DMatrix<f64>,
    /// Right-hand side of the placement.
    pub placement_side: DVector<f64>,
    /// Mixed block of placement and shared parameters.
    pub both: DMatrix<f64>,
    /// Sum of the squared reprojection errors \[px²\].
    pub sum_of_squares_px2: f64,
}

impl Equations {
    /// For the boards of one placement, a list of corners each. `None` where a corner is behind
    /// the camera.
    pub fn of(
        model: &CameraModel,
        free: FreeParameters,
        place: &BoardPlacement,
        boards: &[Vec<Correspondence>],
    ) -> Option<Self> {
        let mut sums = Self {
            shared: SMatrix::zeros(),
            shared_side: SVector::zeros(),
            placement: DMatrix::zeros(place.numbers(), place.numbers()),
            placement_side: DVector::zeros(place.numbers()),
            both: DMatrix::zeros(place.numbers(), SHARED),
            sum_of_squares_px2: 0.0,
        };
        for (board, corners) in boards.iter().enumerate() {
            sums.add_board(model, free, place, board, corners)?;
        }
        Some(sums)
    }

    fn add_board(
        &mut self,
        model: &CameraModel,
        free: FreeParameters,
        place: &BoardPlacement,
        board: usize,
        corners: &[Correspondence],
    ) -> Option<()> {
        let pose = place.of_board(board);
        let mut own = SMatrix::<f64, PLACEMENT_PARAMETERS, PLACEMENT_PARAMETERS>::zeros();
        let mut own_side = SVector::<f64, PLACEMENT_PARAMETERS>::zeros();
        let mut both = SMatrix::<f64, PLACEMENT_PARAMETERS, SHARED>::zeros();
        for corner in corners {
            let on_board = model.on_board(corner);
            let projection = model.camera.project_with_slopes(pose.apply(on_board))?;
            let left = corner.observed - projection.at;
            let of_shared = of_shared(&projection, &pose, corner, free);
            let of_place = of_place(&projection, place, &pose, on_board, board > 0);
            self.sum_of_squares_px2 += left.norm_squared();
            self.shared += of_shared.transpose() * of_shared;
            self.shared_side += of_shared.transpose() * left;
            own += of_place.transpose() * of_place;
            own_side += of_place.transpose() * left;
            both += of_place.transpose() * of_shared;
        }
        // The pose of the first board applies to all; each further one has parameters of its
        // own.
        let index = |i: usize| if i < POSE { i } else { i + ON_PLANE * board - ON_PLANE };
        let numbers = if board == 0 { POSE } else { PLACEMENT_PARAMETERS };
        for i in 0..numbers {
            self.placement_side[index(i)] += own_side[i];
            for j in 0..numbers {
                self.placement[(index(i), index(j))] += own[(i, j)];
            }
            for j in 0..SHARED {
                self.both[(index(i), j)] += both[(i, j)];
            }
        }
        Some(())
    }
}

/// Derivative of a corner's position in the image with the shared parameters.
fn of_shared(
    projection: &Projection,
    pose: &Pose,
    corner: &Correspondence,
    free: FreeParameters,
) -> SMatrix<f64, 2, SHARED> {
    let mut slopes = SMatrix::<f64, 2, SHARED>::zeros();
    slopes.fixed_columns_mut::<NUMBERS>(0).copy_from(&projection.of_camera);
    if free.bend {
        let up = projection.of_point * (pose.rotation() * Vector3::z());
        slopes.set_column(NUMBERS, &(up * corner.bend[0]));
        slopes.set_column(NUMBERS + 1, &(up * corner.bend[1]));
    }
    for number in (0..NUMBERS).filter(|&number| !free.has(number)) {
        slopes.column_mut(number).fill(0.0);
    }
    slopes
}

/// Derivative with the pose and, on a further board, with that board's own parameters.
fn of_place(
    projection: &Projection,
    place: &BoardPlacement,
    pose: &Pose,
    on_board: Point3<f64>,
    is_further: bool,
) -> SMatrix<f64, 2, PLACEMENT_PARAMETERS> {
    let of_point: Matrix2x3<f64> = projection.of_point;
    let mut slopes = SMatrix::<f64, 2, PLACEMENT_PARAMETERS>::zeros();
    // The pose rotates about the origin of the first board.
    let from_origin = pose.apply(on_board) - Point3::from(place.pose.translation_mm());
    let turned: Matrix3<f64> = -from_origin.cross_matrix();
    slopes.fixed_columns_mut::<3>(0).copy_from(&(of_point * turned));
    slopes.fixed_columns_mut::<3>(3).copy_from(&of_point);
    if is_further {
        let axes = place.pose.rotation();
        slopes.set_column(POSE, &(of_point * (axes * Vector3::x())));
        slopes.set_column(POSE + 1, &(of_point * (axes * Vector3::y())));
        let about_own = pose.rotation() * on_board.coords;
        let up = axes * Vector3::z();
        slopes.set_column(POSE + 2, &(of_point * up.cross(&about_own)));
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::factor::Factor;
    use crate::calibration::lens::Lens;
    use crate::calibration::synthetic::TRUTH;
    use nalgebra::Point2;

    fn corners() -> Vec<Correspondence> {
        let at = |i: u32, j: u32| Point2::new(f64::from(i) * 20.0, f64::from(j) * 20.0);
        (0..12)
            .map(|k| {
                let bend = [0.3 - 0.1 * f64::from(k % 4), 0.2 - 0.1 * f64::from(k / 4)];
                let seen = Point2::new(300.0 + f64::from(k), 200.0 - f64::from(k));
                Correspondence { on_board: at(k % 4, k / 4), bend, observed: seen }
            })
            .collect()
    }

    fn scene() -> (CameraModel, BoardPlacement) {
        let mut camera = TRUTH;
        camera.distortion[5..].copy_from_slice(&[0.03, -0.02, 0.05]);
        let pose = Pose::new(Vector3::new(0.3, -0.2, 0.1), Vector3::new(-60.0, -40.0, 400.0));
        let place = BoardPlacement { pose, others: vec![[30.0, -20.0, 0.4], [-50.0, 10.0, -1.0]] };
        (CameraModel { camera, bend_mm: [1.5, -0.7] }, place)
    }

    /// Right-hand sides are half the gradient of the squares, downwards.
    #[test]
    fn right_hand_sides_are_the_gradient_of_the_squares() {
        let (model, place) = scene();
        let boards = [corners(), corners(), corners()];
        let free = FreeParameters { lens: Some(Lens::Rational), bend: true };
        let equations = Equations::of(&model, free, &place, &boards).unwrap();
        let squares = |model: &CameraModel, place: &BoardPlacement| {
            model.sum_of_squares_px2(place, &boards).unwrap()
        };
        assert!((equations.sum_of_squares_px2 / squares(&model, &place) - 1.0).abs() < 1e-12);
        let step = 1e-5;
        for number in 0..SHARED {
            let mut by = SVector::zeros();
            by[number] = step;
            let up = squares(&model.moved(&by), &place);
            let down = squares(&model.moved(&-by), &place);
            let slope = -(up - down) / (4.0 * step);
            let found = equations.shared_side[number];
            assert!(
                (slope - found).abs() < 1e-4 * found.abs().max(1.0),
                "{number}: {slope} {found}"
            );
        }
        for number in 0..place.numbers() {
            let mut by = DVector::zeros(place.numbers());
            by[number] = step;
            let up = squares(&model, &place.moved(&by));
            let down = squares(&model, &place.moved(&-by));
            let slope = -(up - down) / (4.0 * step);
            let found = equations.placement_side[number];
            assert!(
                (slope - found).abs() < 1e-4 * found.abs().max(1.0),
                "{number}: {slope} {found}"
            );
        }
    }

    #[test]
    fn what_is_not_free_is_known() {
        let (model, place) = scene();
        let free = FreeParameters { lens: Some(Lens::Two), bend: false };
        let boards = [corners(), corners(), corners()];
        let equations = Equations::of(&model, free, &place, &boards).unwrap();
        assert_eq!(free.count(), 6);
        for number in (0..SHARED).filter(|&number| !free.has(number)) {
            assert_eq!(equations.shared[(number, number)], 0.0);
            assert_eq!(equations.shared_side[number], 0.0);
        }
        let matrix = DMatrix::from_row_slice(3, 3, &[4.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0]);
        let variances = Factor::of(&matrix).unwrap().variances();
        let inverse = nalgebra::Matrix2::new(4.0, 1.0, 1.0, 1.0).try_inverse().unwrap();
        assert!((variances[0] - inverse[(0, 0)]).abs() < 1e-12);
        assert!((variances[2] - inverse[(1, 1)]).abs() < 1e-12);
        assert_eq!(variances[1], 0.0);
    }
}
