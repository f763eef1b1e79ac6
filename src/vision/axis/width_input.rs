//! Input of the width: two edges, and the map to the surface.

use crate::calibration::SurfaceMap;
use crate::core::SurfacePoint;
use crate::vision::curve::{EdgeCurve, EdgePoint};
use crate::vision::gauge::{Gauge, GaugeView};
use crate::vision::located::CaliperEdge;

/// One edge as it was found.
#[derive(Debug, Clone, Copy)]
pub struct LocatedEdge<'a> {
    /// Its positions, band by band.
    pub positions: &'a [Option<CaliperEdge>],
    /// Variance of the error that all positions of the edge share \[px²\].
    pub common_variance: f64,
    /// Residual of a row from the step that it is compared with, in standard deviations of its
    /// noise; infinite where it was compared with none.
    pub misfit: f64,
    /// Variance of the mean position over the gauge \[px²\], where it is known without the
    /// residuals of the positions.
    pub mean_variance: Option<f64>,
}

/// Two edges, and the map to the surface.
#[derive(Debug, Clone, Copy)]
pub struct WidthInput<'a> {
    /// The gauge over the image.
    pub view: &'a GaugeView,
    /// From pixels to millimetres.
    pub surface: &'a SurfaceMap,
    /// Region of interest, and the widths that are accepted.
    pub gauge: &'a Gauge,
    /// Middles of the bands along the bead \[px\].
    pub middles: &'a [f64],
    /// Left and right edge.
    pub sides: [LocatedEdge<'a>; 2],
}

/// Buffers that are kept from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct WidthScratch {
    pub(super) off: [Vec<Option<f64>>; 2],
    pub(super) values: Vec<f64>,
}

impl WidthInput<'_> {
    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    pub fn centre(&self) -> f64 {
        (self.view.along - 1) as f64 / 2.0
    }

    #[expect(clippy::cast_precision_loss, reason = "pixel coordinates are small")]
    pub fn half_length(&self) -> f64 {
        self.view.along as f64 / 2.0
    }

    /// Position of a band along the gauge, −1 to 1.
    pub fn normalised_position(&self, band: usize) -> f64 {
        (self.middles[band] - self.centre()) / self.half_length()
    }

    pub fn points(&self, side: usize) -> impl Iterator<Item = EdgePoint> + Clone {
        let places = self.sides[side].positions.iter().enumerate();
        places.filter_map(|(band, located)| {
            let CaliperEdge { at: u, row_fraction: weight, .. } = (*located)?;
            Some(EdgePoint { t: self.normalised_position(band), u, weight })
        })
    }

    /// Square of the cosine between the bead and the gauge's axis at a position.
    pub fn cosine_squared(&self, curves: &[EdgeCurve; 2], t: f64) -> f64 {
        let slope = f64::midpoint(curves[0].slope(t), curves[1].slope(t)) / self.half_length();
        1.0 / (1.0 + slope * slope)
    }

    /// Point of an edge on the surface \[mm\]; `None` where the pixel does not see it.
    pub fn on_surface(&self, curve: &EdgeCurve, t: f64) -> Option<SurfacePoint> {
        let v = self.centre() + t * self.half_length();
        self.surface.to_mm(self.view.to_image(curve.at(t), v))
    }
}
