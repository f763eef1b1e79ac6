//! Covariance of a calibration due to the noise of its corners, and the resulting standard
//! deviation of a width.
//!
//! The fit is one of least squares over the free parameters of the camera, the bend of the
//! board where it is fitted, and the pose of the board in each image. To first order in the
//! noise of the corners the covariance is the inverse of its normal equations (Triggs et al.
//! 2000, *Bundle adjustment – a modern synthesis*, sections 6.1 and 8.1).

use nalgebra::{DMatrix, DVector, Point3, SMatrix, SVector};

use super::board::Board;
use super::camera::NUMBERS;
use super::equations::{
    BoardPlacement, CameraModel, Correspondence, Equations, FreeParameters, POSE, SHARED,
    restrict_to_free,
};
use super::factor::{Elimination, Factor};
use super::plane::{OnBed, bed_from_board};
use super::solve::Solution;
use super::uncertainty::{CalibrationUncertainty, JointCovariance, UNCERTAIN_PARAMETERS};
use super::{Calibration, SurfaceMap, scale};
use crate::core::{ImagePoint, Mm, Pose};

/// Step of the central differences, as a fraction of a focal length, as an angle \[rad\] or as
/// a fraction of the distance of the board: small against the curvature of the model and large
/// against rounding.
const RELATIVE_STEP: f64 = 1e-4;

/// Covariance of a calibration due to the noise of its corners.
#[derive(Debug, Clone)]
pub struct CalibrationCovariance {
    model: CameraModel,
    free: FreeParameters,
    image_size_px: [u32; 2],
    seen_px: [ImagePoint; 2],
    bed: BoardPlacement,
    on_bed: Vec<Vec<Correspondence>>,
    thickness: Mm,
    noise_variance_px2: f64,
    /// Information of all images on the shared parameters, with the poses eliminated.
    left: SMatrix<f64, SHARED, SHARED>,
    of_shared: Factor,
    of_bed: Elimination,
}

/// A number that is derived from a surface map, with its derivatives.
#[derive(Debug, Clone)]
pub struct DerivedValue {
    /// The number itself.
    pub value: f64,
    /// Derivative with the shared parameters, the bed plane following them.
    slope: DVector<f64>,
    /// Variance from the corners of the boards on the bed, in units of the variance of a
    /// corner.
    of_bed: f64,
}

impl CalibrationCovariance {
    /// From a solution, the boards that fixed the bed plane, and the height of their faces
    /// above the bed. The images of these boards may be among those of the solution or taken
    /// later; in both cases their poses were fitted with the solution's camera. `None` where
    /// the images do not determine the camera.
    pub fn of(board: &Board, solution: &Solution, on_bed: &OnBed, thickness: Mm) -> Option<Self> {
        let (model, free) = (solution.model, solution.free);
        let mut left = SMatrix::<f64, SHARED, SHARED>::zeros();
        for (number, view) in solution.views.iter().enumerate() {
            let corners = solution.corners(board, number);
            left +=
                eliminate(&model, free, &BoardPlacement::of_one(view.pose), &[corners])?.reduced;
        }
        let noise_variance_px2 = solution.noise_px.powi(2) * solution.design_effect;
        let left = restrict_to_free(left, free);
        Some(Self {
            model,
            free,
            image_size_px: solution.image_size_px,
            seen_px: solution.seen_px()?,
            bed: on_bed.place.clone(),
            on_bed: on_bed.boards.clone(),
            thickness,
            noise_variance_px2: Some(noise_variance_px2).filter(|noise| noise.is_finite())?,
            of_shared: Factor::of_shared(&left)?,
            left,
            of_bed: eliminate(&model, free, &on_bed.place, &on_bed.boards)?,
        })
    }

    /// The covariance with one more image of a board, whose corners have the same noise. `None`
    /// where the board would not be in front of the camera.
    pub fn with_another(&self, pose: &Pose, corners: &[Correspondence]) -> Option<Self> {
        let place = BoardPlacement::of_one(*pose);
        let more = eliminate(&self.model, self.free, &place, &[corners.to_vec()])?;
        let left = self.left + restrict_to_free(more.reduced, self.free);
        Some(Self { of_shared: Factor::of_shared(&left)?, left, ..self.clone() })
    }

