//! What a calibration may fit: the camera, the bend of the board, and where boards lie.

use nalgebra::{DVector, Point2, Point3, Rotation3, SMatrix, SVector, Vector3};

use crate::calibration::Camera;
use crate::calibration::camera::NUMBERS;
use crate::calibration::lens::Lens;
use crate::core::geometry::{ImagePoint, Pose};

/// What all pictures share: the camera's numbers and two for the board's bend.
pub const SHARED: usize = NUMBERS + 2;
/// Numbers of a pose: a turn about the camera's axes \[rad\], then a shift \[mm\].
pub const POSE: usize = 6;
/// Numbers of a further board on the same plane: a shift along its two axes \[mm\]
/// and a turn within it \[rad\].
pub const ON_PLANE: usize = 3;

/// One corner of a board and where it is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correspondence {
    /// Where it is on a flat board \[mm\].
    pub on_board: Point2<f64>,
    /// How far it rises out of the board's plane for each millimetre of bend along
    /// its rows and along its columns.
    pub bend: [f64; 2],
    /// Where it is seen \[px\].
    pub observed: ImagePoint,
}

/// A camera, and the bend of the board that it saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraModel {
    /// The camera.
    pub camera: Camera,
    /// How far the middle of a board stands out of the plane through it, against the
    /// middles of its sides, along its rows and along its columns \[mm\].
    pub bend_mm: [f64; 2],
}

/// Which of the shared numbers are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeParameters {
    /// The lens, with focal lengths and principal point; `None` where the camera is
    /// known.
    pub lens: Option<Lens>,
    /// Whether the board's bend is fitted.
    pub bend: bool,
}

/// Where boards lie: one, or several on one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardPlacement {
    /// Axes of the first board in the camera's.
    pub pose: Pose,
    /// Where the others lie on its plane: a shift along its axes \[mm\] and a turn
    /// \[rad\].
    pub others: Vec<[f64; ON_PLANE]>,
}

impl FreeParameters {
    /// Nothing but the places.
    pub const PLACEMENTS: Self = Self { lens: None, bend: false };

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

impl CameraModel {
    /// With its shared numbers changed by these.
    pub fn moved(&self, step: &SVector<f64, SHARED>) -> Self {
        let mut numbers = self.camera.numbers();
        for (number, by) in numbers.iter_mut().zip(step) {
            *number += by;
        }
        let bend_mm = [self.bend_mm[0] + step[NUMBERS], self.bend_mm[1] + step[NUMBERS + 1]];
        Self { camera: Camera::from_numbers(numbers), bend_mm }
    }

    /// Where a corner is, in the board's axes \[mm\].
    pub fn on_board(&self, corner: &Correspondence) -> Point3<f64> {
        let z = self.bend_mm[0] * corner.bend[0] + self.bend_mm[1] * corner.bend[1];
        Point3::new(corner.on_board.x, corner.on_board.y, z)
    }

    /// Sum of the squares of what is left between seen and expected \[px²\]; `None`
    /// behind the camera.
    pub fn sum_of_squares_px2(
        &self,
        place: &BoardPlacement,
        boards: &[Vec<Correspondence>],
    ) -> Option<f64> {
        let mut sum = 0.0;
        for (board, corners) in boards.iter().enumerate() {
            let pose = place.of_board(board);
            for corner in corners {
                let at = self.camera.project(pose.apply(self.on_board(corner)))?;
                sum += (corner.observed - at).norm_squared();
            }
        }
        Some(sum)
    }
}

impl BoardPlacement {
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
    pub fn moved(&self, step: &DVector<f64>) -> Self {
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

/// Equations between shared numbers, without what rounding leaves of those that are
/// not free.
pub fn restrict_to_free(
    mut matrix: SMatrix<f64, SHARED, SHARED>,
    free: FreeParameters,
) -> SMatrix<f64, SHARED, SHARED> {
    for number in (0..SHARED).filter(|&number| !free.has(number)) {
        matrix.row_mut(number).fill(0.0);
        matrix.column_mut(number).fill(0.0);
    }
    matrix
}
