//! A series of images along a bead that is laid at one speed.

use super::laid::LaidBead;
use super::render::{RenderError, Rendered, Renderer};
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::core::{Mm, Stamp};

/// Frame rate of a cell that gives none \[Hz\]: that of Shojaei Barjuei et al. 2022.
const DEFAULT_RATE_HZ: f64 = 10.0;

/// A bead that extends beyond both ends of the images, and the positions along it at which images
/// are taken.
#[derive(Debug, Clone)]
pub struct FrameSeries {
    renderer: Renderer,
    bead: LaidBead,
    speed_mm_per_s: f64,
    spacing_mm: f64,
    frames: u64,
}

impl FrameSeries {
    /// The images of a cell. The bead is laid at the robot's start speed, or at the bead model's
    /// reference speed if the cell has no robot. The middle of the gauge moves from 0 to the
    /// length of the simulated path.
    pub fn new(cell: &Cell, calibration: Calibration) -> Result<Self, RenderError> {
        let simulation = &cell.simulation;
        let seed = simulation.seed;
        let renderer =
            Renderer::new(calibration, cell.surface_height, cell.gauge, simulation.image, seed)?;
        let robot = cell.run.as_ref().map(|run| run.robot.start_speed.get());
        let reference = simulation.bead.at_speed_mm_per_s;
        let speed_mm_per_s = robot.filter(|speed| *speed > 0.0).unwrap_or(reference);
        let rate_hz = cell.frame_rate_hz.unwrap_or(DEFAULT_RATE_HZ);
        let spacing_mm = simulation.frame_spacing.map_or(speed_mm_per_s / rate_hz, Mm::get);
        let length_mm = simulation.path.get();
        // Twice the reach, because roughness and slant move the edges.
        let beyond_mm = 2.0 * renderer.reach_mm(None)?;
        let mut bead = LaidBead::new(simulation.bead, simulation.roughness, simulation.flow, seed);
        bead.lay(-beyond_mm, length_mm + beyond_mm, speed_mm_per_s);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "positive, and a float-to-integer cast saturates"
        )]
        let frames = (length_mm / spacing_mm + 1e-9) as u64 + 1;
        Ok(Self { renderer, bead, speed_mm_per_s, spacing_mm, frames })
    }

    /// Number of images.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Path length from one image to the next \[mm\].
    pub fn spacing_mm(&self) -> f64 {
        self.spacing_mm
    }

    /// Speed at which the bead is laid \[mm/s\].
    pub fn speed_mm_per_s(&self) -> f64 {
        self.speed_mm_per_s
    }

    /// Time of an image since the first one \[s\].
    pub fn time_s(&self, frame: u64) -> f64 {
        self.path_mm(frame) / self.speed_mm_per_s
    }

    /// Renders an image.
    pub fn render(&self, frame: u64) -> Result<Rendered, RenderError> {
        let path_mm = self.path_mm(frame);
        let stamp = Stamp::from_secs(self.time_s(frame));
        self.renderer.render(frame, stamp, None, &|along| self.bead.edges_at(path_mm + along))
    }

    #[expect(clippy::cast_precision_loss, reason = "no series has 2^53 pictures")]
    fn path_mm(&self, frame: u64) -> f64 {
        frame as f64 * self.spacing_mm
    }
}
