//! Drawings that all pages use: axes, curves, strips, legends and their colours.

pub mod area;
pub mod axis;
pub mod histogram;
pub mod legend;
pub mod palette;
pub mod pauses;
pub mod plot;
pub mod range;
pub mod series;
pub mod strip;
pub mod strips;

pub use area::{Area, XAxis};
pub use axis::AxisScale;
pub use legend::legend;
pub use palette::Ink;
pub use plot::{Plot, PlotLayer, wide_plot, y_range};
pub use range::ValueRange;
pub use series::PlotCurve;
pub use strip::{Mark, Strip};
pub use strips::StripRow;