    /// The covariance with one more board on the bed, whose image takes part in both fits; `lies`
    /// is its position on the plane of the first. `None` where it would not be in front of the
    /// camera.
    pub fn with_another_on_bed(&self, lies: [f64; 3], corners: &[Correspondence]) -> Option<Self> {
        let mut bed = self.bed.clone();
        bed.others.push(lies);
        let mut on_bed = self.on_bed.clone();
        on_bed.push(corners.to_vec());
        let of_bed = eliminate(&self.model, self.free, &bed, &on_bed)?;
        let pose = bed.of_board(bed.others.len());
        Some(Self { bed, on_bed, of_bed, ..self.with_another(&pose, corners)? })
    }

    /// Pose of a further board on the bed.
    pub fn on_bed(&self, lies: [f64; 3]) -> Pose {
        let others = vec![lies];
        BoardPlacement { pose: self.bed.pose, others }.of_board(1)
    }

    /// Size of the images \[px\].
    pub fn image_size_px(&self) -> [u32; 2] {
        self.image_size_px
    }

    /// First and last column and row between which boards were seen \[px\].
    pub fn seen_px(&self) -> [ImagePoint; 2] {
        self.seen_px
    }

    /// Height of the boards' faces above the bed.
    pub fn thickness(&self) -> Mm {
        self.thickness
    }

    /// Height of the camera above the bed \[mm\].
    pub fn camera_height_mm(&self) -> f64 {
        bed_from_board(&self.bed.pose, self.thickness).apply_inverse(Point3::origin()).z
    }

    /// The camera and the bend of the board.
    pub fn model(&self) -> &CameraModel {
        &self.model
    }

    /// Distance of two points of a surface that are seen at these pixels, and its standard
    /// deviation \[mm\]. `None` off the surface.
    pub fn width_mm(&self, ends: [ImagePoint; 2], surface_height: Mm) -> Option<(f64, f64)> {
        let reading = self.width(ends, surface_height)?;
        Some((reading.value, self.sigma(&reading)))
    }

    /// The distance of [`Self::width_mm`] with its derivatives, for reuse with other covariances.
    pub fn width(&self, ends: [ImagePoint; 2], surface_height: Mm) -> Option<DerivedValue> {
        let width = |map: &SurfaceMap| Some((map.to_mm(ends[1])? - map.to_mm(ends[0])?).norm());
        self.read(surface_height, width)
    }

    /// The scale of [`scale::single_scale`] and its standard deviation \[mm/px\]. `None` where
    /// the middle of the image does not see the surface.
    pub fn mm_per_px(&self, surface_height: Mm) -> Option<(f64, f64)> {
        let reading =
            self.read(surface_height, |map| scale::in_the_middle(map, self.image_size_px))?;
        Some((reading.value, self.sigma(&reading)))
    }

    /// Standard deviation of a derived value.
    pub fn sigma(&self, reading: &DerivedValue) -> f64 {
        let whitened = self.of_shared.whiten(&as_matrix(&reading.slope));
        (self.noise_variance_px2 * (whitened.norm_squared() + reading.of_bed)).sqrt()
    }

    /// Uncertainty of camera and bed plane together.
    pub fn uncertainty(&self) -> CalibrationUncertainty {
        self.joint(1.0)
    }

    /// [`Self::uncertainty`] without the noise of the bed's own corners, which two cameras that see
    /// the same board have in common.
    pub fn uncertainty_of_camera(&self) -> CalibrationUncertainty {
        self.joint(0.0)
    }

