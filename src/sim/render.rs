//! Images of a bead, with their true widths.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::bead_path::BeadPath;
use super::coverage::{BeadCoverage, Masks};
use super::light::Light;
use super::outline::{BeadEdges, BeadOutline};
use super::shade::{self, BeadShape};
use super::tint::Tint;
use super::truth::{self, Truth};
use super::view::{BeadView, GaugeExtent};
use super::{grains, hash, motion, spots, texture};
use crate::calibration::Calibration;
use crate::cell::Cell;
use crate::core::{Frame, ImagePoint, Mm, Pixels, Size, Stamp, WrongSize};
use crate::numeric::number::to_f64;
use crate::scenario::image::ImageModel;
use crate::vision::{BeadAxis, Gauge};

/// Random stream of spots in a frame; noise has none.
const SPOTS_STREAM: u64 = 1;
/// Random stream of grains.
const GRAINS_STREAM: u64 = 2;
/// Random stream of the texture.
const TEXTURE_STREAM: u64 = 3;

/// Renders images of a bead that runs through the gauge of a calibrated camera.
///
/// The bead's edges are projected through the camera with its distortion; every pixel is the exact
/// integral of the blurred edge's tangent over its area. Shading, shadows, spots and grains are
/// added, with the same blur and motion as the edges. The light, 1 in the middle of the image,
/// multiplies the result; texture and noise are added before rounding, and values above 255 are
/// saturated. A frame depends on the seed and its number, not on earlier frames. For the direction
/// of travel see [`super::view`].
#[derive(Debug, Clone)]
pub struct Renderer {
    calibration: Calibration,
    surface_height: Mm,
    /// Height of the bead above that of the first layer.
    rise: Mm,
    gauge: Gauge,
    image: ImageModel,
    size: (usize, usize),
    seed: u64,
}

/// A frame and its true width.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// The frame, 8 bits per pixel.
    pub frame: Frame,
    /// The true width; `None` unless the bead runs through the whole gauge.
    pub truth: Option<Truth>,
}

/// Why a bead cannot be rendered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The gauge does not lie within the image.
    #[error(
        "the gauge reaches to ({}, {}) px, the image has {} x {} px; make one fit the other",
        end.0, end.1, image.0, image.1
    )]
    GaugeOutside {
        /// Right and lower side of the gauge \[px\].
        end: (usize, usize),
        /// Size of the image \[px\].
        image: (usize, usize),
    },
    /// The middle of the gauge sees no surface.
    #[error(
        "the middle of the gauge does not see the surface at {height_mm} mm above the bed; \
         check the calibration and the surface's height"
    )]
    OffSurface {
        /// Height of the surface above the bed at the camera's current height \[mm\].
        height_mm: f64,
    },
    /// An image without pixels.
    #[error(transparent)]
    WrongSize(#[from] WrongSize),
}

impl Renderer {
    /// For the simulated bead of a cell. Fails like [`Self::new`].
    pub fn of_cell(cell: &Cell, calibration: &Calibration) -> Result<Self, RenderError> {
        let (height, simulation) = (cell.surface_height, &cell.simulation);
        Self::new(calibration.clone(), height, cell.gauge, simulation.image, simulation.seed)
    }

    /// For a bead with top edges at `surface_height` above the bed, or at the true height in
    /// `image`. The size of the image is that of a full calibration. Fails if the gauge is not
    /// within the image.
    pub fn new(
        calibration: Calibration,
        surface_height: Mm,
        gauge: Gauge,
        image: ImageModel,
        seed: u64,
    ) -> Result<Self, RenderError> {
        let side = |px: u32| usize::try_from(px).unwrap_or(usize::MAX);
        let size_px = calibration.image_size_px().unwrap_or(image.size_px);
        let size = (side(size_px[0]), side(size_px[1]));
        if !gauge.roi.fits(Size::new(size.0, size.1)) {
            let roi = gauge.roi;
            let reaches = (roi.x.saturating_add(roi.width), roi.y.saturating_add(roi.height));
            return Err(RenderError::GaugeOutside { end: reaches, image: size });
        }
        let true_height = image.true_surface_height_mm.and_then(|height| Mm::new(height).ok());
        let surface_height = true_height.unwrap_or(surface_height);
        let rise = Mm::ZERO;
        Ok(Self { calibration, surface_height, rise, gauge, image, size, seed })
    }

    /// Sets the height of the bead above that of the first layer.
    pub fn raise(&mut self, rise: Mm) {
        self.rise = rise;
    }

    /// Renders an image of a bead; `robot_z` is the robot's height, for a camera that is mounted
    /// on it.
    pub fn render(
        &self,
        seq: u64,
        captured_at: Stamp,
        robot_z: Option<Mm>,
        bead: &BeadEdges<'_>,
    ) -> Result<Rendered, RenderError> {
        let view = self.view(robot_z)?;
        let GaugeExtent { run, cross } = self.extent();
        // An additional margin of half the image across, for slanted edges.
        let margin = to_f64(shade::margin_px(self.image.blur_px) + cross / 2);
        let margin = margin + self.image.motion.length_px;
        let outline = BeadOutline::trace(&view, bead, to_f64(run), margin);
        let seen = outline.as_ref().map(|outline| self.coverage(seq, outline, &view));
        let pixels = self.expose(seq, seen.as_ref());
        let truth = outline.and_then(|outline| truth::of(&outline, &view, &self.gauge));
        let size = Size::new(self.size.0, self.size.1);
        let frame = Frame::new(seq, captured_at, size, Pixels::Grey8(pixels))?;
        Ok(Rendered { frame, truth })
    }

