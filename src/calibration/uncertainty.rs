//! What a calibration leaves open in a length, wherever it is seen: the covariance of
//! camera and bed plane, which a length's slopes turn into a standard deviation.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Point3, SMatrix, Vector3};

use super::Camera;
use super::camera::{NAMES, NUMBERS};
use crate::core::geometry::{Pose, SurfacePoint};

/// The camera's numbers, then a turn of the bed about the camera's axes at the bed's
/// origin \[rad\] and a shift of it along them \[mm\].
pub const UNCERTAIN_PARAMETERS: usize = NUMBERS + 6;

/// Names of the rows in a calibration file, in order.
pub const ROWS: [&str; UNCERTAIN_PARAMETERS] = {
    let mut names = [""; UNCERTAIN_PARAMETERS];
    let mut i = 0;
    while i < NUMBERS {
        names[i] = NAMES[i];
        i += 1;
    }
    let bed = ["turn_x", "turn_y", "turn_z", "shift_x", "shift_y", "shift_z"];
    let mut i = 0;
    while i < bed.len() {
        names[NUMBERS + i] = bed[i];
        i += 1;
    }
    names
};

/// Part of a number's variance that the ones before it must leave for it to add anything:
/// less is rounding.
const MIN_PIVOT: f64 = 1e-14;

/// Between the numbers of camera and bed.
pub type JointCovariance = SMatrix<f64, UNCERTAIN_PARAMETERS, UNCERTAIN_PARAMETERS>;

/// How a place on a surface answers to the numbers of camera and bed \[mm per unit\].
pub type SurfaceSlopes = SMatrix<f64, 2, UNCERTAIN_PARAMETERS>;

/// The covariance of camera and bed plane, as its lower triangular factor L: the
/// covariance is L·Lᵀ. A number that is known has a row of zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationUncertainty {
    factor: JointCovariance,
}

impl CalibrationUncertainty {
    /// Of a covariance. Rows and columns of known numbers are 0.
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

    /// From the factor's rows, each as long as its number counted from 1; an empty one is
    /// of a number that is known. `None` for rows of another length.
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

    /// The factor's rows up to the diagonal, with their names; those of known numbers are
    /// left out.
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

    /// Standard deviation of the distance between two places of a surface that are seen at
    /// fixed pixels, over that distance. `None` where both are one place.
    pub fn relative_sigma(&self, ends: [&PositionSlopes; 2]) -> Option<f64> {
        let way = ends[1].mm - ends[0].mm;
        let length = way.norm();
        let slopes = way.transpose() / length * (ends[1].slopes - ends[0].slopes);
        let share = self.sigma(&slopes) / length;
        share.is_finite().then_some(share)
    }
}

/// A place on a surface that is seen at a pixel, and its slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionSlopes {
    /// In the bed's axes \[mm\].
    pub mm: SurfacePoint,
    /// With the numbers of camera and bed, the pixel and the surface's height above the
    /// bed staying what they are.
    pub slopes: SurfaceSlopes,
}

impl PositionSlopes {
    /// What is seen at a pixel, at a place of the bed's axes \[mm\] that the camera sees
    /// there: what the numbers move in the image the place must undo. `None` where the
    /// camera looks along the surface.
    pub fn at(camera: &Camera, bed: &Pose, place: Point3<f64>) -> Option<Self> {
        let in_camera = bed.apply(place);
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
        Some(Self { mm: place.xy(), slopes: -back * by_number })
    }
}
