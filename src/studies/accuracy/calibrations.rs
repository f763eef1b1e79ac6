//! Repeated calibrations with a known truth: whether the errors of widths have the standard
//! deviation that each calibration predicts.

use nalgebra::{Point3, Rotation3, Vector3};

use crate::calibration::board::{Board, BoardError, observe_all};
use crate::calibration::board_observation::{self, BoardObservation};
use crate::calibration::covariance::CalibrationCovariance;
use crate::calibration::plane::{OnBed, bed_from_board};
use crate::calibration::solve::{self, Solution};
use crate::calibration::{Calibration, CalibrationQuality, Camera};
use crate::core::{ImagePoint, Mm, Pose};
use crate::sim::board_studio::{BoardStudio, Exposure};
use crate::sim::hash;

/// Tilts of boards that are held before a camera \[degrees\].
const TILT_DEG: std::ops::RangeInclusive<f64> = 15.0..=45.0;
/// Tilt of the board on the bed against the camera \[degrees\].
const BED_TILT_DEG: f64 = 8.0;
/// Smallest distance of a corner from the image boundary \[px\]: the corner search needs its
/// surroundings.
const IMAGE_MARGIN_PX: f64 = 8.0;
/// Random poses that are tried for one that shows the whole board.
const MAX_TRIES: u64 = 2000;
/// Cells along each side of the board on the bed, a bead in the middle of each.
const GRID_CELLS: u32 = 5;
/// Width of a bead over the board's length. Derived: 1 / `GRID_CELLS`, so that the outer beads end
/// at the outer corners.
const BEAD_WIDTH_FRACTION: f64 = 1.0 / 5.0;

/// A camera that is calibrated with boards.
#[derive(Debug, Clone)]
pub struct CalibrationCase {
    /// Its name in tables.
    pub name: &'static str,
    /// The true camera.
    pub camera: Camera,
    /// Size of its images \[px\].
    pub image_size_px: [u32; 2],
    /// Distance of the boards from the camera \[mm\].
    pub distance_mm: f64,
    /// The board.
    pub board: Board,
    /// Number of images for one calibration.
    pub views: u64,
    /// Standard deviation of a corner's position in one direction \[px\].
    pub noise_px: f64,
    /// Whether there are also trials with rendered images: for one case of each camera.
    pub rendered: bool,
}

/// One width by a calibration, measured at the true positions of its edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibratedWidth {
    /// Index of the bead.
    pub bead: usize,
    /// Error of the width \[mm\].
    pub error_mm: f64,
    /// Standard deviation that the calibration predicts \[mm\].
    pub sigma_mm: f64,
    /// The true width \[mm\].
    pub width_mm: f64,
}

/// Where the corners of a trial come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CornerSource {
    /// The true positions with the case's noise.
    Corners,
    /// Corners that are detected in rendered images.
    Images,
}

/// A case, ready for trials.
#[derive(Debug, Clone)]
pub struct CalibrationBench {
    case: CalibrationCase,
    studio: Option<BoardStudio>,
    seed: u64,
}

/// The cameras of the trials: a long focal length with the usual image size of a cell, a short one
/// with strong distortion, and a larger image; with few and many views, low and high noise.
pub fn cases() -> Result<Vec<CalibrationCase>, BoardError> {
    let camera = |focal: f64, centre: [f64; 2], k: [f64; 4]| {
        Camera::pinhole([focal, focal * 1.001], centre).with_five([k[0], k[1], k[2], k[3], 0.0])
    };
    let long = camera(2500.0, [352.0, 262.0], [-0.15, 0.4, 1e-3, -5e-4]);
    let short = camera(533.0, [342.0, 234.0], [-0.28, 0.06, 1e-3, -2e-4]);
    let large = camera(1700.0, [650.0, 498.0], [-0.12, 0.08, -4e-4, 6e-4]);
    let board = |square: f64| Board::new(9, 6, Mm::new(square).unwrap_or(Mm::ZERO));
    let case = |name: &'static str, camera, image_size_px, distance_mm, board, views, noise_px| {
        CalibrationCase {
            name,
            camera,
            image_size_px,
            distance_mm,
            board,
            views,
            noise_px,
            rendered: ["long-20", "short-13", "large-12"].contains(&name),
        }
    };
    let (small, medium) = ([640, 480], [720, 540]);
    Ok(vec![
        case("long-20", long, medium, 400.0, board(7.0)?, 20, 0.05),
        case("long-40", long, medium, 400.0, board(7.0)?, 40, 0.1),
        case("short-8", short, small, 300.0, board(18.0)?, 8, 0.1),
        case("short-13", short, small, 300.0, board(18.0)?, 13, 0.15),
        case("short-40", short, small, 300.0, board(18.0)?, 40, 0.2),
        case("large-12", large, [1280, 1024], 600.0, board(25.0)?, 12, 0.05),
        case("large-25", large, [1280, 1024], 600.0, board(25.0)?, 25, 0.2),
    ])
}

