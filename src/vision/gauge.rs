//! Where in the image the bead is measured, and what it looks like there.

use crate::geometry::Roi;
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
