//! Configuration files: read strictly, with every violation reported at once,
//! each with its line.

pub mod control;
mod controller;
pub mod drivers;
pub mod extruder;
pub mod file;
pub mod pulses;

pub use file::{CameraSettings, Cell, ImageSource, Mount, RecordingSettings, RobotSettings};
