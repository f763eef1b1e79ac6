//! Where in the image the bead is measured, and what it looks like there.

use crate::calib::SurfaceMap;
use crate::geometry::{ImagePoint, Roi};
use crate::units::Mm;

/// How the bead runs in the image, to within 20 degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
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
pub enum Method {
    /// Sub-pixel edges along caliper lines across the bead.
    Caliper,
    /// The method of Shojaei Barjuei et al. 2022, eq. (1)–(3): an edge
    /// detector, two edge lines, the distance of their midpoints.
    EdgeLines,
}

/// The gauge: region, orientation and expectations of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gauge {
    /// Region of interest in the image.
    pub roi: Roi,
    /// How the bead runs in the region.
    pub axis: Axis,
    /// The bead against its surroundings.
    pub polarity: Polarity,
    /// Narrowest and widest bead that is believed.
    pub width_range: (Mm, Mm),
    /// How edges are found.
    pub method: Method,
    /// Number of caliper lines along the region.
    pub calipers: usize,
    /// Smallest step from ground to bead that is taken for an edge, on a scale
    /// of 256 grey levels.
    pub min_contrast_grey: f64,
}

impl Gauge {
    /// Its length along the bead on a surface; `None` where an end does not see
    /// the surface.
    pub fn length_on(&self, map: &SurfaceMap) -> Option<Mm> {
        let roi = self.roi;
        #[expect(clippy::cast_precision_loss, reason = "pixel numbers stay far below 2^53")]
        let [x, y, width, height] = [roi.x, roi.y, roi.width, roi.height].map(|px| px as f64);
        let (across, along) = (x + 0.5 * (width - 1.0), y + 0.5 * (height - 1.0));
        // From border to border of its pixels, the first of which has its centre at 0.
        let ends = match self.axis {
            Axis::Vertical => {
                [ImagePoint::new(across, y - 0.5), ImagePoint::new(across, y + height - 0.5)]
            }
            Axis::Horizontal => {
                [ImagePoint::new(x - 0.5, along), ImagePoint::new(x + width - 0.5, along)]
            }
        };
        Mm::new((map.to_mm(ends[1])? - map.to_mm(ends[0])?).norm()).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauge_is_as_long_as_its_rows_or_its_columns() {
        let gauge = |axis| Gauge {
            roi: Roi { x: 10, y: 20, width: 100, height: 50 },
            axis,
            polarity: Polarity::Bright,
            width_range: (Mm::ZERO, Mm::constant(50.0)),
            method: Method::Caliper,
            calipers: 64,
            min_contrast_grey: 6.0,
        };
        let map = SurfaceMap::from_scale(0.1);
        let length = |axis| gauge(axis).length_on(&map).unwrap().get();
        assert!((length(Axis::Vertical) - 5.0).abs() < 1e-9);
        assert!((length(Axis::Horizontal) - 10.0).abs() < 1e-9);
    }
}
