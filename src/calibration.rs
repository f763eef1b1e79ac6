//! From pixels to millimetres: the calibration model, its file, and its estimation from images of a
//! checkerboard.

pub mod board;
mod board_fit;
pub mod board_observation;
pub mod bundle;
pub mod camera;
pub mod charuco;
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
pub mod lens_selection;
mod marker;
pub mod model;
pub mod next_view;
pub mod nozzle_offset;
pub mod outline;
pub mod plane;
pub mod rejection;
pub mod relative_sigma;
pub mod relative_sigma_map;
pub mod scale;
pub mod solve;
#[cfg(test)]
mod synthetic;
pub mod uncertainty;
pub mod verify;
pub mod view_information;
pub mod warnings;
pub mod width_map;

pub use camera::Camera;
pub use model::{Calibration, CalibrationQuality, SurfaceMap};
pub use uncertainty::CalibrationUncertainty;
