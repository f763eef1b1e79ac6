//! The stand-off curve, figure 13 of the paper.

use nalgebra::Vector3;

use super::{MM_PER_PX, STAND_OFF_MM};
use crate::calibration::{Calibration, Camera, SurfaceMap};
use crate::cell::file::Cell;
use crate::core::geometry::Pose;
use crate::core::time::Stamp;
use crate::core::units::Mm;
use crate::sim::render::{RenderError, Renderer};
use crate::vision::Measurer;

/// A point of the stand-off curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandOff {
    /// How much nearer to the camera the bead is than where it was calibrated
    /// \[mm\].
    pub nearer_mm: f64,
    /// Error of a 42 mm width with the paper's single scale \[mm\].
    pub scale_error_mm: f64,
    /// Error with the full calibration and the height given \[mm\].
    pub full_error_mm: f64,
}

/// A camera that looks straight down from the stand-off, with the paper's
/// scale at height 0.
pub fn camera_above() -> Calibration {
    let focal = STAND_OFF_MM / MM_PER_PX;
    Calibration::Full {
        image_size_px: [720, 540],
        camera: Camera {
            focal_px: [focal, focal],
            centre_px: [359.5, 269.5],
            distortion: [0.0; 8],
        },
        bed: Pose::new(
            Vector3::new(std::f64::consts::PI, 0.0, 0.0),
            Vector3::new(0.0, 0.0, STAND_OFF_MM),
        ),
        robot_z: Mm::ZERO,
        quality: None,
    }
}

/// Pictures a 42 mm bead at several heights and measures it both ways.
pub fn stand_off(cell: &Cell) -> Result<Vec<StandOff>, RenderError> {
    const WIDTH_MM: f64 = 42.0;
    let calibration = camera_above();
    (-4i32..=4)
        .map(|step| {
            let nearer_mm = 5.0 * f64::from(step);
            let height = Mm::new(nearer_mm).unwrap_or_default();
            let picture = cell.simulation.image;
            let renderer = Renderer::new(calibration.clone(), height, cell.gauge, picture, 1)?;
            let bead = |_: f64| Some((-WIDTH_MM / 2.0, WIDTH_MM / 2.0));
            let frame = renderer.render(0, Stamp::START, None, &bead)?.frame;
            let mut measurer = Measurer::new(cell.gauge, None);
            let mut error = |map: &SurfaceMap| {
                measurer.measure(&frame, map).map_or(f64::NAN, |w| w.width.get() - WIDTH_MM)
            };
            Ok(StandOff {
                nearer_mm,
                scale_error_mm: error(&SurfaceMap::from_scale(MM_PER_PX)),
                full_error_mm: error(&calibration.surface(height, None)),
            })
        })
        .collect()
}
