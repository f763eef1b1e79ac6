//! The scale of the 2022 paper from a full calibration, and its validity.

use nalgebra::Point2;

use super::{Calibration, SurfaceMap};
use crate::core::{ImagePoint, Mm};

/// One scale for all pixels, and its range over the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleScale {
    /// Millimetres a pixel in the middle of the image, mean of all
    /// directions.
    pub mm_per_px: f64,
    /// Half the difference between the largest and the smallest scale of that pixel over
    /// direction: the error for a bead along one of them \[mm/px\].
    pub uneven: f64,
    /// The smallest anywhere in the image, in any direction \[mm/px\].
    pub smallest: f64,
    /// The largest anywhere in the image, in any direction \[mm/px\].
    pub largest: f64,
}

/// Points along each side at which the scale is evaluated. A choice: the extremes are at the
/// boundary.
const GRID_POINTS: u32 = 9;

/// The scale of Shojaei Barjuei et al. 2022, section 4.3.1, at a surface of this height. `None`
/// where the middle of the image does not see the surface, and for a calibration without an
/// image size.
pub fn single_scale(calibration: &Calibration, surface_height: Mm) -> Option<SingleScale> {
    let image_size_px = calibration.image_size_px()?;
    let [width, height] = image_size_px.map(|px| f64::from(px) - 1.0);
    let map = calibration.surface(surface_height, None);
    let sizes = |px: ImagePoint| Some(map.mm_per_px(px)?.singular_values());
    let mm_per_px = in_the_middle(&map, image_size_px)?;
    let steps = f64::from(GRID_POINTS - 1);
    let (smallest, largest) = (0..GRID_POINTS * GRID_POINTS)
        .map(|i| (f64::from(i % GRID_POINTS) / steps, f64::from(i / GRID_POINTS) / steps))
        .filter_map(|(x, y)| sizes(Point2::new(x * width, y * height)))
        .fold((mm_per_px, mm_per_px), |(low, high), s| (low.min(s.min()), high.max(s.max())));
    let middle = sizes(Point2::new(width / 2.0, height / 2.0))?;
    let uneven = 0.5 * (middle.max() - middle.min());
    Some(SingleScale { mm_per_px, uneven, smallest, largest })
}

/// Millimetres a pixel in the middle of an image of this size, mean of all directions; `None` where
/// the middle does not see the surface.
pub(super) fn in_the_middle(map: &SurfaceMap, image_size_px: [u32; 2]) -> Option<f64> {
    let [x, y] = image_size_px.map(|px| (f64::from(px) - 1.0) / 2.0);
    Some(map.mm_per_px(Point2::new(x, y))?.determinant().abs().sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Camera;
    use crate::core::Pose;
    use nalgebra::Vector3;

    fn camera_at(turn: Vector3<f64>) -> Calibration {
        let focal_px = [2500.0, 2500.0];
        Calibration::Full {
            image_size_px: [720, 540],
            camera: Camera { focal_px, centre_px: [359.5, 269.5], distortion: [0.0; 8] },
            bed: Pose::new(turn, Vector3::new(0.0, 0.0, 400.0)),
            robot_z: Mm::ZERO,
            quality: None,
        }
    }

    #[test]
    fn straight_down_it_is_distance_over_focal_length_everywhere() {
        let straight = camera_at(Vector3::new(std::f64::consts::PI, 0.0, 0.0));
        let scale = single_scale(&straight, Mm::constant(20.0)).unwrap();
        for value in [scale.mm_per_px, scale.smallest, scale.largest] {
            assert!((value - 380.0 / 2500.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_tilted_view_shows_in_the_spread() {
        let tilted = camera_at(Vector3::new(std::f64::consts::PI - 0.3, 0.0, 0.0));
        let scale = single_scale(&tilted, Mm::ZERO).unwrap();
        // At the principal point: d/f across, d/(f·cos 0.3) along the tilt.
        let expected = 400.0 / 2500.0 / 0.3_f64.cos().sqrt();
        assert!((scale.mm_per_px / expected - 1.0).abs() < 1e-4);
        assert!(scale.smallest < 0.98 * scale.mm_per_px && scale.largest > 1.04 * scale.mm_per_px);
    }
}
