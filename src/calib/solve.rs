//! From pictures of a board to the camera model.

use nalgebra::Point3;

use super::Camera;
use super::board::{Board, NotABoard};
use crate::bridge::{self, BoardView, BridgeError};
use crate::frame::Frame;
use crate::geometry::{ImagePoint, Pose};

/// Pictures with a board below which the model cannot be told from the data:
/// two poses fix the focal length only if nothing is wrong.
pub const FEWEST_VIEWS: usize = 3;

/// The board as one picture shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sighting {
    /// The picture's name.
    pub name: String,
    /// Its size \[px\].
    pub image_size_px: [u32; 2],
    /// The inner corners, row by row \[px\].
    pub corners_px: Vec<ImagePoint>,
}

/// Why a picture is not used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// It cannot be read.
    #[error("unreadable: {0}")]
    Unreadable(String),
    /// The board, all of it, is not to be seen.
    #[error("no board with {columns}x{rows} inner corners")]
    NoBoard {
        /// Inner corners along a row.
        columns: usize,
        /// Inner corners along a column.
        rows: usize,
    },
    /// Something like a board, but not one.
    #[error("no sound board: {0}")]
    NotABoard(#[from] NotABoard),
    /// It is not of the size that most others have.
    #[error("size {found}, while most are {expected}", found = size_text(*.found), expected = size_text(*.expected))]
    Size {
        /// Its size \[px\].
        found: [u32; 2],
        /// The size of most pictures \[px\].
        expected: [u32; 2],
    },
    /// OpenCV gave up on it.
    #[error(transparent)]
    Bridge(#[from] BridgeError),
}

fn size_text([width, height]: [u32; 2]) -> String {
    format!("{width}x{height} px")
}

/// No camera model can be found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Too few pictures show the board.
    #[error(
        "{found} picture(s) show the board, at least {FEWEST_VIEWS} must: take 10 to 20, \
         tilted to several sides, that fill the picture between them"
    )]
    TooFew {
        /// Pictures that show it.
        found: usize,
    },
    /// The fit broke down.
    #[error(transparent)]
    Bridge(#[from] BridgeError),
    /// The fit ended at something that is no camera.
    #[error(
        "the fit did not settle on a camera (focal lengths {} and {} px): \
         tilt the board more, and check that it is flat and counted right",
        focal_px[0], focal_px[1]
    )]
    NoCamera {
        /// The focal lengths it ended at \[px\].
        focal_px: [f64; 2],
    },
}

/// One picture in the solution.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The picture's name.
    pub name: String,
    /// The board's axes in the camera's.
    pub pose: Pose,
    /// Root mean square of the corners' reprojection errors \[px\].
    pub rms_px: f64,
    /// The largest of them \[px\].
    pub max_px: f64,
    /// The corners that were found \[px\].
    pub corners_px: Vec<ImagePoint>,
}

/// The camera, and how well each picture agrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Intrinsics and distortion.
    pub camera: Camera,
    /// Standard deviations of fx, fy, cx, cy \[px\], k1, k2, p1, p2, k3.
    pub sigma: [f64; 9],
    /// Size of the pictures \[px\].
    pub image_size_px: [u32; 2],
    /// Root mean square of all reprojection errors \[px\].
    pub rms_px: f64,
    /// The pictures, in the order in which they were given.
    pub views: Vec<View>,
}

/// Looks for the board in a picture.
pub fn look(board: &Board, name: &str, frame: &Frame) -> Result<Sighting, Refusal> {
    let (columns, rows) = board.corners();
    let corners =
        bridge::find_board(frame, (columns, rows))?.ok_or(Refusal::NoBoard { columns, rows })?;
    let side = |px: usize| u32::try_from(px).unwrap_or(u32::MAX);
    Ok(Sighting {
        name: name.to_owned(),
        image_size_px: [side(frame.width()), side(frame.height())],
        corners_px: board.order(corners)?,
    })
}

/// Keeps the size that most pictures have, the earlier one if two are as
/// common, and refuses the others.
pub fn agree_on_size(looks: &mut [(String, Result<Sighting, Refusal>)]) {
    let sizes: Vec<[u32; 2]> =
        looks.iter().filter_map(|(_, look)| look.as_ref().ok()).map(|s| s.image_size_px).collect();
    let count = |size: &[u32; 2]| sizes.iter().filter(|other| *other == size).count();
    // `max_by_key` keeps the last of equals, so it is asked from the end.
    let Some(expected) = sizes.iter().rev().max_by_key(|size| count(size)).copied() else {
        return;
    };
    for (_, look) in looks {
        if let Ok(Sighting { image_size_px: found, .. }) = look
            && *found != expected
        {
            *look = Err(Refusal::Size { found: *found, expected });
        }
    }
}

/// Fits the camera to sightings that are all of one size.
pub fn solve(board: &Board, sightings: &[Sighting]) -> Result<Solution, SolveError> {
    let Some(first) = sightings.first().filter(|_| sightings.len() >= FEWEST_VIEWS) else {
        return Err(SolveError::TooFew { found: sightings.len() });
    };
    let board_mm = board.corners_mm();
    let views: Vec<BoardView> = sightings
        .iter()
        .map(|s| BoardView { board_mm: board_mm.clone(), image_px: s.corners_px.clone() })
        .collect();
    let fit = bridge::calibrate_camera(&views, first.image_size_px)?;
    let numbers = fit.camera.focal_px.iter().chain(&fit.camera.centre_px);
    let finite = numbers.chain(&fit.camera.distortion).all(|number| number.is_finite());
    if !finite || fit.camera.focal_px.iter().any(|&f| f <= 0.0) {
        return Err(SolveError::NoCamera { focal_px: fit.camera.focal_px });
    }
    let views: Vec<View> = sightings
        .iter()
        .zip(fit.poses)
        .map(|(sighting, pose)| view(&fit.camera, &board_mm, sighting, pose))
        .collect();
    Ok(Solution {
        camera: fit.camera,
        sigma: fit.sigma,
        image_size_px: first.image_size_px,
        rms_px: root_mean_square(views.iter().map(|v| v.rms_px)),
        views,
    })
}