impl CalibrationBench {
    /// Prepares trials whose corners come from one source.
    pub fn new(case: CalibrationCase, source: CornerSource) -> Self {
        let seed = hash::mix(&case.name.bytes().map(u64::from).collect::<Vec<_>>());
        let studio = (source == CornerSource::Images)
            .then(|| BoardStudio::new(&case.camera, case.image_size_px));
        Self { case, studio, seed }
    }

    /// Calibrates once with boards in random poses. Then measures beads at the position of the
    /// last board, on the bed and at a height of 5 % of the distance. An image without a detected
    /// board is left out. `None` if that is the image of the bed, or if the calibration cannot be
    /// solved.
    pub fn calibrate(&self, trial: u64) -> Option<Vec<CalibratedWidth>> {
        let key = hash::mix(&[self.seed, trial]);
        let poses: Vec<Pose> = (0..self.case.views)
            .map(|view| self.pose(hash::mix(&[key, view]), view + 1 == self.case.views))
            .collect::<Option<_>>()?;
        let (on_bed, held) = poses.split_last()?;
        let look = |(pose, view)| self.sighting(pose, hash::mix(&[key, view, 1]));
        let mut sightings: Vec<BoardObservation> = held.iter().zip(0..).filter_map(look).collect();
        sightings.push(look((on_bed, self.case.views - 1))?);
        let board = &self.case.board;
        let solution = solve::solve(board, &sightings).ok()?;
        let on_bed =
            OnBed::fit(&solution.model, vec![board.correspondences(&sightings.last()?.corners)])?;
        let covariance = CalibrationCovariance::of(board, &solution, &on_bed, Mm::ZERO)?;
        let heights = [Mm::ZERO, Mm::new(0.05 * self.case.distance_mm).ok()?];
        let calibration = self.calibration(&solution, &on_bed, &covariance);
        let beads = heights.into_iter().flat_map(|height| cells().map(move |at| (height, at)));
        beads
            .enumerate()
            .map(|(bead, (height, cell))| {
                let (ends, width_mm) = self.bead(poses.last()?, cell, height)?;
                let map = calibration.surface(height, None);
                let found_mm = (map.to_mm(ends[1])? - map.to_mm(ends[0])?).norm();
                let sigma_mm = map.width_relative_sigma_of(ends)? * found_mm;
                Some(CalibratedWidth { bead, error_mm: found_mm - width_mm, sigma_mm, width_mm })
            })
            .collect()
    }

    /// The result in the form that a calibration file has.
    fn calibration(
        &self,
        solution: &Solution,
        on_bed: &OnBed,
        covariance: &CalibrationCovariance,
    ) -> Calibration {
        Calibration::Full {
            image_size_px: self.case.image_size_px,
            camera: *solution.camera(),
            bed: on_bed.bed(Mm::ZERO),
            robot_z: Mm::ZERO,
            quality: Some(CalibrationQuality {
                reprojection_rms_px: solution.rms_px,
                width_relative_sigma: None,
                seen_px: None,
                heights_mm: None,
                uncertainty: Some(covariance.uncertainty()),
            }),
        }
    }

    /// A random pose that shows the whole board; `None` after `MAX_TRIES`.
    fn pose(&self, key: u64, on_bed: bool) -> Option<Pose> {
        let draw = |again| random_pose(&self.case, hash::mix(&[key, again]), on_bed);
        (0..MAX_TRIES).map(draw).find(|pose| is_in_image(&self.case, pose))
    }

