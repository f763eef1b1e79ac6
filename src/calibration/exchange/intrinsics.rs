//! A camera and its lens, as far as other programs' files hold them.

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
    /// The format in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ros => "ROS camera_info",
            Self::OpenCv => "OpenCV",
        }
    }
}

/// A camera and its lens.
#[derive(Debug, Clone, PartialEq)]
pub struct Intrinsics {
    /// Size of the images \[px\].
    pub image_size_px: [u32; 2],
    /// Camera and lens.
    pub camera: Camera,
    /// Root mean square of the reprojection errors \[px\], if the file has it; only OpenCV's
    /// layout does.
    pub rms_px: Option<f64>,
    /// Name of the camera, if the file has it; only ROS's layout does.
    pub camera_name: Option<String>,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// Layout of the file, by its keys.
    pub format: Format,
    /// Its content.
    pub intrinsics: Intrinsics,
    /// What was assumed, and what was ignored.
    pub notes: Vec<String>,
}
