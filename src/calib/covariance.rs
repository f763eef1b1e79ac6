//! How far a calibration may be off because the corners that it was found from
//! are: the covariance of the fit, and what it leaves in a width.
//!
//! The fit is one of least squares, over the camera's nine numbers and six for
//! the pose of the board in each picture. To first order in the noise of the
//! corners the covariance is the inverse of its normal equations (Triggs et al.
//! 2000, *Bundle adjustment – a modern synthesis*, sections 6.1 and 8.1); the
//! poses are eliminated from them picture by picture.

use nalgebra::{Cholesky, Const, Point3, Rotation3, SMatrix, SVector, Vector1, Vector2};

use super::board::Board;
use super::plane::bed_from_board;
use super::scale;
use super::solve::Solution;
use super::{Calibration, Camera, SurfaceMap};
use crate::geometry::{ImagePoint, Pose};
use crate::units::Mm;

/// Numbers of the camera: fx, fy, cx, cy in units of the focal length, then
/// k1, k2, p1, p2, k3.
const CAMERA: usize = 9;
/// Numbers of a pose: a turn about the camera's axes \[rad\], then a shift in
/// units of the board's distance.
const POSE: usize = 6;
/// Step of the central differences in these units: a part in ten thousand is
/// small against the bend of the model and large against rounding.
const STEP: f64 = 1e-4;
/// Share of a parameter's standard deviation, the others being known, below
/// which the pictures do not tell it from the others.
const LEAST_APART: f64 = 1e-5;

/// A bead for which the share is told fills this much of a side.
const BEAD: f64 = 1.0 / 3.0;
/// Middles of such beads along each side.
const PLACES: u32 = 5;
/// The highest surface for which the share is told, as a part of the camera's
/// height above the bed.
const SURFACE: f64 = 0.05;

/// What the noise of the corners leaves open in a calibration.
#[derive(Debug, Clone)]
pub struct Covariance {
    camera: Camera,
    image_size_px: [u32; 2],
    seen_px: [ImagePoint; 2],
    board: Pose,
    thickness: Mm,
    noise_variance_px2: f64,
    of_camera: Factor<CAMERA>,
    of_board: Elimination,
}

impl Covariance {
    /// Of a solution and the board that fixed the bed plane: its pose in the
    /// picture that shows it on the bed, and the height of its face above the
    /// bed. That picture may be one of the solution's or one that was taken
    /// later; in both cases its pose was fitted to its own corners with the
    /// solution's camera. `None` where the pictures do not settle the camera.
    pub fn of(board: &Board, solution: &Solution, on_bed: &Pose, thickness: Mm) -> Option<Self> {
        let corners = board.corners_mm();
        let camera = &solution.camera;
        let mut left = SMatrix::<f64, CAMERA, CAMERA>::zeros();
        for view in &solution.views {
            left += Elimination::of(camera, &view.pose, &corners)?.left;
        }
        Some(Self {
            camera: *camera,
            image_size_px: solution.image_size_px,
            seen_px: seen_px(solution)?,
            board: *on_bed,
            thickness,
            noise_variance_px2: noise_variance_px2(solution, corners.len())?,
            of_camera: Factor::of(left)?,
            of_board: Elimination::of(camera, on_bed, &corners)?,
        })
    }

    /// Relative standard deviation of a width where boards were seen: the
    /// largest that a bead has which fills a third of that part of the picture,
    /// along either axis, anywhere in it, on the bed and on a surface that is a
    /// twentieth of the camera's height above it. The largest and not a mean,
    /// because a gauge stays in its place, and with it the error. `None` where
    /// no such bead is seen on the surface.
    pub fn width_sigma_share(&self) -> Option<f64> {
        self.shares(self.seen_px).flatten().reduce(f64::max)
    }

