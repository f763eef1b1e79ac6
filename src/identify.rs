//! Models of an extruder from logged data: what to excite it with, how the
//! data are cleaned and aligned, and how models are fitted to them.

pub mod align;
pub mod autocorrelation;
pub mod band;
pub mod camera_offset;
pub mod command_profile;
pub mod digits;
pub mod excitation;
pub mod experiment;
pub mod fit;
pub mod flow;
pub mod grid;
pub mod library;
pub mod model_file;
pub mod output_lead;
pub mod prbs;
pub mod series;
pub mod start_stop;
pub mod table;