    fn sighting(&self, pose: &Pose, seed: u64) -> Option<BoardObservation> {
        let case = &self.case;
        if let Some(studio) = &self.studio {
            let frame = studio.take(&case.board, pose, Exposure::SHARP, seed).ok()?;
            return board_observation::observe(&case.board, "", &frame).ok();
        }
        let corners = case.board.corners_mm().into_iter().zip(0..).map(|(corner, i)| {
            let [x, y] = hash::normal_pair(hash::mix(&[seed, i]));
            let at = case.camera.project(pose.apply(corner))?;
            Some(ImagePoint::new(at.x + case.noise_px * x, at.y + case.noise_px * y))
        });
        let corners: Vec<ImagePoint> = corners.collect::<Option<_>>()?;
        Some(BoardObservation {
            name: String::new(),
            image_size_px: case.image_size_px,
            corners: observe_all(&corners),
            focus: None,
        })
    }

    /// The ends of a bead on the true bed in the true camera's image \[px\], and its width \[mm\].
    fn bead(&self, on_bed: &Pose, cell: [f64; 2], height: Mm) -> Option<([ImagePoint; 2], f64)> {
        let case = &self.case;
        let calibration = Calibration::Full {
            image_size_px: case.image_size_px,
            camera: case.camera,
            bed: bed_from_board(on_bed, Mm::ZERO),
            robot_z: Mm::ZERO,
            quality: None,
        };
        let map = calibration.surface(height, None);
        let sides = case.board.corners_mm().last()?.coords;
        // The bed's y axis is opposite to the board's.
        let middle = [cell[0] * sides.x, -cell[1] * sides.y];
        let half = 0.5 * BEAD_WIDTH_FRACTION * sides.x;
        let end = |by: f64| map.to_px(crate::core::SurfacePoint::new(middle[0] + by, middle[1]));
        Some(([end(-half)?, end(half)?], 2.0 * half))
    }
}

/// Centres of the grid's cells on the board, as fractions of the board's sides.
fn cells() -> impl Iterator<Item = [f64; 2]> {
    let part = |i: u32| (f64::from(i) + 0.5) / f64::from(GRID_CELLS);
    (0..GRID_CELLS * GRID_CELLS).map(move |i| [part(i % GRID_CELLS), part(i / GRID_CELLS)])
}

/// A random pose; the board's centre is in the image.
fn random_pose(case: &CalibrationCase, key: u64, on_bed: bool) -> Pose {
    let part = |what: u64| hash::unit(hash::mix(&[key, what]));
    let [width, height] = case.image_size_px.map(f64::from);
    let (tilt_deg, at) = if on_bed {
        (BED_TILT_DEG, (0.5, 0.5))
    } else {
        let (low, high) = (TILT_DEG.start(), TILT_DEG.end());
        (low + (high - low) * part(0), (part(1), part(2)))
    };
    let towards = std::f64::consts::TAU * part(3);
    let axis = Vector3::new(towards.cos(), towards.sin(), 0.0);
    let turn = Rotation3::new(Vector3::z() * (0.4 * (part(4) - 0.5)));
    let rotation = Rotation3::new(axis * tilt_deg.to_radians()) * turn;
    let distance = case.distance_mm * if on_bed { 1.0 } else { 0.85 + 0.3 * part(5) };
    let px = ImagePoint::new(at.0 * width, at.1 * height);
    let ray = case.camera.ray(px).unwrap_or_default();
    let middle = case.board.corners_mm().last().map_or_else(Vector3::zeros, |far| far.coords / 2.0);
    let place = Vector3::new(ray.x, ray.y, 1.0) * distance - rotation * middle;
    Pose::from_parts(rotation, place)
}

/// Whether the whole board with its outer squares is in the image.
fn is_in_image(case: &CalibrationCase, pose: &Pose) -> bool {
    let [right, bottom] = case.image_size_px.map(|px| f64::from(px) - 1.0);
    let side = case.board.square().get();
    let far = case.board.corners_mm().last().map_or_else(Vector3::zeros, |far| far.coords);
    let ends = [-1.2 * side, 1.2 * side];
    let outer = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].map(|(x, y)| {
        let beyond = |at: f64, side: f64| if at > 0.5 { side + ends[1] } else { ends[0] };
        Point3::new(beyond(x, far.x), beyond(y, far.y), 0.0)
    });
    let inside = |px: ImagePoint| {
        (IMAGE_MARGIN_PX..=right - IMAGE_MARGIN_PX).contains(&px.x)
            && (IMAGE_MARGIN_PX..=bottom - IMAGE_MARGIN_PX).contains(&px.y)
    };
    outer.iter().all(|&corner| case.camera.project(pose.apply(corner)).is_some_and(inside))
}
