//! Pictures of a bead, with their truth.

use nalgebra::Vector2;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::hash;
use super::outline::{Bead, Outline};
use super::picture::Picture;
use super::shade;
use super::truth::{self, Truth};
use super::view::View;
use crate::calib::Calibration;
use crate::frame::{Frame, Pixels, WrongSize};
use crate::geometry::ImagePoint;
use crate::time::Stamp;
use crate::units::Mm;
use crate::vision::{Axis, Gauge};

/// Takes pictures of a bead that runs through the gauge of a calibrated
/// camera.
///
/// The bead's edges are projected through the camera and its distortion; every
/// pixel is the exact integral of the blurred edge's tangent over its area.
/// Light, which falls off evenly from the lower right to the upper left corner
/// and is 1 in the middle of the picture, multiplies the result, and noise is
/// added before rounding. A frame depends on the seed and its number, not on
/// the frames before it. For the direction of travel see [`super::view`].
#[derive(Debug, Clone)]
pub struct Renderer {
    calibration: Calibration,
    surface_height: Mm,
    gauge: Gauge,
    picture: Picture,
    size: (usize, usize),
    seed: u64,
}

/// A frame and what is true of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// The frame, 8 bits a pixel.
    pub frame: Frame,
    /// `None` unless the bead runs through the whole gauge.
    pub truth: Option<Truth>,
}

/// A bead that cannot be pictured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The gauge does not lie within the picture.
    #[error(
        "the gauge reaches to ({}, {}) px, the picture has {} x {} px; make one fit the other",
        reaches.0, reaches.1, picture.0, picture.1
    )]
    GaugeOutside {
        /// Right and lower side of the gauge \[px\].
        reaches: (usize, usize),
        /// Size of the picture \[px\].
        picture: (usize, usize),
    },
    /// The middle of the gauge sees no surface.
    #[error(
        "the middle of the gauge does not see the surface at {height_mm} mm above the bed; \
         check the calibration and the surface's height"
    )]
    OffSurface {
        /// Height of the surface above the bed, as the camera is now \[mm\].
        height_mm: f64,
    },
    /// A picture without pixels.
    #[error(transparent)]
    WrongSize(#[from] WrongSize),
}

impl Renderer {
    /// For a bead whose top edges lie at `surface_height` above the bed, or
    /// where `picture` says that they really are. A full calibration sets the
    /// size of the picture. Fails where the gauge lies outside the picture.
    pub fn new(
        calibration: Calibration,
        surface_height: Mm,
        gauge: Gauge,
        picture: Picture,
        seed: u64,
    ) -> Result<Self, RenderError> {
        let side = |px: u32| usize::try_from(px).unwrap_or(usize::MAX);
        let size_px = calibration.image_size_px().unwrap_or(picture.size_px);
        let size = (side(size_px[0]), side(size_px[1]));
        if !gauge.roi.fits(size) {
            let roi = gauge.roi;
            let reaches = (roi.x.saturating_add(roi.width), roi.y.saturating_add(roi.height));
            return Err(RenderError::GaugeOutside { reaches, picture: size });
        }
        let true_height = picture.true_surface_height_mm.and_then(|height| Mm::new(height).ok());
        let surface_height = true_height.unwrap_or(surface_height);
        Ok(Self { calibration, surface_height, gauge, picture, size, seed })
    }

    /// Columns and rows of the pictures \[px\].
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Takes a picture of a bead, with the robot at `robot_z` if the camera
    /// rides on it.
    pub fn render(
        &self,
        seq: u64,
        captured_at: Stamp,
        robot_z: Option<Mm>,
        bead: &Bead<'_>,
    ) -> Result<Rendered, RenderError> {
        let view = self.view(robot_z)?;
        let (run, cross) = self.extent();
        // Half the picture across more, for edges that run at an angle.
        let margin = shade::margin_px(self.picture.blur_px) + cross / 2;
        let outline = Outline::trace(&view, bead, float(run), float(margin));
        let shares = outline.as_ref().map(|outline| self.shares(outline, &view));
        let light = self.light();
        let pixels = self.expose(seq, shares.as_deref(), light);
        let truth = outline.and_then(|outline| truth::of(&outline, &view, &self.gauge));
        let frame = Frame::new(seq, captured_at, self.size, Pixels::Grey8(pixels))?;
        Ok(Rendered { frame, truth })
    }

