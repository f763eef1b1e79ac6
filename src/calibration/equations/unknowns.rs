//! Parameters of a calibration: the camera, the bend of the board, and the poses of the boards.

use nalgebra::{DVector, Point2, Point3, Rotation3, SMatrix, SVector, Vector3};

use crate::calibration::Camera;
use crate::calibration::camera::NUMBERS;
use crate::calibration::lens::Lens;
use crate::core::{ImagePoint, Pose};

/// Parameters that all images share: those of the camera and two of the bend.
pub const SHARED: usize = NUMBERS + 2;
/// Parameters of a pose. By definition: a rotation about the camera's axes \[rad\] and a shift
/// \[mm\].
pub const POSE: usize = 6;
/// Parameters of a further board on the same plane. By definition: a shift along its two axes
/// \[mm\] and a rotation within it \[rad\].
pub const ON_PLANE: usize = 3;

/// A corner of a board and its observed position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correspondence {
    /// Position on a flat board \[mm\].
    pub on_board: Point2<f64>,
    /// Height over the plane of the board for each millimetre of bend along its rows and along
    /// its columns.
    pub bend: [f64; 2],
    /// Observed position \[px\].
    pub observed: ImagePoint,
}

/// A camera, and the bend of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraModel {
    /// The camera.
    pub camera: Camera,
    /// Height of the middle of the board over the line between the middles of opposite sides,
    /// along its rows and along its columns \[mm\].
    pub bend_mm: [f64; 2],
}

/// The shared parameters that are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeParameters {
    /// The lens, with focal lengths and principal point; `None` for a known camera.
    pub lens: Option<Lens>,
    /// Whether the bend of the board is fitted.
    pub bend: bool,
}

/// Pose of a board, or of several boards on one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardPlacement {
    /// Axes of the first board in those of the camera.
    pub pose: Pose,
    /// Positions of the other boards on its plane: a shift along its axes \[mm\] and a rotation
    /// \[rad\].
    pub others: Vec<[f64; ON_PLANE]>,
}

impl FreeParameters {
    /// The poses only.
    pub const PLACEMENTS: Self = Self { lens: None, bend: false };

    /// Whether a shared parameter is fitted.
    pub fn has(self, number: usize) -> bool {
        if number < NUMBERS {
            self.lens.is_some_and(|lens| number < lens.numbers())
        } else {
            self.bend
        }
    }

    /// Number of shared parameters that are fitted.
    pub fn count(self) -> usize {
        (0..SHARED).filter(|&number| self.has(number)).count()
    }
}

impl CameraModel {
    /// With a step of the shared parameters.
    pub fn moved(&self, step: &SVector<f64, SHARED>) -> Self {
        let mut numbers = self.camera.numbers();
        for (number, by) in numbers.iter_mut().zip(step) {
            *number += by;
        }
        let bend_mm = [self.bend_mm[0] + step[NUMBERS], self.bend_mm[1] + step[NUMBERS + 1]];
        Self { camera: Camera::from_numbers(numbers), bend_mm }
    }

    /// Position of a corner in the axes of the board \[mm\].
    pub fn on_board(&self, corner: &Correspondence) -> Point3<f64> {
        let z = self.bend_mm[0] * corner.bend[0] + self.bend_mm[1] * corner.bend[1];
        Point3::new(corner.on_board.x, corner.on_board.y, z)
    }

    /// Sum of the squared reprojection errors \[px²\]; `None` behind the camera.
    pub fn sum_of_squares_px2(
        &self,
        position: &BoardPlacement,
        boards: &[Vec<Correspondence>],
    ) -> Option<f64> {
        let mut sum = 0.0;
        for (board, corners) in boards.iter().enumerate() {
            let pose = position.of_board(board);
            for corner in corners {
                let at = self.camera.project(pose.apply(self.on_board(corner)))?;
                sum += (corner.observed - at).norm_squared();
            }
        }
        Some(sum)
    }
}

impl BoardPlacement {
    /// The placement of a single board.
    pub fn of_one(pose: Pose) -> Self {
        Self { pose, others: Vec::new() }
    }

    /// Axes of one of the boards in those of the camera.
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

    /// With a step of its parameters.
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

    /// Number of its parameters.
    pub fn numbers(&self) -> usize {
        POSE + ON_PLANE * self.others.len()
    }
}

/// Equations of the shared parameters with zero rows and columns for those that are fixed.
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
