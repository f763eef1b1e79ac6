//! Models of an extruder from logged data: what to excite it with, how the
//! data are cleaned and aligned, and how models are fitted to them.

pub mod ahead;
pub mod align;
pub mod band;
pub mod camera_offset;
pub mod excitation;
pub mod experiment;
pub mod file;
pub mod fit;
pub mod flow;
pub mod grid;
pub mod library;
pub mod number;
pub mod prbs;
pub mod profile;
pub mod residual;
pub mod series;
pub mod start_stop;
pub mod table;