    /// How far from the middle of the gauge the picture reaches along the bead
    /// \[mm\], at most a metre.
    pub fn reach_mm(&self, robot_z: Option<Mm>) -> Result<f64, RenderError> {
        const FARTHEST_MM: f64 = 1000.0;
        let view = self.view(robot_z)?;
        let (right, below) = (float(self.size.0) - 0.5, float(self.size.1) - 0.5);
        let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, below), (right, below)];
        let reach = corners.into_iter().map(|(x, y)| {
            view.along_mm(ImagePoint::new(x, y)).map_or(FARTHEST_MM, f64::abs).min(FARTHEST_MM)
        });
        Ok(reach.fold(0.0, f64::max))
    }

    fn view(&self, robot_z: Option<Mm>) -> Result<View, RenderError> {
        let map = self.calibration.surface(self.surface_height, robot_z);
        let Picture { slant_deg, lateral_mm, .. } = self.picture;
        View::new(map, &self.gauge, slant_deg, lateral_mm)
            .ok_or(RenderError::OffSurface { height_mm: self.surface_height.get() })
    }

    /// Pixels along and across the gauge's axis.
    fn extent(&self) -> (usize, usize) {
        let (width, height) = self.size;
        match self.gauge.axis {
            Axis::Vertical => (height, width),
            Axis::Horizontal => (width, height),
        }
    }

    /// Share of bead in every pixel, row by row.
    fn shares(&self, outline: &Outline, view: &View) -> Vec<f32> {
        let (width, height) = self.size;
        let mut shares = vec![0.0; width * height];
        let blur = self.picture.blur_px;
        shade::shade(outline, view, self.extent(), blur, |at, first, line| match self.gauge.axis {
            Axis::Vertical => {
                let start = at * width + first;
                shares[start..start + line.len()].copy_from_slice(line);
            }
            Axis::Horizontal => {
                for (share, row) in line.iter().zip(first..) {
                    shares[row * width + at] = *share;
                }
            }
        });
        shares
    }

    /// Light at the first pixel, and its growth to the right and downwards.
    fn light(&self) -> (f64, Vector2<f64>) {
        let ratio = self.picture.light_ratio.max(1.0);
        let swing = (ratio - 1.0) / (ratio + 1.0);
        let growth = |count: usize| swing / (float(count) - 1.0).max(1.0);
        let growth = Vector2::new(growth(self.size.0), growth(self.size.1));
        let middle = Vector2::new(float(self.size.0) - 1.0, float(self.size.1) - 1.0) / 2.0;
        (1.0 - growth.dot(&middle), growth)
    }

    /// Grey levels from shares of bead, light and noise.
    fn expose(
        &self,
        seq: u64,
        shares: Option<&[f32]>,
        (light, growth): (f64, Vector2<f64>),
    ) -> Vec<u8> {
        let Picture { bead_grey, ground_grey, noise_grey, .. } = self.picture;
        let step = bead_grey - ground_grey;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(hash::mix(&[self.seed, seq]));
        let (width, height) = self.size;
        let mut pixels = Vec::with_capacity(width * height);
        for row in 0..height {
            let shares = shares.and_then(|shares| shares.get(row * width..(row + 1) * width));
            let row_light = light + growth.y * float(row);
            for column in 0..width {
                let share = shares.map_or(0.0, |shares| f64::from(shares[column]));
                let lit = row_light + growth.x * float(column);
                let mut grey = lit * (ground_grey + step * share);
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

/// The nearest level of 8 bits.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a float-to-integer cast saturates, as a sensor does"
)]
fn rounded(grey: f64) -> u8 {
    (grey + 0.5) as u8
}

#[expect(clippy::cast_precision_loss, reason = "pixel numbers stay far below 2^53")]
fn float(number: usize) -> f64 {
    number as f64
}

#[cfg(test)]
mod tests;
