//! Where in the image the bead is measured, and what it looks like there.

use crate::calibration::SurfaceMap;
use crate::core::{ImagePoint, Mm, Roi, WidthRange};
use crate::numeric::number::to_f64;

/// How the bead runs in the image, to within 20 degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeadAxis {
    /// From top to bottom.
    Vertical,
    /// From left to right.
    Horizontal,
}

/// The bead against its surroundings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Polarity {
    /// The bead is the brighter.
    Bright,
    /// The bead is the darker.
    Dark,
    /// Either.
    Any,
}

/// How edges are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasureMethod {
    /// Sub-pixel edges along caliper lines across the bead.
    Caliper,
    /// The method of Shojaei Barjuei et al. 2022, eq. (1)–(3): an edge
    /// detector, two edge lines, the distance of their midpoints.
    EdgeLines,
}

/// What the bead's edges look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EdgeKind {
    /// Found from the frame.
    Auto,
    /// A step of brightness: the bead lies on ground that is brighter or darker.
    Step,
    /// A dark groove, beyond which the ground or another bead may be as bright
    /// as the bead itself.
    Groove,
}

/// Caliper lines along a gauge whose cell names no number: reference/accuracy.md, What is measured,
/// is for this number. More lines are shorter and noisier, fewer follow a bead less well.
pub const DEFAULT_CALIPERS: usize = 64;
/// Smallest contrast where the cell names none: about three times the noise of an
/// industrial camera at full scale \[grey levels of 256\].
pub const DEFAULT_MIN_CONTRAST_GREY: f64 = 6.0;
/// Largest standard deviation of a width where the cell names none, as a fraction of the width
/// (contract, `max_sigma` of the cell file).
pub const DEFAULT_MAX_SIGMA: f64 = 0.02;

/// Widths of a bead in pixels across the gauge's middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidthRangePx {
    /// The narrowest \[px\].
    pub min: f32,
    /// The widest \[px\].
    pub max: f32,
}

/// The gauge: region, orientation and expectations of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge {
    /// Region of interest in the image.
    pub roi: Roi,
    /// How the bead runs in the region.
    pub axis: BeadAxis,
    /// The bead against its surroundings.
    pub polarity: Polarity,
    /// Widths that are plausible.
    pub width_range: WidthRange,
    /// How edges are found.
    pub method: MeasureMethod,
    /// Number of caliper lines along the region.
    pub calipers: usize,
    /// Smallest step from ground to bead that is taken for an edge, on a scale
    /// of 256 grey levels.
    pub min_contrast_grey: f64,
    /// What the bead's edges look like.
    pub edge: EdgeKind,
    /// Largest standard deviation of a width that is measured, as a fraction of
    /// the width.
    pub max_sigma: f64,
    /// Exponent of the camera: grey = 255 · (light / white)^gamma. Where there is
    /// none, grey is proportional to light.
    pub gamma: Option<f64>,
}

impl Gauge {
    /// A gauge with the cell file's defaults for everything else.
    pub fn new(roi: Roi, axis: BeadAxis, polarity: Polarity, width_range: WidthRange) -> Self {
        Self {
            roi,
            axis,
            polarity,
            width_range,
            method: MeasureMethod::Caliper,
            calipers: DEFAULT_CALIPERS,
            min_contrast_grey: DEFAULT_MIN_CONTRAST_GREY,
            edge: EdgeKind::Auto,
            max_sigma: DEFAULT_MAX_SIGMA,
            gamma: None,
        }
    }

    /// Its length along the bead on a surface; `None` where an end does not see
    /// the surface.
    pub fn length_on(&self, map: &SurfaceMap) -> Option<Mm> {
        let view = GaugeView::new(self.roi, self.axis);
        let middle = 0.5 * to_f64(view.across - 1);
        // From boundary to boundary of its pixels, the first of which has its centre at 0.
        let ends = [-0.5, to_f64(view.along) - 0.5].map(|along| view.to_image(middle, along));
        Mm::new((map.to_mm(ends[1])? - map.to_mm(ends[0])?).norm()).ok()
    }
}

/// The gauge placed over an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeView {
    /// The region.
    pub roi: Roi,
    /// How the bead runs in it.
    pub axis: BeadAxis,
    /// Number of pixels across the bead.
    pub across: usize,
    /// Number of pixels along the bead.
    pub along: usize,
}

impl GaugeView {
    /// Lays a region over an image.
    pub fn new(roi: Roi, axis: BeadAxis) -> Self {
        let (across, along) = match axis {
            BeadAxis::Vertical => (roi.width, roi.height),
            BeadAxis::Horizontal => (roi.height, roi.width),
        };
        Self { roi, axis, across, along }
    }

    /// The image point of gauge coordinates.
    pub fn to_image(self, u: f64, v: f64) -> ImagePoint {
        let (x, y) = (to_f64(self.roi.x), to_f64(self.roi.y));
        match self.axis {
            BeadAxis::Vertical => ImagePoint::new(x + u, y + v),
            BeadAxis::Horizontal => ImagePoint::new(x + v, y + u),
        }
    }

    /// Gauge coordinates of an image point: across the bead, along it.
    pub fn from_image(self, at: ImagePoint) -> (f64, f64) {
        let (x, y) = (at.x - to_f64(self.roi.x), at.y - to_f64(self.roi.y));
        match self.axis {
            BeadAxis::Vertical => (x, y),
            BeadAxis::Horizontal => (y, x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauge_is_as_long_as_its_rows_or_its_columns() {
        let roi = Roi { x: 10, y: 20, width: 100, height: 50 };
        let range = WidthRange { min: Mm::ZERO, max: Mm::constant(50.0) };
        let gauge = |axis| Gauge::new(roi, axis, Polarity::Bright, range);
        let map = SurfaceMap::from_scale(0.1);
        let length = |axis| gauge(axis).length_on(&map).unwrap().get();
        assert!((length(BeadAxis::Vertical) - 5.0).abs() < 1e-9);
        assert!((length(BeadAxis::Horizontal) - 10.0).abs() < 1e-9);
    }
}