    /// Distance from the middle of the gauge to the image's farthest point, along the bead \[mm\];
    /// at most a metre.
    pub fn reach_mm(&self, robot_z: Option<Mm>) -> Result<f64, RenderError> {
        /// Limit of that distance \[mm\], for cameras that see the horizon.
        const MAX_REACH_MM: f64 = 1000.0;
        let view = self.view(robot_z)?;
        let (right, below) = (to_f64(self.size.0) - 0.5, to_f64(self.size.1) - 0.5);
        let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, below), (right, below)];
        let reach = corners.into_iter().map(|(x, y)| {
            view.along_mm(ImagePoint::new(x, y)).map_or(MAX_REACH_MM, f64::abs).min(MAX_REACH_MM)
        });
        Ok(reach.fold(0.0, f64::max))
    }

    fn view(&self, robot_z: Option<Mm>) -> Result<BeadView, RenderError> {
        let height = self.surface_height + self.rise;
        let map = self.calibration.surface(height, robot_z);
        let ImageModel { slant_deg, lateral_mm, .. } = self.image;
        BeadView::new(map, &self.gauge, slant_deg, lateral_mm)
            .map(|view| view.bent(BeadPath::new(&self.image.bend)))
            .ok_or(RenderError::OffSurface { height_mm: height.get() })
    }

    /// Pixels along and across the gauge's axis.
    fn extent(&self) -> GaugeExtent {
        let (width, height) = self.size;
        match self.gauge.axis {
            BeadAxis::Vertical => GaugeExtent { run: height, cross: width },
            BeadAxis::Horizontal => GaugeExtent { run: width, cross: height },
        }
    }

    /// Bead and ground on each pixel, without light, texture and noise.
    fn coverage(&self, seq: u64, outline: &BeadOutline, view: &BeadView) -> BeadCoverage {
        let image = &self.image;
        let shape = BeadShape::new(outline, view, self.extent(), image.blur_px);
        let positions = motion::positions(&image.motion, image.blur_px);
        let mut seen = BeadCoverage::of(&shape, Tint::new(image).as_ref(), &positions);
        let spots = spots::spots(&image.spots, &shape, hash::mix(&[self.seed, seq, SPOTS_STREAM]));
        let grains =
            grains::grains(&image.grains, &shape, hash::mix(&[self.seed, seq, GRAINS_STREAM]));
        if spots.is_some() || grains.is_some() {
            let light = Light::new(image, self.size.0, self.size.1);
            let at = |run: usize, cross: usize| match self.gauge.axis {
                BeadAxis::Vertical => light.at(cross, run),
                BeadAxis::Horizontal => light.at(run, cross),
            };
            seen.cover(&shape, image, Masks { spots, grains }, &at, &positions);
        }
        match self.gauge.axis {
            BeadAxis::Vertical => seen,
            BeadAxis::Horizontal => seen.turned(self.extent().cross),
        }
    }

    /// Grey levels from coverage, light, texture and noise.
    fn expose(&self, seq: u64, seen: Option<&BeadCoverage>) -> Vec<u8> {
        let ImageModel { bead_grey, ground_grey, noise_grey, .. } = self.image;
        let step = bead_grey - ground_grey;
        let light = Light::new(&self.image, self.size.0, self.size.1);
        let key = hash::mix(&[self.seed, seq, TEXTURE_STREAM]);
        let texture = texture::texture(&self.image.texture, self.size.0, self.size.1, key);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(hash::mix(&[self.seed, seq]));
        let (width, height) = self.size;
        let mut pixels = Vec::with_capacity(width * height);
        for row in 0..height {
            let line = |values: &'_ [f32], column: usize| f64::from(values[row * width + column]);
            let (first, growth) = light.row(row);
            for column in 0..width {
                let fraction = seen.map_or(0.0, |seen| line(&seen.fractions, column));
                let added = seen.and_then(|seen| seen.added_grey.as_deref());
                let added = added.map_or(0.0, |added| line(added, column));
                let lit = first + growth * to_f64(column);
                let mut grey = lit * (ground_grey + step * fraction + added);
                grey += texture.as_deref().map_or(0.0, |texture| line(texture, column));
                if noise_grey > 0.0 {
                    let noise: f64 = StandardNormal.sample(&mut random);
                    grey += noise_grey * noise;
                }
                pixels.push(rounded(grey));
            }
        }
        pixels
    }
}

/// The nearest 8-bit level.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a float-to-integer cast saturates, as a sensor does"
)]
fn rounded(grey: f64) -> u8 {
    (grey + 0.5) as u8
}

#[cfg(test)]
mod tests;