    /// The same with beads of a third of the picture, anywhere in it, too. Where
    /// no corner held the distortion it is carried on, and a width may be known
    /// many times worse. `None` where some of the beads are seen nowhere on the
    /// surface.
    pub fn width_sigma_share_anywhere(&self) -> Option<f64> {
        let [right, bottom] = self.image_size_px.map(|px| f64::from(px) - 1.0);
        let all = [ImagePoint::origin(), ImagePoint::new(right, bottom)];
        let [seen, all] = [self.seen_px, all].map(|part| self.shares(part));
        seen.chain(all).try_fold(0.0, |most: f64, share| Some(most.max(share?)))
    }

    /// First and last column and row between which boards were seen \[px\].
    pub fn seen_px(&self) -> [ImagePoint; 2] {
        self.seen_px
    }

    /// Shares of beads all over a part of the picture; `None` for one that is not
    /// seen on the surface.
    fn shares(&self, part: [ImagePoint; 2]) -> impl Iterator<Item = Option<f64>> {
        let eye = bed_from_board(&self.board, self.thickness).apply_inverse(Point3::origin());
        let above = Mm::new(SURFACE * eye.z).unwrap_or(Mm::ZERO);
        let beads = [Mm::ZERO, above]
            .into_iter()
            .flat_map(move |height| beads(part).map(move |ends| (height, ends)));
        beads.map(|(height, ends)| {
            let (width_mm, sigma_mm) = self.width_mm(ends, height)?;
            Some(sigma_mm / width_mm).filter(|share| share.is_finite())
        })
    }

    /// Distance of two points of a surface, seen at these pixels, and its
    /// standard deviation \[mm\]. `None` off the surface.
    pub fn width_mm(&self, ends: [ImagePoint; 2], surface_height: Mm) -> Option<(f64, f64)> {
        let width = |map: &SurfaceMap| Some((map.to_mm(ends[1])? - map.to_mm(ends[0])?).norm());
        self.value(surface_height, width)
    }

    /// The number of [`scale::single_scale`] and its standard deviation
    /// \[mm/px\]. `None` where the middle of the picture does not see the
    /// surface.
    pub fn mm_per_px(&self, surface_height: Mm) -> Option<(f64, f64)> {
        self.value(surface_height, |map| scale::in_the_middle(map, self.image_size_px))
    }

    /// What is read off the map of a surface, and its standard deviation.
    ///
    /// A camera that is off takes the board's pose along, because that pose was
    /// fitted with it, and makes up for a part of the error: `slope` is how the
    /// value changes with the camera and the pose that follows it.
    fn value(
        &self,
        surface_height: Mm,
        read: impl Fn(&SurfaceMap) -> Option<f64>,
    ) -> Option<(f64, f64)> {
        let with = |camera: &Camera, board: &Pose| read(&self.map(camera, board, surface_height));
        let of_camera = slopes::<1, CAMERA>(|i, by| {
            with(&stepped_camera(&self.camera, i, by), &self.board).map(Vector1::new)
        })?;
        let of_board = slopes::<1, POSE>(|i, by| {
            with(&self.camera, &stepped_pose(&self.board, i, by)).map(Vector1::new)
        })?;
        let alone = self.of_board.pose.whiten(&of_board.transpose())?;
        let slope = of_camera.transpose() - self.of_board.follows.transpose() * alone;
        let shared = self.of_camera.whiten(&slope)?;
        let variance = self.noise_variance_px2 * (shared.norm_squared() + alone.norm_squared());
        Some((with(&self.camera, &self.board)?, variance.sqrt()))
    }

    fn map(&self, camera: &Camera, board: &Pose, surface_height: Mm) -> SurfaceMap {
        let calibration = Calibration::Full {
            image_size_px: self.image_size_px,
            camera: *camera,
            bed: bed_from_board(board, self.thickness),
            robot_z: Mm::ZERO,
            quality: None,
        };
        calibration.surface(surface_height, None)
    }
}

/// First and last column and row between which the corners lie \[px\]; `None`
/// without a corner.
fn seen_px(solution: &Solution) -> Option<[ImagePoint; 2]> {
    let corners = || solution.views.iter().flat_map(|view| view.corners_px.iter().copied());
    let (first, last) = (|a: ImagePoint, b| a.inf(&b), |a: ImagePoint, b| a.sup(&b));
    Some([corners().reduce(first)?, corners().reduce(last)?])
}

