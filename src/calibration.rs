//! What a pixel means in millimetres: the calibration model, its file, and how
//! it is found from pictures of a checkerboard.

pub mod board;
pub mod bundle;
pub mod camera;
pub mod charuco;
pub mod choose;
pub mod collect;
pub mod corner;
pub mod covariance;
pub mod coverage;
pub mod dictionary;
pub mod equations;
pub mod exchange;
mod factor;
pub mod file;
pub mod focus;
mod grey;
pub mod homography;
pub mod lens;
pub mod map;
mod marker;
pub mod model;
pub mod next_view;
pub mod offset;
pub mod outline;
pub mod plane;
mod pull;
pub mod quality;
pub mod refusal;
pub mod scale;
pub mod share;
pub mod share_map;
pub mod sighting;
pub mod solve;
#[cfg(test)]
mod synthetic;
pub mod uncertainty;
pub mod verify;

pub use camera::Camera;
pub use model::{Calibration, CalibrationQuality, SurfaceMap};
pub use uncertainty::CalibrationUncertainty;
