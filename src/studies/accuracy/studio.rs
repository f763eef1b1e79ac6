//! Renders the images of a set.

use std::cell::RefCell;

use nalgebra::Vector3;

use super::sets::{MM_PER_PX, Set};
use crate::calibration::{Calibration, Camera, SurfaceMap};
use crate::core::{Mm, Pose, Stamp};
use crate::scenario::bead::EdgeRoughness;
use crate::scenario::image::ImageModel;
use crate::sim::hash;
use crate::sim::render::{RenderError, Rendered, Renderer};
use crate::sim::view::gauge_middle;
use crate::sim::waviness::Waviness;
use crate::vision::Gauge;

/// Largest deviation of width and position from their nominal values \[px\]. Derived: it covers
/// every position within a pixel, either way.
const JITTER_PX: f64 = 1.0;

/// Renders the images of a set.
#[derive(Debug, Clone)]
pub struct SetStudio {
    renderer: Renderer,
    surface: SurfaceMap,
    gauge: Gauge,
    width_mm: f64,
    roughness: EdgeRoughness,
    seed: u64,
    /// Size of a pixel in the middle of the gauge \[mm\].
    mm_per_px: f64,
}

impl SetStudio {
    /// Prepares the renderer for a set.
    pub fn new(set: &Set) -> Result<Self, RenderError> {
        let calibration = if set.tilted {
            tilted()
        } else {
            Calibration::Scale { mm_per_px: MM_PER_PX, sigma: None }
        };
        let height = if set.tilted { Mm::constant(20.0) } else { Mm::ZERO };
        let gauge = set.gauge();
        let surface = calibration.surface(height, None);
        let seed = hash::mix(&set.name.bytes().map(u64::from).collect::<Vec<_>>());
        let image = ImageModel { size_px: set.size_px(), ..set.image };
        let mm_per_px =
            surface.mm_per_px(gauge_middle(&gauge.roi)).map_or(MM_PER_PX, |mm| mm.column(0).norm());
        let renderer = Renderer::new(calibration, height, gauge, image, seed)?;
        let (width_mm, roughness) = (set.width_mm, set.roughness);
        Ok(Self { renderer, surface, gauge, width_mm, roughness, seed, mm_per_px })
    }

    /// An image of a bead whose width and position differ from frame to frame.
    pub fn take(&self, frame: u64) -> Result<Rendered, RenderError> {
        let sway = |what: u64| {
            let fraction = hash::unit(hash::mix(&[self.seed, frame, what]));
            (2.0 * fraction - 1.0) * JITTER_PX * self.mm_per_px
        };
        let half = 0.5 * (self.width_mm + sway(1));
        let aside = sway(2);
        let waviness = Waviness::new(self.roughness, hash::mix(&[self.seed, frame, 3]));
        let waviness = RefCell::new(waviness);
        self.renderer.render(frame, Stamp::START, None, &|along_mm| {
            let [left, right] = waviness.borrow_mut().at(along_mm);
            Some((aside - half + left, aside + half + right))
        })
    }

    /// The gauge.
    pub fn gauge(&self) -> Gauge {
        self.gauge
    }

    /// The surface that the measurement is given.
    pub fn surface(&self) -> &SurfaceMap {
        &self.surface
    }

    /// Size of a pixel in the middle of the gauge \[mm\].
    pub fn mm_per_px(&self) -> f64 {
        self.mm_per_px
    }
}

/// A camera that looks down at an angle through a lens with distortion.
fn tilted() -> Calibration {
    Calibration::Full {
        image_size_px: [720, 540],
        camera: Camera {
            focal_px: [2500.0, 2490.0],
            centre_px: [352.0, 275.0],
            distortion: [-0.15, 0.4, 1e-3, -5e-4, 0.0, 0.0, 0.0, 0.0],
        },
        bed: Pose::new(Vector3::new(2.95, 0.08, -0.05), Vector3::new(3.0, -7.0, 395.0)),
        robot_z: Mm::constant(100.0),
        quality: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::accuracy::sets::all;

    #[test]
    fn pictures_are_of_their_set_and_frame_and_have_a_truth() {
        for set in all() {
            let studio = SetStudio::new(&set).unwrap();
            let (first, second) = (studio.take(0).unwrap(), studio.take(1).unwrap());
            let size = if set.tilted { [720, 540] } else { set.size_px() };
            let size = size.map(|side| usize::try_from(side).unwrap());
            assert_eq!([first.frame.width(), first.frame.height()], size);
            assert_eq!(studio.take(0).unwrap(), first);
            let truths = [&first, &second].map(|rendered| rendered.truth.unwrap());
            assert_ne!(truths[0].width_mm, truths[1].width_mm);
            for truth in truths {
                assert!((truth.width_mm - set.width_mm).abs() < 0.5, "{}", set.name);
            }
        }
    }
}
