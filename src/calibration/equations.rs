//! The normal equations of boards before a camera: how every corner's place in
//! the picture answers to the camera, to the board's bend and to where the board
//! lies, summed over the corners, with the poses eliminated (the Schur
//! complement; Triggs et al. 2000, *Bundle adjustment – a modern synthesis*,
//! section 6.1).

use nalgebra::{
    Cholesky, DMatrix, DVector, Dyn, Matrix2x3, Matrix3, Point2, Point3, Rotation3, SMatrix,
    SVector, Vector3,
};

use super::Camera;
use super::camera::{NUMBERS, Projection};
use super::lens::Lens;
use crate::core::geometry::{ImagePoint, Pose};

/// What all pictures share: the camera's numbers and two for the board's bend.
pub const SHARED: usize = NUMBERS + 2;
/// Numbers of a pose: a turn about the camera's axes \[rad\], then a shift \[mm\].
pub const POSE: usize = 6;
/// Numbers of a further board on the same plane: a shift along its two axes \[mm\]
/// and a turn within it \[rad\].
pub const ON_PLANE: usize = 3;
const BOTH: usize = POSE + ON_PLANE;
/// Share of a number's standard deviation, the others being known, below which the
/// pictures do not tell it from the others.
const LEAST_APART: f64 = 1e-5;

/// One corner of a board and where it is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Where it is on a flat board \[mm\].
    pub on_board: Point2<f64>,
    /// How far it rises out of the board's plane for each millimetre of bend along
    /// its rows and along its columns.
    pub bend: [f64; 2],
    /// Where it is seen \[px\].
    pub seen: ImagePoint,
}

/// A camera, and the bend of the board that it saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// The camera.
    pub camera: Camera,
    /// How far the middle of a board stands out of the plane through it, against the
    /// middles of its sides, along its rows and along its columns \[mm\].
    pub bend_mm: [f64; 2],
}

/// Which of the shared numbers are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Free {
    /// The lens, with focal lengths and principal point; `None` where the camera is
    /// known.
    pub lens: Option<Lens>,
    /// Whether the board's bend is fitted.
    pub bend: bool,
}

/// Where boards lie: one, or several on one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Axes of the first board in the camera's.
    pub pose: Pose,
    /// Where the others lie on its plane: a shift along its axes \[mm\] and a turn
    /// \[rad\].
    pub others: Vec<[f64; ON_PLANE]>,
}

/// The equations of one place; the right-hand sides are those of what is left
/// between seen and expected.
#[derive(Debug, Clone)]
pub struct Equations {
    /// Of what all pictures share.
    pub shared: SMatrix<f64, SHARED, SHARED>,
    /// Right-hand side for it.
    pub shared_side: SVector<f64, SHARED>,
    /// Of the place alone.
    pub place: DMatrix<f64>,
    /// Right-hand side for it.
    pub place_side: DVector<f64>,
    /// Of place and shared numbers together.
    pub both: DMatrix<f64>,
    /// Sum of the squares of what is left \[px²\].
    pub squares_px2: f64,
}

impl Free {
    /// Nothing but the places.
    pub const PLACES: Self = Self { lens: None, bend: false };

    /// Whether one of the shared numbers is fitted.
    pub fn has(self, number: usize) -> bool {
        if number < NUMBERS {
            self.lens.is_some_and(|lens| number < lens.numbers())
        } else {
            self.bend
        }
    }

    /// How many of the shared numbers are fitted.
    pub fn count(self) -> usize {
        (0..SHARED).filter(|&number| self.has(number)).count()
    }
}

impl Model {
    /// With its shared numbers changed by these.
    pub fn stepped(&self, step: &SVector<f64, SHARED>) -> Self {
        let mut numbers = self.camera.numbers();
        for (number, by) in numbers.iter_mut().zip(step) {
            *number += by;
        }
        let bend_mm = [self.bend_mm[0] + step[NUMBERS], self.bend_mm[1] + step[NUMBERS + 1]];
        Self { camera: Camera::from_numbers(numbers), bend_mm }
    }

    /// Where a corner is, in the board's axes \[mm\].
    pub fn on_board(&self, corner: &Corner) -> Point3<f64> {
        let z = self.bend_mm[0] * corner.bend[0] + self.bend_mm[1] * corner.bend[1];
        Point3::new(corner.on_board.x, corner.on_board.y, z)
    }

    /// Sum of the squares of what is left between seen and expected \[px²\]; `None`
    /// behind the camera.
    pub fn squares_px2(&self, place: &Place, boards: &[Vec<Corner>]) -> Option<f64> {
        let mut sum = 0.0;
        for (board, corners) in boards.iter().enumerate() {
            let pose = place.of_board(board);
            for corner in corners {
                let at = self.camera.project(pose.apply(self.on_board(corner)))?;
                sum += (corner.seen - at).norm_squared();
            }
        }
        Some(sum)
    }
}

