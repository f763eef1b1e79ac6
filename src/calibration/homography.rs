//! Initial estimate of a camera and of the poses of boards from the homographies of the board's
//! plane (Zhang 2000).

use nalgebra::{DMatrix, Matrix3, Point2, Rotation3, Vector3};

use super::Camera;
use super::equations::Correspondence;
use crate::core::Pose;
use crate::numeric::number::to_f64;

/// Focal length over the longer side of the image where the boards do not determine it. A
/// choice: a usual lens.
const DEFAULT_FOCAL: f64 = 1.2;
/// Plausible focal lengths over the longer side.
const PLAUSIBLE_FOCAL: std::ops::RangeInclusive<f64> = 0.2..=50.0;

/// The homography from the plane of a board \[mm\] to an image by the direct linear transform
/// with normalised coordinates (Hartley and Zisserman 2004, algorithm 4.2). `None` for
/// collinear corners.
pub fn homography(pairs: &[(Point2<f64>, Point2<f64>)]) -> Option<Matrix3<f64>> {
    let from = normaliser(pairs.iter().map(|pair| pair.0))?;
    let to = normaliser(pairs.iter().map(|pair| pair.1))?;
    let mut rows = DMatrix::<f64>::zeros((2 * pairs.len()).max(9), 9);
    for (i, (source, target)) in pairs.iter().enumerate() {
        let (s, t) = (from.transform_point(source), to.transform_point(target));
        let point = [s.x, s.y, 1.0];
        for (k, value) in point.into_iter().enumerate() {
            rows[(2 * i, k)] = value;
            rows[(2 * i, 6 + k)] = -t.x * value;
            rows[(2 * i + 1, 3 + k)] = value;
            rows[(2 * i + 1, 6 + k)] = -t.y * value;
        }
    }
    let decomposition = rows.svd(false, true);
    let right = decomposition.v_t?;
    let (least, _) = decomposition.singular_values.argmin();
    let row = right.row(least);
    let normal = Matrix3::from_row_iterator(row.iter().copied());
    let found = to.try_inverse()? * normal * from;
    // The depth of a board in front of the camera is positive.
    let sign = if found[(2, 2)] < 0.0 { -1.0 } else { 1.0 };
    let size = found.norm() * sign;
    (size.abs() > 0.0 && size.is_finite()).then(|| found / size)
}

/// Shifts points to their mean and scales them to a mean distance of 1.
fn normaliser(points: impl Iterator<Item = Point2<f64>> + Clone) -> Option<Matrix3<f64>> {
    let count = to_f64(points.clone().count());
    if count < 4.0 {
        return None;
    }
    let middle = points.clone().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let distance = points.map(|p| (p.coords - middle).norm()).sum::<f64>() / count;
    let scale = 1.0 / distance;
    let moved =
        Matrix3::new(scale, 0.0, -scale * middle.x, 0.0, scale, -scale * middle.y, 0.0, 0.0, 1.0);
    (distance > 0.0).then_some(moved)
}

/// Corners as pairs of their positions on the board and in the image.
pub fn pairs(corners: &[Correspondence]) -> Vec<(Point2<f64>, Point2<f64>)> {
    corners.iter().map(|corner| (corner.on_board, corner.observed)).collect()
}

/// A pinhole camera with square pixels and its axis through the middle of the
/// image, from the views of a board: two conditions a view on the focal length
/// (Zhang 2000, equations 3 and 4).
pub fn pinhole(homographies: &[Matrix3<f64>], image_size_px: [u32; 2]) -> Camera {
    let [width, height] = image_size_px.map(f64::from);
    let middle = [(width - 1.0) / 2.0, (height - 1.0) / 2.0];
    let longer = width.max(height);
    let (mut weights, mut sum) = (0.0, 0.0);
    for found in homographies {
        let centred =
            Matrix3::new(1.0, 0.0, -middle[0], 0.0, 1.0, -middle[1], 0.0, 0.0, 1.0) * found;
        let (first, second) = (centred.column(0).into_owned(), centred.column(1).into_owned());
        let size = 0.5 * (first.norm_squared() + second.norm_squared()) / (longer * longer);
        let on_plane = |a: &Vector3<f64>, b: &Vector3<f64>| a.x * b.x + a.y * b.y;
        let conditions = [
            (on_plane(&first, &second), first.z * second.z),
            (
                on_plane(&first, &first) - on_plane(&second, &second),
                first.z * first.z - second.z * second.z,
            ),
        ];
        for (factor, rest) in conditions.map(|(factor, rest)| (factor / size, rest / size)) {
            weights += factor * factor;
            sum -= factor * rest;
        }
    }
    let focal = (weights / sum).max(0.0).sqrt() / longer;
    let focal = if PLAUSIBLE_FOCAL.contains(&focal) { focal } else { DEFAULT_FOCAL };
    Camera::pinhole([focal * longer; 2], middle)
}

