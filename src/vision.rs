//! Measuring the bead: from grey pixels to a width with its standard
//! deviation, or a reason for refusing. Pure, and without allocation once a
//! [`Measurer`] has seen its first frame.
//!
//! ```text
//! pool    rows → bands, one averaged profile each
//! edge    profile → the strongest steps
//! pair    steps → the chain of pairs that runs along the bead
//! refine  chain → sub-pixel edges (step, fit, blur)
//! outlier edges that disagree with their neighbours
//! axis    edges → width normal to the bead, on the surface
//! ```
//!
//! [`Method::EdgeLines`] is the method of the 2022 paper instead, as a
//! baseline.

mod axis;
mod contour;
mod curve;
mod edge;
mod edge_lines;
pub mod gauge;
mod measure;
mod noise;
mod outlier;
mod overlay;
mod pair;
mod path;
mod pool;
pub mod reject;
mod scatter;
mod step;
mod strip;
mod template;
mod trace;
pub mod width;

pub use gauge::{Axis, Gauge, Method, Polarity};
pub use measure::Measurer;
pub use reject::Reject;
pub use width::{Edges, Hints, WidthMeasurement};