impl Place {
    /// Of a single board.
    pub fn of_one(pose: Pose) -> Self {
        Self { pose, others: Vec::new() }
    }

    /// Axes of one of the boards in the camera's.
    pub fn of_board(&self, board: usize) -> Pose {
        let Some([x, y, turn]) = board.checked_sub(1).and_then(|i| self.others.get(i)) else {
            return self.pose;
        };
        let on_plane = Vector3::new(*x, *y, 0.0);
        let rotation = self.pose.rotation();
        Pose::from_parts(
            rotation * Rotation3::from_axis_angle(&Vector3::z_axis(), *turn),
            rotation * on_plane + self.pose.translation_mm(),
        )
    }

    /// With its numbers changed by these.
    pub fn stepped(&self, step: &DVector<f64>) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0));
        let shift = step.fixed_rows::<3>(3);
        let others = self.others.iter().enumerate().map(|(i, other)| {
            let by = step.fixed_rows::<ON_PLANE>(POSE + ON_PLANE * i);
            [other[0] + by[0], other[1] + by[1], other[2] + by[2]]
        });
        Self {
            pose: Pose::from_parts(turn * self.pose.rotation(), self.pose.translation_mm() + shift),
            others: others.collect(),
        }
    }

    /// How many numbers it has.
    pub fn numbers(&self) -> usize {
        POSE + ON_PLANE * self.others.len()
    }
}

impl Equations {
    /// Of the boards at a place, a list of corners each. `None` where one is behind
    /// the camera.
    pub fn of(model: &Model, free: Free, place: &Place, boards: &[Vec<Corner>]) -> Option<Self> {
        let mut sums = Self {
            shared: SMatrix::zeros(),
            shared_side: SVector::zeros(),
            place: DMatrix::zeros(place.numbers(), place.numbers()),
            place_side: DVector::zeros(place.numbers()),
            both: DMatrix::zeros(place.numbers(), SHARED),
            squares_px2: 0.0,
        };
        for (board, corners) in boards.iter().enumerate() {
            sums.add_board(model, free, place, board, corners)?;
        }
        Some(sums)
    }

    fn add_board(
        &mut self,
        model: &Model,
        free: Free,
        place: &Place,
        board: usize,
        corners: &[Corner],
    ) -> Option<()> {
        let pose = place.of_board(board);
        let mut own = SMatrix::<f64, BOTH, BOTH>::zeros();
        let mut own_side = SVector::<f64, BOTH>::zeros();
        let mut both = SMatrix::<f64, BOTH, SHARED>::zeros();
        for corner in corners {
            let on_board = model.on_board(corner);
            let projection = model.camera.project_with_slopes(pose.apply(on_board))?;
            let left = corner.seen - projection.at;
            let of_shared = of_shared(&projection, &pose, corner, free);
            let of_place = of_place(&projection, place, &pose, on_board, board > 0);
            self.squares_px2 += left.norm_squared();
            self.shared += of_shared.transpose() * of_shared;
            self.shared_side += of_shared.transpose() * left;
            own += of_place.transpose() * of_place;
            own_side += of_place.transpose() * left;
            both += of_place.transpose() * of_shared;
        }
        // The pose of the first board is that of all; each further one has its own
        // numbers besides.
        let index = |i: usize| if i < POSE { i } else { i + ON_PLANE * board - ON_PLANE };
        let numbers = if board == 0 { POSE } else { BOTH };
        for i in 0..numbers {
            self.place_side[index(i)] += own_side[i];
            for j in 0..numbers {
                self.place[(index(i), index(j))] += own[(i, j)];
            }
            for j in 0..SHARED {
                self.both[(index(i), j)] += both[(i, j)];
            }
        }
        Some(())
    }
}

