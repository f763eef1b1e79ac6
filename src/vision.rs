//! Measuring the bead: from grey pixels to a width with its standard
//! deviation, or a reason for refusing. Pure, and without allocation once a
//! [`Measurer`] has seen its first frame.
//!
//! ```text
//! gamma         grey levels of a camera with a gamma → light
//! strip         frame → rows across the bead
//! pixel_noise   rows → noise of a pixel
//! pool          rows → bands, a profile of a few rows each
//! edge          profile → the strongest steps
//! contour       steps → edges that run along the bead
//! pair          contours → the two edges of the bead
//! trace         contour → sub-pixel positions, one a caliper line, from all rows:
//!               path, overlay (blur, surroundings), template, bands; texture and
//!               whiten where the surroundings are not plain
//! occluded      the same for edges that are found from the other edge (parallel)
//! clipped_step  the same for edges with a saturated side (censor)
//! refine        the same for edges that are no blurred steps (fit, blur)
//! outlier       positions that disagree with their neighbours
//! axis          positions → width normal to the bead, on the surface (curve, scatter,
//!               waviness)
//! roughness     local widths of successive frames → roughness of the bead
//! ```
//!
//! The loops over pixels are compiled for each vector width of the processor. The widest
//! that it has runs.
//!
//! [`MeasureMethod::EdgeLines`] is the method of Shojaei Barjuei et al. 2022 instead, as
//! a baseline.

#![expect(
    clippy::inline_always,
    reason = "a loop takes part in the choice of vectors only where it is inlined into it"
)]

mod axis;
mod blur;
mod blur_estimate;
mod buffer;
mod censor;
mod clipped_step;
mod coarse;
mod consensus;
mod contour;
mod corner;
mod curve;
mod edge;
mod edge_lines;
mod edge_windows;
mod fit;
mod gamma;
pub mod gauge;
mod ground;
mod light;
mod line;
mod located;
mod mean_edge;
mod measure;
mod motion;
mod occluded;
mod outlier;
mod overlay;
mod pair;
mod parallel;
mod path;
mod phase;
mod pixel_noise;
mod pool;
mod refine;
pub mod reject;
mod repeated;
mod rough;
pub mod roughness;
mod row_range;
mod saturated;
mod scatter;
mod strip;
mod template;
mod texture;
mod trace;
mod vectors;
mod waviness;
mod whiten;
pub mod width;

pub use gauge::{BeadAxis, EdgeKind, Gauge, MeasureMethod, Polarity};
pub use measure::Measurer;
pub use reject::Reject;
pub use repeated::RepeatDetector;
pub use roughness::{LocalWidths, Roughness, RoughnessEstimator};
pub use width::{Caliper, CaliperPoint, Edges, Hints, WidthMeasurement, WidthSkew};