/// Ends of the beads for which the share is told, all of them within a part of
/// the picture, and as far from its border along the bead as across it.
fn beads([from, to]: [ImagePoint; 2]) -> impl Iterator<Item = [ImagePoint; 2]> {
    let size = to - from;
    let place = |i: u32| BEAD / 2.0 + (1.0 - BEAD) * f64::from(i) / f64::from(PLACES - 1);
    let middles = (0..PLACES * PLACES).map(move |i| {
        from + size.component_mul(&Vector2::new(place(i % PLACES), place(i / PLACES)))
    });
    let halves = [Vector2::new(size.x, 0.0), Vector2::new(0.0, size.y)].map(|s| s * (BEAD / 2.0));
    middles.flat_map(move |middle| halves.map(|half| [middle - half, middle + half]))
}

/// Variance of a corner's place in one direction, from what the fit leaves.
/// `None` where the corners are too few to tell.
#[expect(clippy::cast_precision_loss, reason = "counts of corners and pictures")]
fn noise_variance_px2(solution: &Solution, corners: usize) -> Option<f64> {
    let views = solution.views.len() as f64;
    let seen = corners as f64 * views;
    let free = 2.0 * seen - CAMERA as f64 - POSE as f64 * views;
    let squares = solution.rms_px.powi(2) * seen;
    (free > 0.0 && squares.is_finite()).then(|| squares / free)
}

/// The normal equations of one picture with the pose of its board eliminated
/// (the Schur complement).
#[derive(Debug, Clone)]
struct Elimination {
    /// What the picture says of the camera, its board's pose being free.
    left: SMatrix<f64, CAMERA, CAMERA>,
    /// What it says of the pose, the camera being known.
    pose: Factor<POSE>,
    /// How the pose answers to the camera, whitened.
    follows: SMatrix<f64, POSE, CAMERA>,
}

impl Elimination {
    /// `None` where the board is not in front of the camera or does not fix its
    /// pose.
    fn of(camera: &Camera, board: &Pose, corners_mm: &[Point3<f64>]) -> Option<Self> {
        let mut camera_alone = SMatrix::<f64, CAMERA, CAMERA>::zeros();
        let mut both = SMatrix::<f64, POSE, CAMERA>::zeros();
        let mut pose_alone = SMatrix::<f64, POSE, POSE>::zeros();
        for &corner in corners_mm {
            let seen =
                |camera: &Camera, board: &Pose| Some(camera.project(board.apply(corner))?.coords);
            let of_camera =
                slopes::<2, CAMERA>(|i, by| seen(&stepped_camera(camera, i, by), board))?;
            let of_pose = slopes::<2, POSE>(|i, by| seen(camera, &stepped_pose(board, i, by)))?;
            camera_alone += of_camera.transpose() * of_camera;
            both += of_pose.transpose() * of_camera;
            pose_alone += of_pose.transpose() * of_pose;
        }
        let pose = Factor::of(pose_alone)?;
        let follows = pose.whiten(&both)?;
        Some(Self { left: camera_alone - follows.transpose() * follows, pose, follows })
    }
}

/// A positive definite matrix M, as what makes xᵀM⁻¹x a sum of squares.
#[derive(Debug, Clone)]
struct Factor<const N: usize> {
    /// Scales the matrix to a diagonal of ones.
    unit: SVector<f64, N>,
    /// Cholesky factor of the scaled matrix.
    lower: SMatrix<f64, N, N>,
}

impl<const N: usize> Factor<N> {
    /// `None` for a matrix that is not positive definite, or nearly so.
    fn of(matrix: SMatrix<f64, N, N>) -> Option<Self> {
        let unit = matrix.diagonal().map(|on| 1.0 / on.sqrt());
        let scaled =
            SMatrix::from_fn(|row, column| matrix[(row, column)] * unit[row] * unit[column]);
        let lower = Cholesky::<f64, Const<N>>::new(scaled)?.unpack();
        let apart = lower.diagonal().iter().all(|&on| on > LEAST_APART);
        apart.then_some(Self { unit, lower })
    }

