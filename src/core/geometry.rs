//! Points, rectangles and the pose of a plane. Pixel (0, 0) is the centre of
//! the top-left pixel; x runs right, y runs down.

use nalgebra::{Point2, Point3, Rotation3, UnitQuaternion, Vector3};

/// A point in the image \[px\].
pub type ImagePoint = Point2<f64>;
/// A point on a surface parallel to the bed, in the bed's axes \[mm\].
pub type SurfacePoint = Point2<f64>;

/// Size of an image \[px\].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Size {
    /// From the numbers of columns and rows.
    pub const fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }
}

/// Columns and rows of a grid, such as the corners of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridSize {
    /// Number of columns.
    pub columns: usize,
    /// Number of rows.
    pub rows: usize,
}

impl GridSize {
    /// From the numbers of columns and rows.
    pub const fn new(columns: usize, rows: usize) -> Self {
        Self { columns, rows }
    }
}

/// Region of interest: whole pixels of the image, `x..x + width` by
/// `y..y + height`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Roi {
    /// Leftmost column.
    pub x: usize,
    /// Topmost row.
    pub y: usize,
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
}

impl Roi {
    /// Whether every pixel of it lies in an image of this size.
    pub fn fits(&self, size: Size) -> bool {
        self.x.saturating_add(self.width) <= size.width
            && self.y.saturating_add(self.height) <= size.height
    }
}

/// Where one frame of reference lies in another: `p_outer = R · p_inner + t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    rotation: Rotation3<f64>,
    translation: Vector3<f64>,
}

impl Pose {
    /// From a Rodrigues vector \[rad\] and a translation \[mm\].
    pub fn new(rotation_rad: Vector3<f64>, translation_mm: Vector3<f64>) -> Self {
        Self { rotation: Rotation3::new(rotation_rad), translation: translation_mm }
    }

    /// Transforms a point from the inner frame to the outer one \[mm\].
    pub fn apply(&self, inner: Point3<f64>) -> Point3<f64> {
        self.rotation * inner + self.translation
    }

    /// Transforms a point from the outer frame to the inner one \[mm\].
    pub fn apply_inverse(&self, outer: Point3<f64>) -> Point3<f64> {
        self.rotation.inverse() * (outer - self.translation)
    }

    /// Rotates a direction from the outer frame to the inner one.
    pub fn turn_inverse(&self, outer: Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse() * outer
    }

    /// From a rotation and a translation \[mm\].
    pub fn from_parts(rotation: Rotation3<f64>, translation_mm: Vector3<f64>) -> Self {
        Self { rotation, translation: translation_mm }
    }

    /// The rotation as a Rodrigues vector \[rad\]. Computed from a quaternion: the skew part of a
    /// matrix of half a turn, as of a camera that looks straight down, is zero and gives no axis.
    pub fn rotation_rad(&self) -> Vector3<f64> {
        UnitQuaternion::from_rotation_matrix(&self.rotation).scaled_axis()
    }

    /// The rotation.
    pub fn rotation(&self) -> Rotation3<f64> {
        self.rotation
    }

    /// Origin of the inner frame in the outer one \[mm\].
    pub fn translation_mm(&self) -> Vector3<f64> {
        self.translation
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_rodrigues_vector_is_read_back_up_to_half_a_turn() {
        for turn in
            [[0.0; 3], [PI, 0.0, 0.0], [1e-9, 0.0, 0.0], [2.9, 0.1, -0.05], [0.0, -2.0, 1.0]]
        {
            let turn = Vector3::from(turn);
            let back = Pose::new(turn, Vector3::zeros()).rotation_rad();
            let same = (back - turn).norm().min((back + turn).norm() + (turn.norm() - PI).abs());
            assert!(same < 1e-12, "{turn} came back as {back}");
        }
    }
}
