//! What a pixel means in millimetres: the calibration model, its file, and how
//! it is found from pictures of a checkerboard.

pub mod camera;
pub mod model;

pub use camera::Camera;
pub use model::{Calibration, Quality, SurfaceMap};