    /// Columns whose squares sum up to those of x in xᵀM⁻¹x.
    fn whiten<const M: usize>(&self, x: &SMatrix<f64, N, M>) -> Option<SMatrix<f64, N, M>> {
        let scaled = SMatrix::from_fn(|row, column| x[(row, column)] * self.unit[row]);
        self.lower.solve_lower_triangular(&scaled)
    }
}

/// Derivative of a vector after each of N numbers, by central differences.
fn slopes<const ROWS: usize, const N: usize>(
    at: impl Fn(usize, f64) -> Option<SVector<f64, ROWS>>,
) -> Option<SMatrix<f64, ROWS, N>> {
    let mut slopes = SMatrix::<f64, ROWS, N>::zeros();
    for i in 0..N {
        slopes.set_column(i, &((at(i, STEP)? - at(i, -STEP)?) / (2.0 * STEP)));
    }
    Some(slopes)
}

/// The camera with one of its numbers changed, in the units of [`CAMERA`].
fn stepped_camera(camera: &Camera, number: usize, by: f64) -> Camera {
    let mut stepped = *camera;
    let [fx, fy] = camera.focal_px;
    let pixels = stepped.focal_px.iter_mut().chain(&mut stepped.centre_px);
    let numbers = pixels.zip([fx, fy, fx, fy]).chain(stepped.distortion.iter_mut().zip([1.0; 5]));
    if let Some((value, unit)) = numbers.into_iter().nth(number) {
        *value += by * unit;
    }
    stepped
}