/// Pose of a board from its homography into the plane z = 1; the rotation is the nearest one by
/// singular value decomposition (Zhang 2000, appendix C). `None` where the board is not in
/// front of the camera.
pub fn pose_from_homography(on_unit_plane: &Matrix3<f64>) -> Option<Pose> {
    let (first, second) = (on_unit_plane.column(0), on_unit_plane.column(1));
    let scale = 2.0 / (first.norm() + second.norm());
    let (x, y) = (first * scale, second * scale);
    let position = on_unit_plane.column(2) * scale;
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let decomposition = axes.svd(true, true);
    let rotation = decomposition.u? * decomposition.v_t?;
    let finite = rotation.iter().chain(position.iter()).all(|number| number.is_finite());
    (finite && position.z > 0.0)
        .then(|| Pose::from_parts(Rotation3::from_matrix_unchecked(rotation), position))
}

/// Pose of a board before a camera from its undistorted corners. `None` where the distortion
/// cannot be inverted at too many corners, or the board is not in front.
pub fn board_pose(camera: &Camera, corners: &[Correspondence]) -> Option<Pose> {
    let pair = |corner: &Correspondence| Some((corner.on_board, camera.ray(corner.observed)?));
    pose_from_homography(&homography(&corners.iter().filter_map(pair).collect::<Vec<_>>())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn a_pinhole_cameras_focal_length_and_poses_are_found_exactly() {
        let camera = Camera::pinhole([900.0; 2], [319.5, 239.5]);
        let poses: Vec<Pose> = (0..4)
            .map(|i| {
                let turn = f64::from(i) * 1.3;
                let tilt = Vector3::new(0.4 * turn.cos(), 0.4 * turn.sin(), 0.2 * turn);
                Pose::new(tilt, Vector3::new(-60.0, -40.0, 500.0 + 20.0 * turn))
            })
            .collect();
        let seen = |pose: &Pose| -> Vec<Correspondence> {
            (0..20)
                .map(|k| {
                    let on_board = Point2::new(f64::from(k % 5) * 30.0, f64::from(k / 5) * 30.0);
                    let at = Point3::new(on_board.x, on_board.y, 0.0);
                    let seen = camera.project(pose.apply(at)).unwrap();
                    Correspondence { on_board, bend: [0.0; 2], observed: seen }
                })
                .collect()
        };
        let views: Vec<_> = poses.iter().map(seen).collect();
        let maps: Vec<_> = views.iter().map(|view| homography(&pairs(view)).unwrap()).collect();
        let found = pinhole(&maps, [640, 480]);
        assert!((found.focal_px[0] - 900.0).abs() < 1e-6, "{found:?}");
        for (view, truth) in views.iter().zip(&poses) {
            let pose = board_pose(&camera, view).unwrap();
            assert!((pose.translation_mm() - truth.translation_mm()).norm() < 1e-6);
            assert!((pose.rotation_rad() - truth.rotation_rad()).norm() < 1e-8);
        }
    }

    #[test]
    fn boards_seen_straight_on_leave_a_usual_focal_length() {
        let scaled = Matrix3::from_diagonal(&Vector3::new(2.0, 2.0, 1.0));
        let found = pinhole(&[scaled, scaled], [640, 480]);
        assert_eq!(found.focal_px, [DEFAULT_FOCAL * 640.0; 2]);
    }

    #[test]
    fn corners_on_one_spot_have_no_map() {
        assert!(homography(&[(Point2::origin(), Point2::origin()); 9]).is_none());
        assert!(homography(&[]).is_none());
    }
}