    /// The uncertainty with `own` times the variance of the corners of the boards on the bed.
    ///
    /// The bed's pose follows the shared parameters s as b = −V⁻¹W·s, with V its own normal
    /// equations and W the mixed ones; its own corners add V⁻¹.
    fn joint(&self, own: f64) -> CalibrationUncertainty {
        let numbers = self.bed.numbers();
        let own_root = self.of_bed.placement.whiten(&DMatrix::identity(numbers, numbers));
        let follows = (own_root.transpose() * &self.of_bed.follows).rows(0, POSE).into_owned();
        let mut answers = DMatrix::zeros(UNCERTAIN_PARAMETERS, SHARED);
        answers.view_mut((0, 0), (NUMBERS, NUMBERS)).fill_with_identity();
        answers.rows_mut(NUMBERS, POSE).copy_from(&-follows);
        let of_shared = self.of_shared.whiten(&answers.transpose());
        let mut joint = of_shared.transpose() * of_shared;
        let pose = own_root.columns(0, POSE);
        let mut of_bed = joint.view_mut((NUMBERS, NUMBERS), (POSE, POSE));
        of_bed += pose.transpose() * pose * own;
        joint *= self.noise_variance_px2;
        // The bed rotates about its own origin, not about that of the board.
        let face = &self.bed.pose;
        let bed = bed_from_board(face, self.thickness);
        let arm = bed.translation_mm() - face.translation_mm();
        let mut moved = DMatrix::identity(UNCERTAIN_PARAMETERS, UNCERTAIN_PARAMETERS);
        moved.view_mut((NUMBERS + 3, NUMBERS), (3, 3)).copy_from(&-arm.cross_matrix());
        let joint = &moved * joint * moved.transpose();
        CalibrationUncertainty::of(&JointCovariance::from_fn(|row, column| joint[(row, column)]))
    }

    /// The map of a surface.
    pub fn surface(&self, surface_height: Mm) -> SurfaceMap {
        self.map(&self.model, &self.bed, surface_height)
    }

    /// A number derived from a surface map, with its derivatives.
    ///
    /// An error of the camera changes the bed plane, which was fitted with it, and so is partly
    /// compensated: the derivative with the shared parameters contains how the bed follows
    /// them.
    fn read(
        &self,
        surface_height: Mm,
        read: impl Fn(&SurfaceMap) -> Option<f64>,
    ) -> Option<DerivedValue> {
        let with =
            |model: &CameraModel, bed: &BoardPlacement| read(&self.map(model, bed, surface_height));
        let slope = |step: f64, at: &dyn Fn(f64) -> Option<f64>| {
            Some((at(step)? - at(-step)?) / (2.0 * step))
        };
        let mut of_shared = DVector::zeros(SHARED);
        for number in (0..SHARED).filter(|&number| self.free.has(number)) {
            // Focal lengths and centre are in pixels, all other parameters in units of about
            // one.
            let scale = if number < 4 { self.model.camera.focal_px[number % 2] } else { 1.0 };
            let step = RELATIVE_STEP * scale;
            let unit = SVector::<f64, SHARED>::from_fn(|i, _| f64::from(u8::from(i == number)));
            of_shared[number] =
                slope(step, &|by| with(&self.model.moved(&(unit * by)), &self.bed))?;
        }
        let mut of_bed = DVector::zeros(self.bed.numbers());
        let distance = self.bed.pose.translation_mm().norm();
        for number in 0..POSE {
            let step = if number < 3 { RELATIVE_STEP } else { RELATIVE_STEP * distance };
            let unit =
                DVector::from_fn(self.bed.numbers(), |i, _| f64::from(u8::from(i == number)));
            of_bed[number] = slope(step, &|by| with(&self.model, &self.bed.moved(&(&unit * by))))?;
        }
        let alone = self.of_bed.placement.whiten(&as_matrix(&of_bed));
        let slope = of_shared - self.of_bed.follows.transpose() * alone.column(0);
        let value = with(&self.model, &self.bed)?;
        Some(DerivedValue { value, slope, of_bed: alone.norm_squared() })
    }

    fn map(&self, model: &CameraModel, bed: &BoardPlacement, surface_height: Mm) -> SurfaceMap {
        let calibration = Calibration::Full {
            image_size_px: self.image_size_px,
            camera: model.camera,
            bed: bed_from_board(&bed.pose, self.thickness),
            robot_z: Mm::ZERO,
            quality: None,
        };
        calibration.surface(surface_height, None)
    }
}

fn as_matrix(vector: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(vector.len(), 1, vector.as_slice())
}

fn eliminate(
    model: &CameraModel,
    free: FreeParameters,
    place: &BoardPlacement,
    boards: &[Vec<Correspondence>],
) -> Option<Elimination> {
    Elimination::of(&Equations::of(model, free, place, boards)?)
}

#[cfg(test)]
mod tests;