/// How a corner's place in the picture answers to the shared numbers.
fn of_shared(
    projection: &Projection,
    pose: &Pose,
    corner: &Corner,
    free: Free,
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

/// How it answers to the pose and, on a further board, to that board's own numbers.
fn of_place(
    projection: &Projection,
    place: &Place,
    pose: &Pose,
    on_board: Point3<f64>,
    is_further: bool,
) -> SMatrix<f64, 2, BOTH> {
    let of_point: Matrix2x3<f64> = projection.of_point;
    let mut slopes = SMatrix::<f64, 2, BOTH>::zeros();
    // The pose turns about the first board's origin.
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

/// The equations of one place with its own numbers eliminated.
#[derive(Debug, Clone)]
pub struct Elimination {
    /// What the picture says of the shared numbers, the place being free.
    pub left: SMatrix<f64, SHARED, SHARED>,
    /// What it says of the place, the shared numbers being known.
    pub place: Factor,
    /// How the place answers to the shared numbers, whitened.
    pub follows: DMatrix<f64>,
}

impl Elimination {
    /// `None` where the corners do not fix the place.
    pub fn of(equations: &Equations) -> Option<Self> {
        let place = Factor::of(&equations.place)?;
        let follows = place.whiten(&equations.both);
        let left = equations.shared - as_shared(&(follows.transpose() * &follows));
        Some(Self { left, place, follows })
    }
}

/// A matrix between shared numbers, of fixed size.
fn as_shared(matrix: &DMatrix<f64>) -> SMatrix<f64, SHARED, SHARED> {
    SMatrix::from_fn(|row, column| matrix[(row, column)])
}

/// A positive definite matrix M, as what makes xᵀM⁻¹x a sum of squares. Numbers
/// whose row and column are 0 are known: they have no variance.
#[derive(Debug, Clone)]
pub struct Factor {
    /// Scales the matrix to a diagonal of ones.
    unit: DVector<f64>,
    /// Cholesky factor of the scaled matrix.
    lower: Cholesky<f64, Dyn>,
}

impl Factor {
    /// `None` for a matrix that is not positive definite, or nearly so.
    pub fn of(matrix: &DMatrix<f64>) -> Option<Self> {
        let unit = matrix.diagonal().map(|on| if on == 0.0 { 0.0 } else { 1.0 / on.sqrt() });
        let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
            if row == column { 1.0 } else { matrix[(row, column)] * unit[row] * unit[column] }
        });
        let lower = Cholesky::new(scaled)?;
        let apart = lower.l_dirty().diagonal().iter().all(|&on| on > LEAST_APART);
        apart.then_some(Self { unit, lower })
    }

    /// The same for shared numbers.
    pub fn of_shared(matrix: &SMatrix<f64, SHARED, SHARED>) -> Option<Self> {
        Self::of(&DMatrix::from_fn(SHARED, SHARED, |row, column| matrix[(row, column)]))
    }

    /// Columns whose squares sum up to those of x in xᵀM⁻¹x.
    pub fn whiten(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = x.clone();
        for (mut row, unit) in scaled.row_iter_mut().zip(&self.unit) {
            row *= *unit;
        }
        self.lower.l_dirty().solve_lower_triangular_unchecked(&scaled)
    }

    /// M⁻¹x.
    pub fn solve(&self, x: &DVector<f64>) -> DVector<f64> {
        self.lower.solve(&x.component_mul(&self.unit)).component_mul(&self.unit)
    }

    /// Variances of the numbers, in units of the noise's variance.
    pub fn variances(&self) -> DVector<f64> {
        let whitened = self.whiten(&DMatrix::identity(self.unit.len(), self.unit.len()));
        DVector::from_iterator(
            self.unit.len(),
            whitened.column_iter().map(|column| column.norm_squared()),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::synthetic::TRUTH;

    fn corners() -> Vec<Corner> {
        let at = |i: u32, j: u32| Point2::new(f64::from(i) * 20.0, f64::from(j) * 20.0);
        (0..12)
            .map(|k| {
                let bend = [0.3 - 0.1 * f64::from(k % 4), 0.2 - 0.1 * f64::from(k / 4)];
                let seen = Point2::new(300.0 + f64::from(k), 200.0 - f64::from(k));
                Corner { on_board: at(k % 4, k / 4), bend, seen }
            })
            .collect()
    }

    fn scene() -> (Model, Place) {
        let mut camera = TRUTH;
        camera.distortion[5..].copy_from_slice(&[0.03, -0.02, 0.05]);
        let pose = Pose::new(Vector3::new(0.3, -0.2, 0.1), Vector3::new(-60.0, -40.0, 400.0));
        let place = Place { pose, others: vec![[30.0, -20.0, 0.4], [-50.0, 10.0, -1.0]] };
        (Model { camera, bend_mm: [1.5, -0.7] }, place)
    }

    /// Right-hand sides are half the gradient of the squares, downwards.
    #[test]
    fn right_hand_sides_are_the_gradient_of_the_squares() {
        let (model, place) = scene();
        let boards = [corners(), corners(), corners()];
        let free = Free { lens: Some(Lens::Rational), bend: true };
        let equations = Equations::of(&model, free, &place, &boards).unwrap();
        let squares = |model: &Model, place: &Place| model.squares_px2(place, &boards).unwrap();
        assert!((equations.squares_px2 / squares(&model, &place) - 1.0).abs() < 1e-12);
        let step = 1e-5;
        for number in 0..SHARED {
            let mut by = SVector::zeros();
            by[number] = step;
            let up = squares(&model.stepped(&by), &place);
            let down = squares(&model.stepped(&-by), &place);
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
            let up = squares(&model, &place.stepped(&by));
            let down = squares(&model, &place.stepped(&-by));
            let slope = -(up - down) / (4.0 * step);
            let found = equations.place_side[number];
            assert!(
                (slope - found).abs() < 1e-4 * found.abs().max(1.0),
                "{number}: {slope} {found}"
            );
        }
    }

    #[test]
    fn what_is_not_free_is_known() {
        let (model, place) = scene();
        let free = Free { lens: Some(Lens::Two), bend: false };
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