/// The pose with one of its numbers changed, in the units of [`POSE`].
fn stepped_pose(pose: &Pose, number: usize, by: f64) -> Pose {
    let place = pose.translation_mm();
    let mut step = SVector::<f64, POSE>::zeros();
    step[number] = by;
    let turn = Rotation3::new(step.fixed_rows::<3>(0));
    let shift = step.fixed_rows::<3>(3) * place.norm();
    Pose::from_parts(turn * pose.rotation(), place + shift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    use crate::bridge::{self, BoardView};
    use crate::calib::solve::{self, Sighting};
    use crate::calib::synthetic::{self, SIZE, TRUTH, board, poses};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rayon::prelude::*;

    const NOISE_PX: f64 = 0.1;
    const THICKNESS: Mm = Mm::constant(4.0);
    const SEEDS: u64 = 60;

    /// The pictures of a calibration and one that was taken later.
    fn solved(seed: u64) -> (Solution, Pose) {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let noise = Normal::new(0.0, NOISE_PX).unwrap();
        let mut corners = |pose| synthetic::corners(&pose, || noise.sample(&mut random));
        let sighting =
            |corners_px| Sighting { name: String::new(), image_size_px: SIZE, corners_px };
        let sightings: Vec<_> = poses().into_iter().map(&mut corners).map(sighting).collect();
        let solution = solve::solve(&board(), &sightings).unwrap();
        let view = BoardView { board_mm: board().corners_mm(), image_px: corners(later()) };
        let later = bridge::solve_pose(&view, &solution.camera).unwrap();
        (solution, later)
    }

    fn later() -> Pose {
        Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(-70.0, -60.0, 400.0))
    }

    fn covariance(solution: &Solution, on_bed: &Pose) -> Covariance {
        Covariance::of(&board(), solution, on_bed, THICKNESS).unwrap()
    }

    /// Beads here and there, and the height of their surface.
    fn beads() -> [([ImagePoint; 2], Mm); 3] {
        let at = ImagePoint::new;
        [
            ([at(240.0, 270.0), at(480.0, 270.0)], Mm::ZERO),
            ([at(20.0, 40.0), at(200.0, 60.0)], Mm::ZERO),
            ([at(600.0, 200.0), at(590.0, 500.0)], Mm::constant(20.0)),
        ]
    }

    #[test]
    #[expect(clippy::cast_precision_loss, reason = "a few seeds")]
    fn widths_scatter_over_many_calibrations_as_one_of_them_foretells() {
        let runs: Vec<(Solution, Pose)> = (0..SEEDS).into_par_iter().map(solved).collect();
        let with_own: Vec<_> = runs.iter().map(|(s, _)| covariance(s, &s.views[3].pose)).collect();
        let with_later: Vec<_> = runs.iter().map(|(s, later)| covariance(s, later)).collect();
        for covariances in [with_own, with_later] {
            for (ends, height) in beads() {
                let widths = covariances.iter().map(|c| c.width_mm(ends, height).unwrap());
                let (widths, sigmas): (Vec<f64>, Vec<f64>) = widths.unzip();
                let mean = widths.iter().sum::<f64>() / SEEDS as f64;
                let squares = widths.iter().map(|width| (width - mean).powi(2)).sum::<f64>();
                let scatter = (squares / (SEEDS - 1) as f64).sqrt();
                let ratio = scatter / sigmas[0];
                assert!((0.7..1.3).contains(&ratio), "{ends:?}: scatter over sigma {ratio}");
            }
        }
    }

    /// But for one factor: OpenCV may count a corner once where its residuals
    /// are two, and calls the noise larger.
    #[test]
    fn the_cameras_own_standard_deviations_are_in_proportion_those_of_opencv() {
        let (solution, later) = solved(1);
        let covariance = covariance(&solution, &later);
        let [fx, fy] = solution.camera.focal_px;
        let units = [fx, fy, fx, fy, 1.0, 1.0, 1.0, 1.0, 1.0];
        let ratios: Vec<f64> = (0..CAMERA)
            .map(|i| {
                let mut one = SVector::<f64, CAMERA>::zeros();
                one[i] = units[i];
                let whitened = covariance.of_camera.whiten(&one).unwrap();
                let variance = covariance.noise_variance_px2 * whitened.norm_squared();
                variance.sqrt() / solution.sigma[i]
            })
            .collect();
        for ratio in &ratios {
            assert!((ratio / ratios[0] - 1.0).abs() < 0.01, "{ratios:?}");
        }
        let noise_px = covariance.noise_variance_px2.sqrt();
        assert!((noise_px / NOISE_PX - 1.0).abs() < 0.1, "{noise_px}");
    }

    #[test]
    fn the_share_is_no_smaller_than_that_of_a_bead_in_the_middle() {
        let (solution, later) = solved(2);
        let covariance = covariance(&solution, &later);
        let share = covariance.width_sigma_share().unwrap();
        let (ends, height) = beads()[0];
        let (width, sigma) = covariance.width_mm(ends, height).unwrap();
        assert!(share >= sigma / width && share < 0.002, "{share}");
        assert!(covariance.width_sigma_share_anywhere().unwrap() >= share);
        let (mm_per_px, sigma) = covariance.mm_per_px(THICKNESS).unwrap();
        let calibration = Calibration::Full {
            image_size_px: SIZE,
            camera: solution.camera,
            bed: bed_from_board(&later, THICKNESS),
            robot_z: Mm::ZERO,
            quality: None,
        };
        let scale = scale::single_scale(&calibration, THICKNESS).unwrap();
        assert_eq!(mm_per_px, scale.mm_per_px);
        assert!(sigma > 0.0 && sigma / mm_per_px < share);
    }

    #[test]
    fn more_noise_leaves_more_and_boards_all_alike_do_not_settle_the_camera() {
        let (solution, later) = solved(3);
        let share = covariance(&solution, &later).width_sigma_share().unwrap();
        let noisy = Solution { rms_px: 2.0 * solution.rms_px, ..solution.clone() };
        let doubled = covariance(&noisy, &later).width_sigma_share().unwrap();
        assert!((doubled / share - 2.0).abs() < 1e-9);
        let straight = Pose::new(Vector3::zeros(), Vector3::new(-80.0, -50.0, 420.0));
        let mut alike = Solution { camera: TRUTH, ..solution };
        for view in &mut alike.views {
            view.pose = straight;
        }
        assert!(Covariance::of(&board(), &alike, &straight, THICKNESS).is_none());
    }
}
