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
