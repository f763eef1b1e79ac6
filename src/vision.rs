//! Measuring the bead: from grey pixels to a width with its standard
//! deviation, or a reason for refusing. Pure, and without allocation once a
//! [`Measurer`] has seen its first frame.

pub mod gauge;
pub mod reject;
pub mod width;

pub use gauge::{Axis, Gauge, Method, Polarity};
pub use reject::Reject;
pub use width::{Edges, Hints, WidthMeasurement};
