//! Why no camera model is found.

/// Smallest number of images: two poses determine the focal length without redundancy (Zhang
/// 2000, section 3.1).
pub const MIN_VIEWS: usize = 3;

/// Reprojection error beyond which a fit is refused \[px\]. A choice: a miscounted board
/// exceeds it.
pub(super) const MAX_RMS_PX: f64 = 3.0;

/// No camera model can be found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Too few images show the board.
    #[error(
        "{found} image(s) show the board, at least {MIN_VIEWS} must: take 10 to 20, \
         tilted to several sides, that fill the image between them"
    )]
    TooFew {
        /// Images that show it.
        found: usize,
    },
    /// The corners of an image fit no pose.
    #[error("{name}: the corners fit no board before a camera; leave the image out")]
    NoPose {
        /// The image's name.
        name: String,
    },
    /// The corners do not fit any camera.
    #[error(
        "the corners are {rms_px:.1} px off where the best camera would see them, more than \
         {MAX_RMS_PX} px: look for a wrong count of corners (--board), or images with another \
         zoom or focus among them"
    )]
    NoFit {
        /// Root mean square of the reprojection errors \[px\].
        rms_px: f64,
    },
    /// The fit ended at invalid parameters.
    #[error(
        "the fit did not settle on a camera (focal lengths {} and {} px): \
         tilt the board more, and check that it is flat and counted right",
        focal_px[0], focal_px[1]
    )]
    NoCamera {
        /// The focal lengths it ended at \[px\].
        focal_px: [f64; 2],
    },
}
