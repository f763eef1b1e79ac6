//! The stand-off curve, figure 13 of the paper.

use nalgebra::Vector3;

use super::{MM_PER_PX, STAND_OFF_MM};
use crate::calibration::{Calibration, Camera, SurfaceMap};
use crate::cell::file::Cell;
use crate::core::{Mm, Pose, Stamp};
use crate::sim::render::{RenderError, Renderer};
use crate::vision::Measurer;

/// A point of the stand-off curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandOff {
    /// Height of the bead above the calibrated surface, towards the camera \[mm\].
    pub nearer_mm: f64,
    /// Error of a 42 mm width with the paper's single scale \[mm\].
    pub scale_error_mm: f64,
    /// Error with the full calibration and the known height \[mm\].
    pub full_error_mm: f64,
}

/// A camera that looks straight down from the stand-off distance, with the paper's image size, and
/// its scale at height 0.
pub fn camera_above() -> Calibration {
    let focal = STAND_OFF_MM / MM_PER_PX;
    let (focal_px, centre_px, distortion) = ([focal, focal], [359.5, 269.5], [0.0; 8]);
    let down = Vector3::new(std::f64::consts::PI, 0.0, 0.0);
    Calibration::Full {
        image_size_px: [720, 540],
        camera: Camera { focal_px, centre_px, distortion },
        bed: Pose::new(down, Vector3::new(0.0, 0.0, STAND_OFF_MM)),
        robot_z: Mm::ZERO,
        quality: None,
    }
}

/// Renders a 42 mm bead at several heights and measures it with both calibrations.
pub fn stand_off(cell: &Cell) -> Result<Vec<StandOff>, RenderError> {
    /// Shojaei Barjuei et al. 2022, figure 13.
    const WIDTH_MM: f64 = 42.0;
    let calibration = camera_above();
    let point = |step: i32| {
        let nearer_mm = 5.0 * f64::from(step);
        let height = Mm::new(nearer_mm).unwrap_or_default();
        let image = cell.simulation.image;
        let renderer = Renderer::new(calibration.clone(), height, cell.gauge, image, 1)?;
        let bead = |_: f64| Some((-WIDTH_MM / 2.0, WIDTH_MM / 2.0));
        let frame = renderer.render(0, Stamp::START, None, &bead)?.frame;
        let mut measurer = Measurer::new(cell.gauge, None);
        let mut error = |map: &SurfaceMap| {
            measurer.measure(&frame, map).map_or(f64::NAN, |w| w.width.get() - WIDTH_MM)
        };
        let scale_error_mm = error(&SurfaceMap::from_scale(MM_PER_PX));
        let full_error_mm = error(&calibration.surface(height, None));
        Ok(StandOff { nearer_mm, scale_error_mm, full_error_mm })
    };
    (-4i32..=4).map(point).collect()
}
