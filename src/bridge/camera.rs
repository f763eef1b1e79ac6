//! Camera model and poses from the corners of a board.

use nalgebra::{Point2, Point3, Vector3};
use opencv::calib3d::{SOLVEPNP_ITERATIVE, calibrate_camera_extended, solve_pnp};
use opencv::core::{
    Mat, MatTraitConst, MatTraitConstManual, Point2f, Point3f, Size, TermCriteria,
    TermCriteria_Type, Vector,
};

use super::{BridgeError, during, prepare};
use crate::calib::Camera;
use crate::geometry::{ImagePoint, Pose};

/// The corners of the board in one picture.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardView {
    /// Where they are on the board \[mm\].
    pub board_mm: Vec<Point3<f64>>,
    /// Where they are seen \[px\].
    pub image_px: Vec<ImagePoint>,
}

/// What the pictures of a board say about the camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFit {
    /// Intrinsics and distortion.
    pub camera: Camera,
    /// Standard deviations of fx, fy, cx, cy \[px\], k1, k2, p1, p2, k3, as far
    /// as the residuals tell.
    pub sigma: [f64; 9],
    /// The board's axes in the camera's, a view each.
    pub poses: Vec<Pose>,
    /// Root mean square distance of the corners from where the model puts
    /// them, a view each \[px\].
    pub rms_px: Vec<f64>,
    /// The same over all corners \[px\].
    pub overall_rms_px: f64,
}

const FIT_STEPS: i32 = 200;
const FIT_TOLERANCE: f64 = 1e-10;

fn stop_of_fit() -> TermCriteria {
    TermCriteria {
        typ: TermCriteria_Type::COUNT as i32 | TermCriteria_Type::EPS as i32,
        max_count: FIT_STEPS,
        epsilon: FIT_TOLERANCE,
    }
}

/// Fits a pinhole with five coefficients of distortion to views of a board
/// (Zhang 2000, Levenberg–Marquardt on the reprojection error).
pub fn calibrate_camera(
    views: &[BoardView],
    image_size_px: [u32; 2],
) -> Result<CameraFit, BridgeError> {
    const TASK: &str = "fitting the camera model";
    prepare();
    let board: Vector<Vector<Point3f>> = views.iter().map(|v| board_points(&v.board_mm)).collect();
    let seen: Vector<Vector<Point2f>> = views.iter().map(|v| image_points(&v.image_px)).collect();
    let [width, height] = image_size_px.map(|px| i32::try_from(px).unwrap_or(i32::MAX));
    let (mut matrix, mut distortion) = (Mat::default(), Mat::default());
    let (mut rotations, mut translations) = (Vector::<Mat>::new(), Vector::<Mat>::new());
    let (mut sigma, mut sigma_poses, mut rms_px) = (Mat::default(), Mat::default(), Mat::default());
    let overall_rms_px = calibrate_camera_extended(
        &board,
        &seen,
        Size::new(width, height),
        &mut matrix,
        &mut distortion,
        &mut rotations,
        &mut translations,
        &mut sigma,
        &mut sigma_poses,
        &mut rms_px,
        0,
        stop_of_fit(),
    )
    .map_err(during(TASK))?;
    let poses = rotations
        .iter()
        .zip(translations.iter())
        .map(|(r, t)| Ok(Pose::new(vector(&r)?, vector(&t)?)))
        .collect::<opencv::Result<Vec<Pose>>>();
    Ok(CameraFit {
        camera: camera(&matrix, &distortion).map_err(during(TASK))?,
        sigma: first(&sigma).map_err(during(TASK))?,
        poses: poses.map_err(during(TASK))?,
        rms_px: rms_px.data_typed::<f64>().map_err(during(TASK))?.to_vec(),
        overall_rms_px,
    })
}

/// The pose of a board in the camera's axes, for a camera that is known.
pub fn solve_pose(view: &BoardView, camera: &Camera) -> Result<Pose, BridgeError> {
    const TASK: &str = "finding the pose of a board";
    prepare();
    let [fx, fy] = camera.focal_px;
    let [cx, cy] = camera.centre_px;
    let matrix = [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]];
    let (mut rotation, mut translation) = (Mat::default(), Mat::default());
    let solved = Mat::from_slice_2d(&matrix)
        .and_then(|matrix| {
            solve_pnp(
                &board_points(&view.board_mm),
                &image_points(&view.image_px),
                &matrix,
                &Vector::<f64>::from_slice(&camera.distortion),
                &mut rotation,
                &mut translation,
                false,
                SOLVEPNP_ITERATIVE,
            )
        })
        .map_err(during(TASK))?;
    if !solved {
        let what = "the corners fit no pose".to_owned();
        return Err(BridgeError { task: TASK, what });
    }
    let read = |m: &Mat| vector(m).map_err(during(TASK));
    Ok(Pose::new(read(&rotation)?, read(&translation)?))
}

#[expect(clippy::cast_possible_truncation, reason = "OpenCV calibrates on single precision")]
fn board_points(points: &[Point3<f64>]) -> Vector<Point3f> {
    points.iter().map(|p| Point3f::new(p.x as f32, p.y as f32, p.z as f32)).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "OpenCV calibrates on single precision")]
fn image_points(points: &[Point2<f64>]) -> Vector<Point2f> {
    points.iter().map(|p| Point2f::new(p.x as f32, p.y as f32)).collect()
}

fn camera(matrix: &Mat, distortion: &Mat) -> opencv::Result<Camera> {
    let k = |row, column| matrix.at_2d::<f64>(row, column).copied();
    Ok(Camera {
        focal_px: [k(0, 0)?, k(1, 1)?],
        centre_px: [k(0, 2)?, k(1, 2)?],
        distortion: first(distortion)?,
    })
}

fn vector(m: &Mat) -> opencv::Result<Vector3<f64>> {
    Ok(Vector3::from(first::<3>(m)?))
}

/// The first `N` numbers of a matrix.
fn first<const N: usize>(m: &Mat) -> opencv::Result<[f64; N]> {
    let numbers = m.data_typed::<f64>()?;
    numbers.first_chunk().copied().ok_or_else(|| {
        let what = format!("expected {N} numbers, found {}", numbers.len());
        opencv::Error::new(opencv::core::StsUnmatchedSizes, what)
    })
}
