//! The result of a measurement.

use super::reject::Reject;
use crate::calibration::SurfaceMap;
use crate::core::{ImagePoint, Mm};

/// A measured width and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthMeasurement {
    /// Distance between the bead's two edges at the surface, normal to the
    /// bead's axis, averaged over the gauge.
    pub width: Mm,
    /// Standard deviation of `width` against the true mean width within the
    /// gauge, as the measurement estimates it: that of the image and, where it
    /// is known, the calibration's.
    pub sigma: Mm,
    /// Where the left (of a horizontal bead the upper) edge crosses the middle
    /// of the gauge, in raw image pixels.
    pub left: ImagePoint,
    /// Where the right (of a horizontal bead the lower) edge crosses it.
    pub right: ImagePoint,
    /// Angle of the bead's axis to the gauge's, in the image \[rad\].
    pub slant_rad: f64,
    /// Quality of the image, for setting up light and lens.
    pub hints: Hints,
}

impl WidthMeasurement {
    /// Adds the calibration's uncertainty to the image's own sigma.
    pub(super) fn with_calibration(self, surface: &SurfaceMap) -> Result<Self, Reject> {
        let Some(fraction) = surface.width_relative_sigma_of([self.left, self.right]) else {
            return Ok(self);
        };
        let variance = self.sigma.get().powi(2) + (fraction * self.width.get()).powi(2);
        let sigma = Mm::new(variance.sqrt()).map_err(|_| Reject::OffSurface)?;
        Ok(Self { sigma, ..self })
    }

    /// Refuses a width whose standard deviation is more than a fraction of it.
    /// `from_edges` is the standard deviation without the calibration's.
    pub(super) fn check_sigma(&self, from_edges: Mm, max_sigma: f64) -> Result<(), Reject> {
        let (width_mm, sigma_mm) = (self.width.get(), self.sigma.get());
        if sigma_mm <= max_sigma * width_mm {
            return Ok(());
        }
        let edges_sigma_mm = from_edges.get();
        Err(Reject::Unsure { width_mm, sigma_mm, edges_sigma_mm, max_sigma })
    }
}

/// How good the image is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hints {
    /// Step from ground to bead \[grey levels of 256\].
    pub contrast_grey: f64,
    /// Blur of the edges, as the standard deviation of a Gaussian \[px\].
    pub blur_px: f64,
    /// Noise of a pixel \[grey levels of 256\].
    pub noise_grey: f64,
    /// Fraction of the gauge's pixels that are at the end of the scale.
    pub saturated_fraction: f64,
    /// Fraction of the caliper lines that the width comes from.
    pub used_fraction: f64,
    /// How far the skew of the flanks moves the width; `None` where it was not requested, or the
    /// edges are no blurred steps.
    pub skew: Option<WidthSkew>,
}

/// How far the skew of the edges' flanks moves a width in the image: by a camera's gamma
/// that is not given, rounded shoulders of a bead, or a penumbra.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthSkew {
    /// Measured less true width \[px\].
    pub offset_px: f64,
    /// Variance of that \[px²\].
    pub variance: f64,
}

/// The edges as they were found, caliper by caliper, in raw image pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edges<'a> {
    /// The left (of a horizontal bead the upper) edge.
    pub left: &'a [ImagePoint],
    /// The right (of a horizontal bead the lower) edge.
    pub right: &'a [ImagePoint],
}

/// A caliper line with the edges that were found on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Caliper {
    /// Number of the line along the gauge, from 0.
    pub number: usize,
    /// The left (of a horizontal bead the upper) edge.
    pub left: Option<CaliperPoint>,
    /// The right (of a horizontal bead the lower) edge.
    pub right: Option<CaliperPoint>,
}

/// Where an edge was found on one caliper line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaliperPoint {
    /// In raw image pixels.
    pub at: ImagePoint,
    /// Standard deviation across the bead \[px\], as the pixels' noise explains it; `None` where
    /// the method has none.
    pub sigma_px: Option<f64>,
}
