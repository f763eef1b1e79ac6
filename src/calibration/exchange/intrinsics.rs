//! What files of others and ours have in common: a camera and its lens.

use crate::calibration::Camera;

/// Whose layout a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `camera_info` as ROS's calibration writes it, or as a message is printed.
    Ros,
    /// `FileStorage` as OpenCV's calibration sample writes it.
    OpenCv,
}

impl Format {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ros => "ROS camera_info",
            Self::OpenCv => "OpenCV",
        }
    }
}

/// What can be exchanged.
#[derive(Debug, Clone, PartialEq)]
pub struct Intrinsics {
    /// Size of the pictures \[px\].
    pub image_size_px: [u32; 2],
    /// Camera and lens.
    pub camera: Camera,
    /// Root mean square of the reprojection errors \[px\], where it is told; only
    /// OpenCV's layout has a place for it.
    pub rms_px: Option<f64>,
    /// The camera's name, where it is told; only ROS's layout has a place for it.
    pub camera_name: Option<String>,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// Whose it is, by its keys.
    pub format: Format,
    /// What it holds.
    pub intrinsics: Intrinsics,
    /// What was assumed, and what else stands in it and is not taken over.
    pub notes: Vec<String>,
}