/// Errors of one picture by this crate's own camera model, the one that
/// measures later; a corner that it cannot project counts as infinitely far.
fn view(camera: &Camera, board_mm: &[Point3<f64>], sighting: &Sighting, pose: Pose) -> View {
    let errors: Vec<f64> = board_mm
        .iter()
        .zip(&sighting.corners_px)
        .map(|(corner, seen)| {
            let expected = camera.project(pose.apply(*corner));
            expected.map_or(f64::INFINITY, |px| (px - seen).norm())
        })
        .collect();
    View {
        name: sighting.name.clone(),
        pose,
        rms_px: root_mean_square(errors.iter().copied()),
        max_px: errors.iter().copied().fold(0.0, f64::max),
        corners_px: sighting.corners_px.clone(),
    }
}

#[expect(clippy::cast_precision_loss, reason = "a count of corners or pictures")]
fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|v| v * v).sum::<f64>() / count).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calib::Calibration;
    use crate::calib::plane::bed_from_board;
    use crate::calib::synthetic::{self, SIZE, TRUTH, board, poses};
    use crate::units::Mm;
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// What the true camera sees, off by up to `noise_px` in each direction.
    fn sightings(noise_px: f64) -> Vec<Sighting> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut off =
            || if noise_px > 0.0 { random.random_range(-noise_px..noise_px) } else { 0.0 };
        poses()
            .iter()
            .enumerate()
            .map(|(i, pose)| {
                let corners_px = synthetic::corners(pose, &mut off);
                Sighting { name: i.to_string(), image_size_px: SIZE, corners_px }
            })
            .collect()
    }

    #[test]
    fn exact_corners_give_the_true_camera_and_poses() {
        let solution = solve(&board(), &sightings(0.0)).unwrap();
        // OpenCV takes corners in single precision, which is 3e-5 px here.
        assert!(solution.rms_px < 1e-4, "rms {}", solution.rms_px);
        assert!((solution.camera.focal_px[0] - 1210.0).abs() < 0.02, "{:?}", solution.camera);
        assert!((solution.camera.centre_px[1] - 263.0).abs() < 0.02, "{:?}", solution.camera);
        for (view, truth) in solution.views.iter().zip(poses()) {
            assert!((view.pose.translation_mm() - truth.translation_mm()).norm() < 0.02);
            assert!(view.max_px < 1e-3);
        }
    }

    #[test]
    fn the_error_and_the_standard_deviations_are_those_of_the_noise() {
        let noise_px = 0.2;
        let solution = solve(&board(), &sightings(noise_px)).unwrap();
        // Uniform noise in x and y: a distance of RMS sqrt(2/3) of its half width.
        let expected = noise_px * (2.0_f64 / 3.0).sqrt();
        assert!((solution.rms_px / expected - 1.0).abs() < 0.1, "rms {}", solution.rms_px);
        let miss = (solution.camera.focal_px[0] - 1210.0).abs() / solution.sigma[0];
        assert!(miss < 3.0, "fx is off by {miss} standard deviations");
    }

    #[test]
    fn a_width_is_right_at_any_height_with_the_full_calibration() {
        let solution = solve(&board(), &sightings(0.0)).unwrap();
        let thickness = Mm::constant(4.0);
        let bed = bed_from_board(&solution.views[2].pose, thickness);
        let true_bed = bed_from_board(&poses()[2], thickness);
        let calibration = Calibration::Full {
            image_size_px: SIZE,
            camera: solution.camera,
            bed,
            robot_z: Mm::ZERO,
            quality: None,
        };
        for height in [0.0, 4.0, 20.0, 45.0] {
            let map = calibration.surface(Mm::constant(height), None);
            // A bead of 42 mm on the true bed, at this height.
            let edge = |x: f64| {
                let px = TRUTH.project(true_bed.apply(Point3::new(x, -40.0, height))).unwrap();
                map.to_mm(px).unwrap()
            };
            let width = (edge(100.0) - edge(58.0)).norm();
            assert!((width - 42.0).abs() < 0.005, "{width} mm at {height} mm");
        }
    }

    #[test]
    fn a_pose_alone_is_found_with_a_known_camera() {
        let (view, truth) = (&sightings(0.0)[3], &poses()[3]);
        let view = BoardView { board_mm: board().corners_mm(), image_px: view.corners_px.clone() };
        let pose = bridge::solve_pose(&view, &TRUTH).unwrap();
        assert!((pose.translation_mm() - truth.translation_mm()).norm() < 0.01);
        assert!((pose.rotation_rad() - truth.rotation_rad()).norm() < 1e-4);
    }

    #[test]
    fn pictures_of_another_size_are_refused_and_too_few_are_no_calibration() {
        let mut odd = sightings(0.0);
        odd[1].image_size_px = [540, 720];
        let mut looks: Vec<_> = odd.into_iter().map(|s| (s.name.clone(), Ok(s))).collect();
        agree_on_size(&mut looks);
        let said = looks[1].1.as_ref().unwrap_err().to_string();
        assert_eq!(said, "size 540x720 px, while most are 720x540 px");
        assert_eq!(looks.iter().filter(|look| look.1.is_ok()).count(), 11);
        let few = solve(&board(), &sightings(0.0)[..2]).unwrap_err();
        assert_eq!(few, SolveError::TooFew { found: 2 });
    }
}
