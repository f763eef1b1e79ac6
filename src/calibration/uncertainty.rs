//! Covariance of camera and bed plane, and the standard deviation of a length anywhere in the
//! image.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Point3, SMatrix, Vector3};

use super::Camera;
use super::camera::NUMBERS;
use crate::core::{Pose, SurfacePoint};

/// The camera parameters, then a rotation of the bed about the camera's axes at the bed's
/// origin \[rad\] and a shift along them \[mm\].
pub const UNCERTAIN_PARAMETERS: usize = NUMBERS + 6;

/// Names of the rows in a calibration file, in order.
#[rustfmt::skip]
pub const ROWS: [&str; UNCERTAIN_PARAMETERS] = [
    "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6",
    "turn_x", "turn_y", "turn_z", "shift_x", "shift_y", "shift_z",
];

/// Conditional variance of a parameter over its variance below which it counts as rounding. A
/// choice: some hundred times the double precision.
const MIN_PIVOT: f64 = 1e-14;

/// Covariance of camera and bed plane.
pub type JointCovariance = SMatrix<f64, UNCERTAIN_PARAMETERS, UNCERTAIN_PARAMETERS>;

/// Jacobian of a point on a surface with respect to the parameters of camera and bed \[mm per unit\].
pub type SurfaceSlopes = SMatrix<f64, 2, UNCERTAIN_PARAMETERS>;

/// The covariance of camera and bed plane as its lower triangular factor L: the covariance is
/// L·Lᵀ. A known parameter has a row of zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationUncertainty {
    factor: JointCovariance,
}

impl CalibrationUncertainty {
    /// From a covariance with zero rows and columns for known parameters.
    pub fn of(covariance: &JointCovariance) -> Self {
        let mut factor = JointCovariance::zeros();
        for row in 0..UNCERTAIN_PARAMETERS {
            for column in 0..=row {
                let known: f64 = (0..column).map(|k| factor[(row, k)] * factor[(column, k)]).sum();
                let rest = covariance[(row, column)] - known;
                if row == column {
                    let is_rounding = rest <= MIN_PIVOT * covariance[(row, row)];
                    factor[(row, row)] = if is_rounding { 0.0 } else { rest.sqrt() };
                } else if factor[(column, column)] > 0.0 {
                    factor[(row, column)] = rest / factor[(column, column)];
                }
            }
        }
        Self { factor }
    }

    /// From the factor's rows, each as long as its number counted from 1; empty for a known
    /// parameter. `None` for rows of another length.
    pub fn from_rows(rows: &[Vec<f64>; UNCERTAIN_PARAMETERS]) -> Option<Self> {
        let mut factor = JointCovariance::zeros();
        for (row, values) in rows.iter().enumerate() {
            if !values.is_empty() && values.len() != row + 1 {
                return None;
            }
            for (column, value) in values.iter().enumerate() {
                factor[(row, column)] = *value;
            }
        }
        Some(Self { factor })
    }

    /// The factor's rows up to the diagonal with their names, without those of known
    /// parameters.
    pub fn rows(&self) -> impl Iterator<Item = (&'static str, Vec<f64>)> {
        ROWS.iter().enumerate().filter_map(|(row, &name)| {
            let values: Vec<f64> = (0..=row).map(|column| self.factor[(row, column)]).collect();
            values.iter().any(|value| *value != 0.0).then_some((name, values))
        })
    }

    /// Standard deviation of a number with these slopes.
    pub fn sigma(&self, slopes: &SMatrix<f64, 1, UNCERTAIN_PARAMETERS>) -> f64 {
        (slopes * self.factor).norm()
    }

    /// Relative standard deviation of the distance between two points of a surface that are
    /// seen at fixed pixels. `None` for coincident points.
    pub fn relative_sigma(&self, ends: [&PositionSlopes; 2]) -> Option<f64> {
        let way = ends[1].mm - ends[0].mm;
        let length = way.norm();
        let slopes = way.transpose() / length * (ends[1].slopes - ends[0].slopes);
        let fraction = self.sigma(&slopes) / length;
        fraction.is_finite().then_some(fraction)
    }
}

/// A point on a surface that is seen at a pixel, and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSlopes {
    /// In the bed's axes \[mm\].
    pub mm: SurfacePoint,
    /// Jacobian with respect to the parameters of camera and bed at fixed pixel and surface height.
    pub slopes: SurfaceSlopes,
}

impl PositionSlopes {
    /// For a point x in the bed's axes \[mm\], by the implicit function theorem: its pixel u stays
    /// fixed, so that ∂x/∂p = −(∂u/∂x)⁻¹ ∂u/∂p for a parameter p. `None` where ∂u/∂x is singular:
    /// the camera looks along the surface.
    pub fn at(camera: &Camera, bed: &Pose, position: Point3<f64>) -> Option<Self> {
        let in_camera = bed.apply(position);
        let projection = camera.project_with_slopes(in_camera)?;
        let of_point: Matrix2x3<f64> = projection.of_point;
        let axes = bed.rotation();
        let in_image: Matrix2<f64> = of_point * axes.matrix().fixed_columns::<2>(0);
        let back = in_image.try_inverse()?;
        let arm: Vector3<f64> = in_camera.coords - bed.translation_mm();
        let turned: Matrix3<f64> = -arm.cross_matrix();
        let mut by_number = SurfaceSlopes::zeros();
        by_number.fixed_columns_mut::<NUMBERS>(0).copy_from(&projection.of_camera);
        by_number.fixed_columns_mut::<3>(NUMBERS).copy_from(&(of_point * turned));
        by_number.fixed_columns_mut::<3>(NUMBERS + 3).copy_from(&of_point);
        Some(Self { mm: position.xy(), slopes: -back * by_number })
    }
}
