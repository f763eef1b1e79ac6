//! What a pixel means in millimetres: the calibration model, its file, and how
//! it is found from pictures of a checkerboard.

pub mod board;
pub mod camera;
pub mod covariance;
pub mod file;
pub mod model;
pub mod plane;
pub mod quality;
pub mod scale;
pub mod solve;
#[cfg(test)]
mod synthetic;

pub use camera::Camera;
pub use model::{Calibration, Quality, SurfaceMap};
